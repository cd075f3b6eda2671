"""The door: everything that callers may ask for, whichever front end they come through."""

from gateway.door.opening import Door, opened
from gateway.door.table import operations

__all__ = ["Door", "opened", "operations"]
