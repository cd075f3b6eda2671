"""The door: everything that callers may ask for, whichever front end they come through."""

from gateway.door.table import operations

__all__ = ["operations"]
