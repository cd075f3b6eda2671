"""Enumerations whose members are looked up for every frame."""

from enum import Enum
from typing import TypeVar

E = TypeVar("E", bound=Enum)


def at_hand(enumeration: type[E]) -> type[E]:
    """Keep the members as plain attributes, as Python 3.12 does, and hash them by identity.

    Python 3.11 calls a function for each look-up of a member, and another for each hash.
    """
    for name, member in enumeration.__members__.items():
        type.__setattr__(enumeration, name, member)
    if enumeration.__hash__ is Enum.__hash__:
        type.__setattr__(enumeration, "__hash__", object.__hash__)
    return enumeration
