"""What a move would do, asked without moving: the exact frame, and how long the pulses would run."""

import asyncio
from bisect import bisect_left
from collections.abc import Sequence
from operator import attrgetter
from typing import Any, Literal, NamedTuple

from pydantic import BaseModel, Field

from gateway.core.errors import ControllerRefused
from gateway.core.lanes import Lane
from gateway.core.move_record import CountedIn
from gateway.core.records import Record
from gateway.rorze.bodies import Body, Group
from gateway.rorze.limited_speed import Rate, limited_parameters
from gateway.texts import Text, text
from protocols.rorze.encoder import GetEncoderRatio
from protocols.rorze.modes import GetOperatingMode, GetSoftLimits
from protocols.rorze.moves import (
    AbsoluteMove,
    MoveClockwise,
    MoveClockwiseSlowly,
    MoveCounterclockwiseSlowly,
    MoveToSlowly,
    RelativeMove,
)
from protocols.rorze.notation import Bounds, PositionReference
from protocols.rorze.path import Knot
from protocols.rorze.patterns import GetPattern, GetSpeedChange
from protocols.rorze.position import GetPosition
from protocols.rorze.position_table import GetPositionEntry
from protocols.rorze.profile import (
    Profile,
    ProfileError,
    SpeedChange,
    SpeedParameters,
    plan,
    plan_slow,
    ramp_time_s,
)
from protocols.rorze.row import RorzeCommand
from protocols.rorze.speeds import (
    GetFallingAccelerationShare,
    GetMaximumAcceleration,
    GetMaximumSpeed,
    GetRisingAccelerationShare,
    GetStartSpeed,
)
from protocols.rorze.stops import GetStopSpeedSet
from protocols.table import Ack

SPEED_CHANGES = 16
"""Points a pattern may have (SES)."""
_SLOW = MoveClockwiseSlowly, MoveCounterclockwiseSlowly, MoveToSlowly
"""They run at the start speed (RC-420 manual 13.2)."""


class PlannedMove(Record):
    """A move that was checked and not sent."""

    body_id: str
    frame: str = Field(description="The exact bytes that would be sent, CR as \\r.")
    counted_in: CountedIn | None = Field(description="What the target's position is counted in.")
    distance: int | None = Field(
        description="Pulses it would emit; null where only the motion itself can tell."
    )
    target_position: int | None = Field(description="In `counted_in`, where it can be known beforehand.")
    duration_s: float | None = Field(description="How long pulses would run, with the settings of now.")
    note: str | None = Field(None, description="Why something is not known, or would be refused.")


class PlannedTrajectory(NamedTuple):
    """Where a move leads, by the time since its beginning."""

    profile: Profile
    start: int
    pulses_per_count: float
    """Negative where positions decrease."""

    def position(self, seconds: float) -> float:
        """The position as the controller would tell it."""
        return self.start + self.profile.position(seconds) / self.pulses_per_count

    def speed(self, seconds: float) -> float:
        """How fast that position changes a second; at the end as it arrives."""
        return self.profile.curve.at(seconds).speed / self.pulses_per_count


class AlongPath(NamedTuple):
    """Where an axis is led along a path with others, by the time since their start."""

    profile: Profile
    """Of the path, in micrometres."""
    start: int
    knots: Sequence[Knot]

    def position(self, seconds: float) -> float:
        """The position in pulses."""
        before, after, along = self._between(seconds)
        return self.start + before.pulses + (along - before.along) * _slope(before, after)

    def speed(self, seconds: float) -> float:
        """How fast that position changes a second; at the end as it arrives."""
        before, after, _ = self._between(seconds)
        return self.profile.curve.at(seconds).speed * _slope(before, after)

    def _between(self, seconds: float) -> tuple[Knot, Knot, float]:
        along = min(self.profile.position(seconds), self.knots[-1].along)
        place = bisect_left(self.knots, along, lo=1, hi=len(self.knots) - 1, key=attrgetter("along"))
        return self.knots[place - 1], self.knots[place], along


def _slope(before: Knot, after: Knot) -> float:
    """Pulses a micrometre."""
    return (after.pulses - before.pulses) / (after.along - before.along)


Planned = PlannedTrajectory | AlongPath


class GroupPlan(BaseModel):
    """A group's move that was checked and not sent."""

    group_id: str
    frame: str = Field(description="The exact bytes that would be sent, CR as \\r.")
    members: list[PlannedMove]


