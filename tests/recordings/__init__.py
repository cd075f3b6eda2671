"""The bytes on the wire for a fixed script of requests: a change of structure changes none of them."""
