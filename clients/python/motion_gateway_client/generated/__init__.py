"""The generated part: see generate.py."""
