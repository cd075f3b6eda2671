"""Moves with a speed of their own: a pattern that is reserved for them is written before they start.

A move command names no speed, only an acceleration pattern (RC-420 manual 13.3.5), and a change of speed on
the way (5CS) comes after the motor has begun: if it gets lost, the motor runs at full speed. So the speed
goes into one reserved pattern and the speed set of its number, in RAM; all others, and flash memory, stay as
they are.
"""

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable, Sequence
from contextlib import AsyncExitStack, asynccontextmanager
from dataclasses import astuple
from typing import Annotated, Any, Final, Literal, TypeVar

from pydantic import Field, WithJsonSchema

from gateway.core.errors import InvalidRequest
from gateway.core.records import RequestModel, example
from gateway.rorze.bodies import Body, Group, idle_bodies_of
from gateway.rorze.changes import change, read
from gateway.rorze.patterns import sets_item
from gateway.rorze.speed_sets import STANDARD, items_of, parameters_of
from gateway.rorze.units import to_pulses
from protocols.rorze.encoder import GetEncoderRatio
from protocols.rorze.patterns import SetSpeedChange
from protocols.rorze.profile import ProfileError, SpeedParameters
from protocols.rorze.row import RorzeCommand

SLOW_PATTERN: Final = 29
"""The pattern, and its speed set, where the configuration names no other: only if they were never set."""
NEVER_SET: Final = 0
"""A speed that was never set (RC-420 manual 14, OHD)."""


class Rate(RequestModel, json_schema_extra=example(value=1000, unit="pulse/s")):
    """A speed with its unit."""

    value: Annotated[int | float, WithJsonSchema({"type": "number"})] = Field(gt=0, lt=1e9)
    unit: Literal["pulse/s", "mm/s", "um/s", "deg/s", "mdeg/s"] = Field(
        description="Other units than pulse/s need the body's scale in the configuration."
    )


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
        SLOW_PATTERN if it.configured.slow_pattern is None else it.configured.slow_pattern for it in bodies
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

    :raises InvalidRequest: as of the wish, or somebody uses the pattern; nothing was changed.
    :raises BodyBusy: a body moves, or the group is being defined anew; nothing was sent.
    :raises StoppedFirst: a stop came meanwhile; the move must not start.
    :raises GatewayError: it was not written.
    """
    bodies = idle_bodies_of(target)
    number, gate = slow_pattern_of(bodies), target.line.gate
    epoch = gate.epoch(target.number)
    async with AsyncExitStack() as stack:
        for body in sorted(bodies, key=lambda it: it.number):  # in one order: two groups may share members
            await stack.enter_async_context(body.own_speed.lock)
        idle_bodies_of(target)  # another wish may have begun meanwhile
        wanted = await wish(bodies)
        await asyncio.gather(*(_write(*it, number) for it in zip(bodies, wanted, strict=True)))
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
    """Whether a set is what was written last, or for another limit in an earlier life of the gateway.

    Then it has the ramps of the body's standard set, or those of the robot that it is an axis of.
    """
    if body.own_speed.written is not None and tuple(found) == astuple(body.own_speed.written):
        return True
    standards = await asyncio.gather(*(standard_of(it) for it in {body, *body.own_speed.companions}))
    ramps = {(it.acceleration, it.rising, it.falling) for it in standards}
    return tuple(found[2:]) in ramps and found[0] <= found[1]


def _in_use(body: Body, number: int) -> InvalidRequest:
    return InvalidRequest.worded("body.pattern-in-use", number=number, body=body.address)
