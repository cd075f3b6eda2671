"""Plans of moves, asked without moving: the exact frame, and how long the pulses would run."""

import asyncio
from bisect import bisect_left
from collections.abc import AsyncIterator, Awaitable, Callable, Sequence
from contextlib import AsyncExitStack, asynccontextmanager
from dataclasses import astuple
from operator import attrgetter
from typing import Annotated, Any, Final, Literal, NamedTuple, TypeVar

from pydantic import Field, WithJsonSchema
from typing_extensions import TypeAliasType

from gateway.core.errors import ControllerRefused, InvalidRequest
from gateway.core.exchange import Lane
from gateway.core.move_record import CountedIn
from gateway.core.records import AnswerModel, Record, RequestModel, example
from gateway.rorze.asked_body import pulses_per_count
from gateway.rorze.bodies import Body, Group, idle_bodies_of
from gateway.rorze.changes import change, read
from gateway.rorze.speed_sets import STANDARD, Speed, items_of, parameters_of, sets_item
from gateway.rorze.starts import entry_in, target_from
from gateway.rorze.units import to_pulses
from gateway.texts import Text, text
from protocols.rorze.encoder import GetEncoderRatio
from protocols.rorze.modes import GetSoftLimits
from protocols.rorze.moves import (
    AbsoluteMove,
    MoveClockwise,
    MoveClockwiseSlowly,
    MoveCounterclockwiseSlowly,
    MoveToSlowly,
    RelativeMove,
)
from protocols.rorze.notation import Bounds
from protocols.rorze.path import Knot
from protocols.rorze.patterns import GetPattern, GetSpeedChange, SetSpeedChange
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

SLOW_PATTERN: Final = 29
"""The pattern, and its speed set, where the configuration names no other: only if they were never set."""
NEVER_SET: Final = 0
"""A speed that was never set (RC-420 manual 14, OHD)."""


RateUnit = TypeAliasType("RateUnit", Literal["pulse/s", "mm/s", "um/s", "deg/s", "mdeg/s"])


class Rate(RequestModel, json_schema_extra=example(value=1000, unit="pulse/s")):
    """A speed with its unit."""

    value: Annotated[int | float, WithJsonSchema({"type": "number"})] = Field(gt=0, lt=1e9)
    unit: RateUnit = Field(description="Other units than pulse/s need the body's scale in the configuration.")


MaxSpeed = Annotated[
    Rate | None,
    Field(
        description="The fastest it may get; the standard speed set still bounds it. The gateway writes it "
        "to the body's `slow_pattern` (RAM only) before; neither `pattern` nor `low` goes with it."
    ),
]
Wish = Callable[[Sequence[Body]], Awaitable[Sequence[SpeedParameters]]]
"""Works out what is written to each body."""
C = TypeVar("C", bound=RorzeCommand[Any])
M = TypeVar("M", bound=RequestModel)


def require_one_speed(request: M) -> M:
    """Refuse two speeds for one move.

    :raises ValueError: `max_speed` stands beside a pattern or the start speed.
    """
    if getattr(request, "max_speed", None) is None:
        return request
    if getattr(request, "pattern", None) is not None:
        raise ValueError("max_speed and pattern cannot be given together")
    if getattr(request, "speed", "high") == "low":
        raise ValueError("max_speed and speed low cannot be given together")
    return request


def slow_pattern_of(bodies: Sequence[Body]) -> int:
    """The pattern in which bodies get a speed of their own.

    :raises InvalidRequest: they have different ones, and get one command.
    """
    first, *others = [
        SLOW_PATTERN if body.configured.slow_pattern is None else body.configured.slow_pattern
        for body in bodies
    ]
    if any(number != first for number in others):
        raise InvalidRequest(
            "The members have different slow_patterns, but get one command; nothing was sent.",
            "Configure the same slow_pattern for all of them.",
        )
    return first


def with_own_pattern(bodies: Sequence[Body], command: C, limit: Rate | None) -> C:
    """The command of a move as it is sent with a speed of its own; errors as of `slow_pattern_of`."""
    if limit is None:
        return command
    return command.model_copy(update={"pattern": slow_pattern_of(bodies)})


async def limited_parameters(body: Body, limit: Rate) -> SpeedParameters:
    """The standard speed set with no speed above a limit.

    :raises InvalidRequest: the limit is in another unit, below one pulse a second, or the standard set is not
        complete.
    :raises GatewayError: it was not read.
    """
    # a name such as mm/s is the unit and "/s"
    counts = to_pulses(limit.value, limit.unit.removesuffix("/s"), body.scale)  # type: ignore[arg-type]
    ratio = (await body.ask(GetEncoderRatio()))[0].ratio if await body.know_mode() == "encoder" else 1.0
    top = round(counts * ratio)
    if top < 1:
        raise InvalidRequest("max_speed: it comes to less than one pulse a second; only questions were sent.")
    return (await standard_of(body)).capped(top)


async def standard_of(body: Body) -> SpeedParameters:
    """The standard speed set, from which the ramps are taken; errors as of `limited_parameters`."""
    try:
        return await parameters_of(body, STANDARD)
    except ProfileError as error:
        raise InvalidRequest(
            f"Speed set {STANDARD} of {body.address}, from which the ramps are taken, has no valid values: "
            f"{error} Only questions were sent.",
            f"Set speed set {STANDARD}.",
        ) from None


