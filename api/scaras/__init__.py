"""SCARA robots over HTTP."""
