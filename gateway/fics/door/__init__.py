"""Rows of the door for robots that take the plant."""
