"""Bytes to typed commands, answers and events, and back; no I/O and no clock."""
