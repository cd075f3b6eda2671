"""What callers may ask of robots that takes the plant."""
