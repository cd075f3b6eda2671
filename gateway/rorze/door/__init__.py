"""What callers may ask of bodies, groups and their lines that takes the plant."""
