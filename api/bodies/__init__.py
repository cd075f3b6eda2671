"""RC-420 bodies and their groups over HTTP."""
