"""Acceleration patterns A[n] and speed changes during their moves: commands S (RC-420 manual 13.3, 14)."""

from collections.abc import Sequence
from typing import NamedTuple

from protocols.rorze.patterns import (
    GetPattern,
    GetPatternPulses,
    GetSpeedChange,
    GetSpeedChangePulses,
    PatternPulses,
    PatternSpeedSets,
    SetPattern,
    SetSpeedChange,
    SpeedChangePoint,
    SpeedChangePulses,
)
from protocols.rorze.profile import (
    ChangeSpan,
    ProfileError,
    SpeedChange,
    SpeedParameters,
    ramp_pulses,
    resolve_changes,
)
from simulator.rorze.actions import Refused, acts_out
from simulator.rorze.acts.speeds import parameters_of
from simulator.rorze.controller import Rc420
from simulator.rorze.settings import STANDARD, Pattern

NO_PATTERN = 0x47


class Ramps(NamedTuple):
    """The speed parameters of a pattern's acceleration and deceleration."""

    up: SpeedParameters
    down: SpeedParameters


def pattern_of(axis: Rc420, number: int | None) -> Pattern:
    """A pattern; None is the standard one.

    :raises Refused: 47 where it was never set.
    """
    pattern = axis.settings.patterns[STANDARD if number is None else number]
    if pattern is None:
        raise Refused(NO_PATTERN)
    return pattern


def ramps_of(axis: Rc420, number: int | None) -> Ramps:
    """The ramps of a pattern; None is the standard one.

    :raises Refused: 40-47.
    """
    pattern = pattern_of(axis, number)
    return Ramps(parameters_of(axis, pattern.acceleration), parameters_of(axis, pattern.deceleration))


def changes_of(axis: Rc420, number: int | None) -> list[SpeedChange]:
    """The speed changes of a pattern, in the order of their numbers; the standard one has none."""
    changes = {} if number is None else axis.speed_changes.get(number, {})
    return [changes[point] for point in sorted(changes)]


def _spans(ramps: Ramps, changes: Sequence[SpeedChange]) -> tuple[ChangeSpan, ...]:
    try:
        return resolve_changes(ramps.up, ramps.down, changes)
    except ProfileError as error:
        raise Refused(error.code) from None


@acts_out(GetPattern)
def _get_pattern(axis: Rc420, command: GetPattern, _now: float) -> PatternSpeedSets:
    pattern = pattern_of(axis, command.pattern)
    return PatternSpeedSets(acceleration=pattern.acceleration, deceleration=pattern.deceleration)


@acts_out(SetPattern)
def _set_pattern(axis: Rc420, command: SetPattern, _now: float) -> None:
    pattern = Pattern(command.acceleration, command.deceleration)
    axis.settings = axis.settings.with_item("patterns", command.pattern, pattern)


@acts_out(GetPatternPulses)
def _get_pattern_pulses(axis: Rc420, command: GetPatternPulses, _now: float) -> PatternPulses:
    up, down = ramps = ramps_of(axis, command.pattern)
    _spans(ramps, changes_of(axis, command.pattern))
    return PatternPulses(
        acceleration=ramp_pulses(up, up.low, up.high), deceleration=ramp_pulses(down, down.high, down.low)
    )


@acts_out(GetSpeedChangePulses)
def _get_speed_change_pulses(axis: Rc420, command: GetSpeedChangePulses, _now: float) -> SpeedChangePulses:
    up, down = ramps_of(axis, command.pattern)
    ramp = up if command.end_speed > command.start_speed else down
    return SpeedChangePulses(pulses=ramp_pulses(ramp, command.start_speed, command.end_speed))


@acts_out(GetSpeedChange)
def _get_speed_change(axis: Rc420, command: GetSpeedChange, _now: float) -> SpeedChangePoint:
    changes = axis.speed_changes.get(command.pattern, {})
    if command.point not in changes:
        return SpeedChangePoint()
    spans = _spans(ramps_of(axis, command.pattern), changes_of(axis, command.pattern))
    span = spans[sorted(changes).index(command.point)]
    return SpeedChangePoint(begin=span.start, end=span.end, speed=span.speed)


@acts_out(SetSpeedChange)
def _set_speed_change(axis: Rc420, command: SetSpeedChange, _now: float) -> None:
    """The pattern must be complete; whether the change suits it is left to the move (13.3.7)."""
    if command.point is None or command.speed is None:
        axis.speed_changes.pop(command.pattern, None)
        return
    ramps_of(axis, command.pattern)
    if command.begin is not None:
        change = SpeedChange("F", command.begin, command.speed)
    else:
        change = SpeedChange("T", command.end or 0, command.speed)
    axis.speed_changes.setdefault(command.pattern, {})[command.point] = change
