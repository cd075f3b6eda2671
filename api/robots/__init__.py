"""Fics robots over HTTP."""
