"""The position table P[n] and its index: commands 3 (RC-420 manual 13.4, 14)."""

from collections.abc import Callable
from dataclasses import replace

from protocols.rorze.notation import PositionReference
from protocols.rorze.position import SignedPulses
from protocols.rorze.position_table import (
    AddToPositionEntry,
    ClearPositionEntries,
    DividePositionEntry,
    GetNumberedPositionEntry,
    GetPositionEntry,
    GetPositionIndex,
    MultiplyPositionEntry,
    NumberedPositionEntry,
    PositionIndex,
    SetPositionEntry,
    SetPositionIndex,
    SubtractFromPositionEntry,
)
from simulator.rorze.actions import OUT_OF_RANGE, Refused, acts_out
from simulator.rorze.controller import Rc420
from simulator.rorze.settings import FARTHEST, POSITIONS

_STEPS = {"next": 1, "previous": -1}


def number_of(axis: Rc420, entry: PositionReference) -> int:
    """The position number meant.

    :raises Refused: 5D where the index has been stepped past an end of the table.
    """
    number = entry.position if isinstance(entry.position, int) else axis.settings.position_index
    if not 0 <= number < POSITIONS:
        raise Refused(OUT_OF_RANGE)
    return number


def step_index(axis: Rc420, entry: object) -> None:
    """Step the index after a command that used it has been done; it may leave the table (13.4.3)."""
    if isinstance(entry, PositionReference) and isinstance(entry.position, str):
        index = axis.settings.position_index + _STEPS[entry.position]
        axis.settings = replace(axis.settings, position_index=index)


def _compute(axis: Rc420, entry: PositionReference, operation: Callable[[int], int]) -> None:
    number = number_of(axis, entry)
    result = operation(axis.positions[number])
    if abs(result) > FARTHEST:
        raise Refused(OUT_OF_RANGE)
    axis.positions[number] = result
    step_index(axis, entry)


@acts_out(AddToPositionEntry)
def _add(axis: Rc420, command: AddToPositionEntry, _now: float) -> None:
    _compute(axis, command.entry, lambda pulses: pulses + command.amount)


@acts_out(SubtractFromPositionEntry)
def _subtract(axis: Rc420, command: SubtractFromPositionEntry, _now: float) -> None:
    _compute(axis, command.entry, lambda pulses: pulses - command.amount)


@acts_out(MultiplyPositionEntry)
def _multiply(axis: Rc420, command: MultiplyPositionEntry, _now: float) -> None:
    _compute(axis, command.entry, lambda pulses: pulses * command.factor)


@acts_out(DividePositionEntry)
def _divide(axis: Rc420, command: DividePositionEntry, _now: float) -> None:
    """Towards zero, an assumption."""
    _compute(axis, command.entry, lambda pulses: int(pulses / command.divisor))


@acts_out(ClearPositionEntries)
def _clear_entries(axis: Rc420, _: ClearPositionEntries, _now: float) -> None:
    axis.positions = [0] * POSITIONS


@acts_out(GetPositionIndex)
def _get_index(axis: Rc420, _: GetPositionIndex, _now: float) -> PositionIndex:
    """An index that has left the table is refused like its use, an assumption."""
    index = axis.settings.position_index
    if not 0 <= index < POSITIONS:
        raise Refused(OUT_OF_RANGE)
    return PositionIndex(position=index)


@acts_out(SetPositionIndex)
def _set_index(axis: Rc420, command: SetPositionIndex, _now: float) -> None:
    axis.settings = replace(axis.settings, position_index=command.position)


@acts_out(GetPositionEntry)
def _get_entry(axis: Rc420, command: GetPositionEntry, _now: float) -> SignedPulses:
    number = number_of(axis, command.entry)
    step_index(axis, command.entry)
    return SignedPulses(pulses=axis.positions[number])


@acts_out(GetNumberedPositionEntry)
def _get_numbered_entry(axis: Rc420, command: GetNumberedPositionEntry, _now: float) -> NumberedPositionEntry:
    number = number_of(axis, command.entry)
    step_index(axis, command.entry)
    return NumberedPositionEntry(position=number, pulses=axis.positions[number])


@acts_out(SetPositionEntry)
def _set_entry(axis: Rc420, command: SetPositionEntry, now: float) -> None:
    number = number_of(axis, command.entry)
    axis.positions[number] = axis.position(now) if command.pulses is None else command.pulses
    step_index(axis, command.entry)
