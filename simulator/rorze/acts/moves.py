"""Moves at high and low speed: commands 1 and 2 (RC-420 manual 13.2, 13.3, 14)."""

from collections.abc import Callable
from functools import partial
from typing import Literal

from protocols.rorze.moves import (
    MoveClockwise,
    MoveClockwiseSlowly,
    MoveCounterclockwise,
    MoveCounterclockwiseSlowly,
    MoveTo,
    MoveToSlowly,
)
from protocols.rorze.notation import PositionReference
from protocols.rorze.profile import Profile, ProfileError, plan, plan_slow
from simulator.rorze.actions import OUT_OF_RANGE, Refused, acts_out
from simulator.rorze.acts.encoder import correction
from simulator.rorze.acts.patterns import Ramps, changes_of, ramps_of
from simulator.rorze.acts.position_table import number_of, step_index
from simulator.rorze.controller import Rc420
from simulator.rorze.motion import Direction
from simulator.rorze.motor import Leg, Task, limit_ahead
from simulator.rorze.settings import FARTHEST
from simulator.rorze.world import CCW, CW, EMS

EMS_ON, STALLED, LIMIT_ON, TOO_FAR, ERROR_OUTPUT_ON = 0x51, 0x52, 0x55, 0x5E, 0x66

RelativeMove = MoveClockwise | MoveCounterclockwise | MoveClockwiseSlowly | MoveCounterclockwiseSlowly
AbsoluteMove = MoveTo | MoveToSlowly


def require_safe(axis: Rc420) -> None:
    """Require a state of the controller in which a move is taken.

    :raises Refused: 51 with EMS on, 66 with an error output standing.
    """
    if axis.sees(EMS):
        raise Refused(EMS_ON)
    if axis.io.error_output_on():
        raise Refused(ERROR_OUTPUT_ON)


def require_free(axis: Rc420, direction: Direction) -> None:
    """Require that the way in one direction is free.

    The limit sensor ahead refuses it, the one behind does not, an assumption: how else to leave a limit.

    :raises Refused: 51, 52, 55 or 66.
    """
    require_safe(axis)
    if axis.stalls:
        raise Refused(STALLED)
    if axis.sees(limit_ahead(direction)):
        raise Refused(LIMIT_ON)


def _profile(axis: Rc420, distance: int | None, pattern: int | None, low: bool) -> Profile:
    make = plan_slow if low else plan
    try:
        return make(distance, *ramps_of(axis, pattern), changes_of(axis, pattern))
    except ProfileError as error:
        raise Refused(error.code) from None


def require_in_range(axis: Rc420, target: int) -> None:
    """Refuse with 5D what would end outside the movable range (EPS)."""
    first, last = axis.settings.movable_range
    if not first <= target <= last:
        raise Refused(OUT_OF_RANGE)


def _straight(direction: Direction, profile: Profile, corrected: Callable[[float], Task]) -> Task:
    """A move of one leg and what corrects it; none at all where there is nothing to go."""
    if profile.distance != 0:
        now = yield Leg(direction, profile)
        yield from corrected(now)


def _amount(axis: Rc420, given: int | PositionReference | Literal["endless"]) -> int | None:
    """The distance to go, in the unit of the operating mode; None without an end."""
    if given == "endless":
        return None
    distance = axis.positions[number_of(axis, given)] if isinstance(given, PositionReference) else given
    if distance < 1:
        raise Refused(OUT_OF_RANGE)
    return distance


def _move_by(axis: Rc420, command: RelativeMove, now: float, direction: Direction, low: bool) -> None:
    amount = _amount(axis, command.distance)
    here = axis.position(now)
    require_in_range(axis, here + direction * (1 if amount is None else amount))
    _start(axis, command, direction, None if amount is None else here + direction * amount, low, now)


def _go_to(axis: Rc420, command: AbsoluteMove, now: float, low: bool) -> None:
    given = command.position
    target = axis.positions[number_of(axis, given)] if isinstance(given, PositionReference) else given
    require_in_range(axis, target)
    _start(axis, command, CW if target >= axis.position(now) else CCW, target, low, now)


def _start(
    axis: Rc420,
    command: RelativeMove | AbsoluteMove,
    direction: Direction,
    target: int | None,
    low: bool,
    now: float,
) -> None:
    """Begin a move to a position, or without an end."""
    distance = None if target is None else axis.to_pulses(abs(target - axis.position(now)))
    if distance is not None and distance > FARTHEST:
        raise Refused(TOO_FAR)
    profile = _profile(axis, distance, command.pattern, low)
    require_free(axis, direction)
    step_index(axis, command.distance if isinstance(command, RelativeMove) else command.position)
    corrected = correction(axis, target, Ramps(profile.acceleration, profile.deceleration))
    axis.start(command.code, _straight(direction, profile, corrected), now)


acts_out(MoveClockwise)(partial(_move_by, direction=CW, low=False))
acts_out(MoveCounterclockwise)(partial(_move_by, direction=CCW, low=False))
acts_out(MoveTo)(partial(_go_to, low=False))
acts_out(MoveClockwiseSlowly)(partial(_move_by, direction=CW, low=True))
acts_out(MoveCounterclockwiseSlowly)(partial(_move_by, direction=CCW, low=True))
acts_out(MoveToSlowly)(partial(_go_to, low=True))
