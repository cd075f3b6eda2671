"""Access control: keys, roles and scopes, sessions and tickets; nothing here knows HTTP."""
