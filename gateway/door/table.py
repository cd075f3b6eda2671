"""The table of all operations: those that families list beside what they do."""

from collections.abc import Iterator

from gateway.core.operation import Operation, Rows
from gateway.families import FAMILIES


def operations() -> Iterator[Operation]:
    """All of them, section by section."""
    for rows in _sections():
        yield from rows


def _sections() -> Iterator[Rows]:
    for family in FAMILIES.values():
        yield from family.rows