@asynccontextmanager
async def limited(target: Body | Group, wish: Wish) -> AsyncIterator[int]:
    """Write a speed, and keep others from writing another one until the move has started; gives its pattern.

    :raises InvalidRequest: as of the wish, or a move uses the pattern; nothing was changed.
    :raises BodyBusy: a body moves, or the group is being defined anew; nothing was sent.
    :raises StoppedFirst: a stop came meanwhile; the move must not start.
    :raises GatewayError: it was not written.
    """
    bodies = idle_bodies_of(target)
    number, gate = slow_pattern_of(bodies), target.line.gate
    epoch = gate.epoch(target.number)
    async with AsyncExitStack() as stack:
        for body in sorted(
            bodies, key=lambda each: each.number
        ):  # in one order: two groups may share members
            await stack.enter_async_context(body.own_speed.lock)
        idle_bodies_of(target)  # another wish may have begun meanwhile
        wanted = await wish(bodies)
        await asyncio.gather(*(_write(*order, number) for order in zip(bodies, wanted, strict=True)))
        if gate.epoch(target.number) != epoch:
            raise gate.overtaken(target.number)
        yield number


@asynccontextmanager
async def at_own_speed(target: Body | Group, request: M) -> AsyncIterator[M]:
    """Give a request with the pattern that has its `max_speed`, if it has one; errors as of `limited`."""
    limit = getattr(request, "max_speed", None)
    if limit is None:
        yield request
        return

    async def wish(bodies: Sequence[Body]) -> Sequence[SpeedParameters]:
        return await asyncio.gather(*(limited_parameters(body, limit) for body in bodies))

    async with limited(target, wish) as number:
        yield request.model_copy(update={"pattern": number})


async def _write(body: Body, wanted: SpeedParameters, number: int) -> None:
    async with body.looking():
        await _write_where_free(body, wanted, number)


async def _write_where_free(body: Body, wanted: SpeedParameters, number: int) -> None:
    pattern, items = sets_item(number), list(items_of(number).values())
    made_of = {"acceleration_set": number, "deceleration_set": number}
    found_sets, found = await read(body, pattern), [await read(body, item) for item in items]
    if body.own_speed.written == wanted and (found_sets, found) == (made_of, list(astuple(wanted))):
        return
    free = found_sets is None and found[1] == NEVER_SET
    own = free or (found_sets in (None, made_of) and await _may_be_own(body, found))
    if body.configured.slow_pattern is None and not own:
        raise _in_use(body, number)
    await change(body, [*zip(items, astuple(wanted), strict=True), (pattern, made_of)])
    await body.ask(SetSpeedChange(pattern=number))  # a change on the way could exceed the limit
    body.own_speed.was_written(wanted)


async def _may_be_own(body: Body, found: Sequence[int]) -> bool:
    """True if a set is what was written last, or for another limit in an earlier life of the gateway.

    Then it has the ramps of the body's standard set, or those of the robot that it is an axis of.
    """
    if body.own_speed.written is not None and tuple(found) == astuple(body.own_speed.written):
        return True
    standards = await asyncio.gather(*(standard_of(member) for member in {body, *body.own_speed.companions}))
    ramps = {(standard.acceleration, standard.rising, standard.falling) for standard in standards}
    return tuple(found[2:]) in ramps and found[0] <= found[1]


def _in_use(body: Body, number: int) -> InvalidRequest:
    return InvalidRequest.worded("body.pattern-in-use", number=number, body=body.address)


SPEED_CHANGES = 16
"""Points a pattern may have (SES)."""
_SLOW = MoveClockwiseSlowly, MoveCounterclockwiseSlowly, MoveToSlowly
"""Moves that run at the start speed (RC-420 manual 13.2)."""


class PlannedMove(Record):
    """A move that was checked and not sent."""

    body_id: str
    frame: str = Field(description="The exact bytes that would be sent, CR as \\r.")
    counted_in: CountedIn | None = Field(description="Unit of the target's position.")
    distance: int | None = Field(
        description="Pulses it would emit; null where only the motion itself can tell."
    )
    target_position: int | None = Field(
        description="Target in `counted_in`, where it can be known beforehand."
    )
    duration_s: float | None = Field(
        description="Seconds for which pulses would run, with the present settings."
    )
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
    """Length of the path, in micrometres."""
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


class GroupPlan(AnswerModel):
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
    entry = entry_in(command)
    reply = None if entry is None else await body.ask(GetPositionEntry(entry=entry), lane=lane)
    return target_from(command, start, None if reply is None else reply[0].pulses)


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


async def amount_of(body: Body, pulses: int) -> int:
    """Pulses put out as the operating mode counts them: the reverse of `_pulses`."""
    if await body.know_mode() != "encoder":
        return pulses
    ratio, _ = await body.ask(GetEncoderRatio())
    return round(pulses / ratio.ratio)


async def top_speed_of(body: Body, speed: Speed, pattern: int | None) -> int:
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
        SpeedChange("F", point.begin, point.speed)
        for point in points
        if point.begin is not None and point.speed is not None
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
