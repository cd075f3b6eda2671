"""The rows of families and extensions that take the plant: the package `door` in the package of each.

A family cannot know the plant that it is part of, so these stand above it, and nothing imports them.
"""

from collections.abc import Iterator
from importlib import import_module
from importlib.util import find_spec
from pkgutil import iter_modules
from types import ModuleType

from gateway.core.family import Registered
from gateway.core.operation import Rows
from gateway.families import registered


def door_of(kind: type[Registered], module: str = "") -> ModuleType | None:
    """The door of a family or an extension, or a module of it, if there is one."""
    name = f"{kind.__module__.rpartition('.')[0]}.door"
    found = find_spec(name) and find_spec(f"{name}{module}")
    return import_module(f"{name}{module}") if found else None


def rows_of_door(kind: type[Registered]) -> Iterator[Rows]:
    """All rows in the modules of the door of a family or an extension."""
    package = door_of(kind)
    places = () if package is None else package.__path__
    for module in iter_modules(places, f"{package.__name__}." if package else ""):
        yield from (rows for rows in vars(import_module(module.name)).values() if isinstance(rows, Rows))


def doors(module: str, *kinds: type[Registered]) -> Iterator[ModuleType]:
    """The modules of this name in the doors of these, or of all."""
    found = (door_of(kind, f".{module}") for kind in kinds or registered())
    return (module for module in found if module is not None)
