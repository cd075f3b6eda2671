"""DYNAX Fics robots and their C-HOST language: command rows, framing, errors."""
