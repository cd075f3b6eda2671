"""What callers may ask of SCARA robots."""
