"""The RORZE RC-420 and RC-400: the command table, the link and the error codes."""
