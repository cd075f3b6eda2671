"""Faults of the demo, and the way back: stories, tests and a page of the documents."""