async def group_plan_of(group: Group, command: RorzeCommand[Any], limit: Rate | None = None) -> GroupPlan:
    """Work out the moves of all members; errors as of `plan_of`."""
    frame = group.line.frame_of(group.number, command)
    plans = await asyncio.gather(*(plan_of(member, command, limit) for member in group.members))
    members = [plan.model_copy(update={"frame": frame}) for plan in plans]
    return GroupPlan(group_id=group.address, frame=frame, members=members)


async def plan_of(body: Body, command: RorzeCommand[Ack], limit: Rate | None = None) -> PlannedMove:
    """Work out a move from the controller's present settings. Only reads are sent.

    `limit` is the highest speed that would be written before the move.

    :raises GatewayError: the settings could not be read.
    """
    async with body.looking():
        return await _plan_of(body, command, limit)


async def _plan_of(body: Body, command: RorzeCommand[Ack], limit: Rate | None) -> PlannedMove:
    frame = body.line.frame_of(body.number, command)
    position, _ = await body.ask(GetPosition())
    target = await target_of(body, command, position.pulses)
    planned = PlannedMove(
        body_id=body.address,
        frame=frame,
        counted_in=body.counted_in,
        distance=None,
        target_position=target,
        duration_s=None,
    )
    refusal = body.power.refusal(body.address, command)
    if refusal is not None:
        planned.note = f"It would be refused: {refusal.detail}"
        return planned
    if target is None or not isinstance(command, RelativeMove | AbsoluteMove):
        planned.note = "How far it goes is only known when it is done."
        return planned
    if crossed := await crossed_limit(body, target):
        planned.note = f"It would be refused: {crossed.said.en}."
        return planned
    planned.distance = round(abs(target - position.pulses) * await pulses_per_count(body))
    planned.counted_in = body.counted_in
    try:
        profile = await _profile(body, command, planned.distance, limit)
    except (ProfileError, ControllerRefused) as error:
        planned.note = f"It would be refused: {error}"
    else:
        planned.duration_s = profile.duration_s
    return planned


class CrossedLimit(NamedTuple):
    """A soft limit that a target lies beyond, in what the operating mode counts."""

    side: Literal["upper", "lower"]
    limit: int
    target: int
    unit: str

    @property
    def said(self) -> Text:
        """Say so: in English as a clause, in Japanese as a sentence."""
        return text(f"phrases.beyond-{self.side}", target=self.target, limit=self.limit, unit=self.unit)


async def crossed_limit(body: Body, target: int) -> CrossedLimit | None:
    """Give the soft limit that a target lies beyond; such a move is refused (RC-420 manual 14, EPS).

    :raises GatewayError: the limits were not read.
    """
    limits, _ = await body.ask(GetSoftLimits())
    return await crossed_of(body, limits, target)


async def crossed_of(body: Body, limits: Bounds, target: int) -> CrossedLimit | None:
    """Give that of a body's limits; errors as of `Body.know_mode`."""
    if limits.lower <= target <= limits.upper:
        return None
    unit = "encoder counts" if await body.know_mode() == "encoder" else "pulses"
    if target > limits.upper:
        return CrossedLimit("upper", limits.upper, target, unit)
    return CrossedLimit("lower", limits.lower, target, unit)


async def target_of(body: Body, command: RorzeCommand[Any], start: int, lane: Lane = Lane.READ) -> int | None:
    """Where the command should bring the motor, as far as it can be known beforehand."""
    if isinstance(command, RelativeMove):
        amount = await _amount(body, command.distance, lane)
        sign = 1 if isinstance(command, MoveClockwise | MoveClockwiseSlowly) else -1
        return None if amount is None else start + sign * amount
    if isinstance(command, AbsoluteMove):
        return await _amount(body, command.position, lane)
    return None


async def _amount(body: Body, value: int | PositionReference | str, lane: Lane) -> int | None:
    if isinstance(value, int):
        return value
    if isinstance(value, PositionReference) and isinstance(value.position, int):
        reply, _ = await body.ask(GetPositionEntry(entry=value), lane=lane)
        return reply.pulses
    return None


async def trajectory_of(
    body: Body, command: RorzeCommand[Any], start: int, target: int | None
) -> PlannedTrajectory | None:
    """Work out the trajectory of a move from the controller's present settings; None where only it can tell.

    :raises ProfileError: the controller would not make such a move.
    :raises GatewayError: the settings could not be read.
    """
    if not isinstance(command, RelativeMove | AbsoluteMove):
        return None
    endless = isinstance(command, RelativeMove) and command.distance == "endless"
    if target is None and not endless:
        return None
    ratio = await pulses_per_count(body)
    distance = None if target is None else round(abs(target - start) * ratio)
    clockwise = (
        isinstance(command, MoveClockwise | MoveClockwiseSlowly) if target is None else target >= start
    )
    profile = await _profile(body, command, distance)
    return PlannedTrajectory(profile, start, ratio if clockwise else -ratio)


