"""What goes over the wire for a fixed script of requests: a change of structure changes no byte of it."""
