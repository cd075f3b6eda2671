"""The journal: what has an effect is written to the disk before its first byte is written to a line."""