async def pulses_per_count(body: Body) -> float:
    """How many pulses are put out for one of what the operating mode counts: encoder mode counts its steps.

    :raises GatewayError: it was not read.
    """
    mode, _ = await body.ask(GetOperatingMode())
    if mode.mode != "encoder":
        return 1.0
    ratio, _ = await body.ask(GetEncoderRatio())
    return ratio.ratio


async def amount_of(body: Body, pulses: int) -> int:
    """Pulses put out as the operating mode counts them: the reverse of `_pulses`."""
    if await body.know_mode() != "encoder":
        return pulses
    ratio, _ = await body.ask(GetEncoderRatio())
    return round(pulses / ratio.ratio)


async def top_speed_of(body: Body, speed: Literal["high", "low"], pattern: int | None) -> int:
    """The highest speed of a move by a pattern, in pulses per second.

    :raises GatewayError: it could not be read.
    """
    speed_set = None
    if pattern is not None:
        sets, _ = await body.ask(GetPattern(pattern=pattern))
        speed_set = sets.acceleration
    row = GetStartSpeed if speed == "low" else GetMaximumSpeed
    reply, _ = await body.ask(row(speed_set=speed_set))
    return reply.speed


async def _profile(
    body: Body, command: RelativeMove | AbsoluteMove, distance: int | None, limit: Rate | None = None
) -> Profile:
    if limit is not None:
        limited = await limited_parameters(body, limit)
        return plan(distance, limited, limited)
    up, down = await parameters_of_pattern(body, command.pattern)
    make = plan_slow if isinstance(command, _SLOW) else plan
    return make(distance, up, down, await _speed_changes(body, command.pattern))


async def _speed_changes(body: Body, pattern: int | None) -> list[SpeedChange]:
    if pattern is None:
        return []
    points = [
        (await body.ask(GetSpeedChange(pattern=pattern, point=point)))[0] for point in range(SPEED_CHANGES)
    ]
    return [
        SpeedChange("F", it.begin, it.speed) for it in points if it.begin is not None and it.speed is not None
    ]


async def parameters_of_pattern(body: Body, pattern: int | None) -> tuple[SpeedParameters, SpeedParameters]:
    """Ask for the speeds of a pattern, up and down; errors as of `Body.ask`."""
    if pattern is None:
        standard = await _speed_parameters(body, None)
        return standard, standard
    sets, _ = await body.ask(GetPattern(pattern=pattern))
    return await _speed_parameters(body, sets.acceleration), await _speed_parameters(body, sets.deceleration)


async def longest_ramp_s(body: Body, pattern: int | None, lane: Lane) -> float | None:
    """Work out how many seconds a decelerating stop may take from the highest speed of a move by a pattern.

    It goes by the speed set of stops, or else by that of the pattern's deceleration (RC-420 manual 13.3.3 and
    5MD in 14); None where that is not known. A speed that was changed on the way (5CS) is not known.

    :raises ProfileError: the settings make no ramp.
    :raises GatewayError: they were not read.
    """
    rising = falling = None
    if pattern is not None:
        if (sets := body.told.pattern_sets.get(pattern)) is None:
            return None
        rising, falling = sets.acceleration, sets.deceleration
    of_stops, _ = await body.ask(GetStopSpeedSet(), lane=lane)
    falling = falling if of_stops.speed_set is None else of_stops.speed_set
    down = await _speed_parameters(body, falling, lane)
    top = down.high
    if rising != falling:
        high, _ = await body.ask(GetMaximumSpeed(speed_set=rising), lane=lane)
        top = max(top, high.speed)
    return ramp_time_s(down, top, down.low)


async def _speed_parameters(body: Body, speed_set: int | None, lane: Lane = Lane.READ) -> SpeedParameters:
    low, _ = await body.ask(GetStartSpeed(speed_set=speed_set), lane=lane)
    high, _ = await body.ask(GetMaximumSpeed(speed_set=speed_set), lane=lane)
    acceleration, _ = await body.ask(GetMaximumAcceleration(speed_set=speed_set), lane=lane)
    rising, _ = await body.ask(GetRisingAccelerationShare(speed_set=speed_set), lane=lane)
    falling, _ = await body.ask(GetFallingAccelerationShare(speed_set=speed_set), lane=lane)
    return SpeedParameters(
        low=low.speed,
        high=high.speed,
        acceleration=acceleration.acceleration,
        rising=rising.percent,
        falling=falling.percent,
    )
