"""The question that reads a command back, and the comparison of its answer with the command."""

from itertools import zip_longest
from math import isclose
from typing import Any, Final

from gateway.fics.axes import DISPLAYED
from protocols.fics.axis_settings import CoordinateSetting
from protocols.fics.commands import COMMANDS
from protocols.fics.inputs_outputs import ChannelBits, GetOutputChannel, SwitchOutput
from protocols.fics.row import FicsCommand
from protocols.fics.system import SelectUnit, UnitNumbers
from protocols.table import Reply

READINGS: Final = 2
"""The readings after which a difference counts: no checksum tells a garbled answer from another one."""
PRECISION: Final = 1e-6
"""Numbers that differ by less than this part of them are one: those of 32 bits have no more digits."""


def query_of(command: FicsCommand[Any]) -> FicsCommand[Any] | None:
    """The query that reads back what a command sets: that of its name, for IOT IDO; None without one."""
    if isinstance(command, SwitchOutput):
        return GetOutputChannel(channel=command.channel)
    for row in COMMANDS.get(command.code, ()):
        if row.is_query():
            return row(**{field: getattr(command, field) for field in row.model_fields})
    return None


def tells(command: FicsCommand[Any], reply: Reply) -> bool:
    """True if a reply tells what a command was to set; what it leaves as it is may be anything."""
    if isinstance(command, SwitchOutput) and isinstance(reply, ChannelBits):
        return bool(reply.bits >> command.bit & 1) == command.on
    if isinstance(command, SelectUnit) and isinstance(reply, UnitNumbers):
        return reply.host_unit == command.unit
    step = DISPLAYED if isinstance(command, CoordinateSetting) else 0.0
    return all(
        _alike(getattr(command, field), getattr(reply, field, None), step)
        for field in type(command).model_fields
    )


def _alike(wanted: Any, found: Any, step: float) -> bool:
    """Compare values, in lists one by one; None leaves an axis as it is."""
    if isinstance(wanted, list):
        pairs = zip_longest(wanted, (found or [])[: len(wanted)])
        return all(one is None or _alike(one, other, step) for one, other in pairs)
    return found is not None and same_number(wanted, found, step)


def same_number(wanted: float, found: float, step: float = 0.0) -> bool:
    """True if a number is another as a robot displays it: cut or rounded to a multiple of `step`."""
    if step:
        return abs(wanted - found) < step * (1 - PRECISION)
    return isclose(wanted, found, rel_tol=PRECISION, abs_tol=PRECISION)
