"""The composition root: the command line, the server process and the demo."""
