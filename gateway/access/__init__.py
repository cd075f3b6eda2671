"""Who may do what: keys, roles and scopes, sessions and tickets; nothing here knows HTTP."""
