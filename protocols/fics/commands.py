"""The whole C-HOST table: every row, by the three letters it begins with and by its English name."""

from collections.abc import Iterator, Mapping
from itertools import groupby
from types import MappingProxyType, ModuleType
from typing import Any, Final

from protocols.fics import (
    alarms,
    homing,
    inputs_outputs,
    jog,
    macros,
    motor_axes,
    moves,
    positions,
    soft_limits,
    speeds,
    status,
    stops,
    system,
    variables,
)
from protocols.fics.macros import RunMacro
from protocols.fics.row import FicsCommand
from protocols.table import SyntaxFault

Row = type[FicsCommand[Any]]

TOPICS: Final = (
    system,
    jog,
    homing,
    moves,
    stops,
    status,
    alarms,
    speeds,
    positions,
    inputs_outputs,
    soft_limits,
    variables,
    macros,
    motor_axes,
)


def _rows(topic: ModuleType) -> Iterator[Row]:
    for item in vars(topic).values():
        is_row = isinstance(item, type) and issubclass(item, FicsCommand) and bool(item.example)
        if is_row and item.__module__ == topic.__name__:
            yield item


ROWS: Final[tuple[Row, ...]] = tuple(row for topic in TOPICS for row in _rows(topic))
COMMANDS: Final[Mapping[str, tuple[Row, ...]]] = MappingProxyType(
    {code: tuple(rows) for code, rows in groupby(ROWS, lambda row: row.code) if code}
)
"""The rows of each three-letter name: a setting and its query share one. Macros have names of their own."""
BY_NAME: Final[Mapping[str, Row]] = MappingProxyType({row.name(): row for row in ROWS})
_OF_THE_ROBOT: Final = frozenset(
    topic.__name__ for topic in (alarms, inputs_outputs, stops, system, variables)
)


def of_the_robot(row: Row) -> bool:
    """Say whether a row speaks to the robot as a whole, whichever unit is selected."""
    return row.__module__ in _OF_THE_ROBOT


def read(name: str, arguments: str) -> FicsCommand[Any]:
    """Read a command; a name that is no command's is a macro's.

    :raises SyntaxFault: the arguments have none of the forms of this name.
    :raises RangeFault: a value is outside its range.
    """
    if name not in COMMANDS:
        return RunMacro.read(f"{name} {arguments}".rstrip())
    fault = SyntaxFault("")
    for row in COMMANDS[name]:
        try:
            return row.read(arguments)
        except SyntaxFault as error:
            fault = error
    raise fault
