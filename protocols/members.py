"""Enumerations whose members are looked up for every frame."""

from enum import Enum
from typing import TypeVar

E = TypeVar("E", bound=Enum)


def at_hand(enumeration: type[E]) -> type[E]:
    """Keep the members as plain attributes, as Python 3.12 does: 3.11 calls a function for each look-up."""
    for name, member in enumeration.__members__.items():
        type.__setattr__(enumeration, name, member)
    return enumeration
