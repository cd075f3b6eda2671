"""The trials of an RC-400 line that set something, need a person at the power switch, or move a motor."""

from collections.abc import AsyncIterator, Iterable, Mapping
from contextlib import AsyncExitStack, asynccontextmanager, suppress
from dataclasses import dataclass, replace
from statistics import linear_regression
from types import MappingProxyType
from typing import Final

from commissioning.assumptions import Assumption
from commissioning.bench import OUTAGE
from commissioning.findings import Change, Finding, Result, Unanswered, agrees, cannot_tell, fails
from commissioning.rorze import QUESTIONS, RorzeBench, Trial
from gateway.rorze.config import LAST_COMMENT
from protocols.rorze.link import Answer, Refusal
from protocols.rorze.link_master import SetGroup
from protocols.rorze.modes import GetOperatingMode
from protocols.rorze.moves import MoveToSlowly
from protocols.rorze.position import GetPosition
from protocols.rorze.row import FIRST_GROUP, LAST_GROUP, LINK_MASTER
from protocols.rorze.speeds import GetStartSpeed
from protocols.rorze.status import CONTROLLER_STATUS_BITS, GetControllerStatus, GetInformation, SetUserComment
from protocols.rorze.stops import StopDecelerating, StopImmediately
from transports import TransportError

TRIED: Final = "Try 1a-Z_9.x"
"""A comment of all kinds of signs that a mark and people's own texts have."""
RETURNS_S: Final = 60.0
"""Seconds after its power is switched on by which a controller answers, or it is missing."""
ASK_AGAIN_S: Final = 0.5
LONGEST_MOVE_S: Final = 60.0
SAMPLE_S: Final = 0.05
LEAST_SAMPLES: Final = 10
SPEED_SLACK: Final = 0.05
"""Share by which the speed of a move may differ from its setting, timed over this line."""
STOP_AFTER_S: Final = 0.5
COMMAND_ERROR: Final = 1 << CONTROLLER_STATUS_BITS.index("command_error")
NOT_AGREED: Final = "Nobody has agreed to it."


@dataclass(frozen=True, slots=True)
class Kept:
    """A body before and after its power was off."""

    number: int
    """The number of the comment that was tried."""
    told: str = ""
    """The comment as it was read back."""
    before: int = 0
    """The position before, in pulses."""
    comment: str | None = None
    """The comment after; None if the power was not switched, or the body did not come back."""
    after: int | None = None


@dataclass(frozen=True, slots=True)
class Outage:
    """Bodies, and the link master, before and after their power was off."""

    bodies: Mapping[int, Kept]
    """The bodies that people have agreed to, and that have a free comment."""
    group_answers: bool | None = None
    """True if a virtual body is still there; None where none was defined, or nothing was switched."""

    @property
    def returned(self) -> Mapping[int, Kept]:
        """The bodies that came back after their power was off."""
        return {body: kept for body, kept in self.bodies.items() if kept.comment is not None}


async def _agrees(bench: RorzeBench, body: int, what: str) -> bool:
    return await bench.consents(f"{body:02X}", f"Body {body:02X}: {what} Do it?")


# The power


async def outage(bench: RorzeBench) -> Outage:
    """Set what may be lost, have the power switched once for all trials, and see what is left."""
    if OUTAGE not in bench.memory:
        bench.memory[OUTAGE] = await _outage(bench)
    found: Outage = bench.memory[OUTAGE]
    return found


async def _outage(bench: RorzeBench) -> Outage:
    await bench.sample()
    bodies: dict[int, Kept] = {}
    what = "a free user comment is set for a moment (9VS). No motor moves because of it."
    async with AsyncExitStack() as owed:
        for body in sorted(bench.present):
            if not await _agrees(bench, body, what):
                continue
            if (number := await _free_comment(bench, body)) is not None:
                empty = SetUserComment(comment_number=number, text="")
                await owed.enter_async_context(bench.owing(body, empty))
                bodies[body] = await _commented(bench, body, number)
        return await _switched(bench, bodies) if bodies else Outage(bodies)


async def _free_comment(bench: RorzeBench, body: int) -> int | None:
    """A user comment that is empty, other than the one of the gateway's mark where there is one."""
    marked = bench.table(body).power_comment
    for number in sorted(range(1, LAST_COMMENT + 1), key=lambda number: (number == marked, number)):
        told = await bench.read(body, GetInformation(comment_number=number))
        if told is not None and told.text in ("", TRIED):  # a trial that was killed has left it
            return number
    return None


async def _commented(bench: RorzeBench, body: int, number: int) -> Kept:
    """Set a comment of a body, and read it back."""
    await bench.ask(body, SetUserComment(comment_number=number, text=TRIED))
    told, place = await _comment_and_place(bench, body, number)
    return Kept(number, told or "", place or 0)


async def _comment_and_place(bench: RorzeBench, body: int, number: int) -> tuple[str | None, int | None]:
    told = await bench.read(body, GetInformation(comment_number=number))
    place = await bench.read(body, GetPosition())
    return None if told is None else told.text, None if place is None else place.pulses


async def _define(bench: RorzeBench, body: int) -> int | None:
    """Define a virtual body with an unused number; None if no person agrees, or it does not answer."""
    taken = {group.number for group in bench.line.groups} | set(bench.line.sweep_numbers)
    group = next(number for number in range(LAST_GROUP, FIRST_GROUP - 1, -1) if number not in taken)
    what = f"RC-400: virtual body {group:02X} is defined (XVS). No motor moves because of it. Do it?"
    if bench.introducer != "&" or not await bench.consents(f"{LINK_MASTER:02X}", what):
        return None
    await bench.ask(LINK_MASTER, SetGroup(group=f"{group:02X}", members=[f"{body:02X}"]))
    return group if await bench.answers(group) else None


async def _switched(bench: RorzeBench, bodies: Mapping[int, Kept]) -> Outage:
    """Wait for a person to switch the power, and for the bodies to come back."""
    group = await _define(bench, min(bodies))
    names = ", ".join([*(f"{body:02X}" for body in bodies), *([] if group is None else ["and the RC-400"])])
    what = f"Switch {names} off, wait two seconds, and switch on again. Is it done?"
    if not await bench.terms.switch(f"{min(bodies):02X}", what):
        return Outage(bodies)
    after = {body: await _returned(bench, body, kept) for body, kept in bodies.items()}
    return Outage(after, None if group is None else await bench.answers(group))


async def _returned(bench: RorzeBench, body: int, kept: Kept) -> Kept:
    for _ in range(int(RETURNS_S / ASK_AGAIN_S)):
        if await bench.ask_number(body):
            break
        await bench.pause(ASK_AGAIN_S)
    comment, after = await _comment_and_place(bench, body, kept.number)
    return kept if comment is None or after is None else replace(kept, comment=comment, after=after)


NOT_SWITCHED: Final = "Nobody has agreed, no body has a free user comment, or the power was not switched."


async def comment_kept(row: Assumption, bench: RorzeBench) -> Finding:
    """Read comments back, and once more after the power was off."""
    found = await outage(bench)
    unlike = [
        f"Comment {kept.number} of body {body:02X} was set to {TRIED!r} and is {kept.told!r}."
        for body, kept in found.bodies.items()
        if kept.told != TRIED
    ]
    lasting = [
        f"Comment {kept.number} of body {body:02X} has outlasted the loss of power."
        for body, kept in found.returned.items()
        if kept.told == kept.comment == TRIED
    ]
    wrong = [body for body, kept in found.bodies.items() if kept.told != TRIED or kept.comment == TRIED]
    marked = [body for body in wrong if bench.table(body).power_comment]
    if marked:
        without_mark = (Change(f"bodies.{body:02X}.power_comment", 0) for body in marked)
        return fails(row, " ".join([*unlike, *lasting]), *without_mark)
    if wrong:
        return agrees(f"{' '.join([*unlike, *lasting])} Nothing rests on it: no mark is set there.")
    if not found.returned:
        return cannot_tell(row, NOT_SWITCHED)
    return agrees(f"Comments of {_named(found.returned)} were kept, and gone after the power was off.")


async def power_on_position(row: Assumption, bench: RorzeBench) -> Finding:
    """Compare positions before and after the power was off."""
    found = await outage(bench)
    elsewhere = {body: moved for body, moved in found.returned.items() if moved.before != 0}
    if not elsewhere:
        return cannot_tell(row, "All bodies were at 0." if found.returned else NOT_SWITCHED)
    seen = " ".join(
        f"Body {body:02X} was at {moved.before}, and is at {moved.after} after its power was off."
        for body, moved in elsewhere.items()
    )
    kept = {body: moved for body, moved in elsewhere.items() if moved.after != 0}
    if not kept:
        return agrees(seen)
    unmarked = [
        body
        for body, state in kept.items()
        if state.comment == TRIED and not bench.table(body).silence_needs_acknowledgement
    ]
    if not unmarked:
        return fails(row, f"{seen} A mark in a user comment, or an acknowledgement, tells of the loss.")
    return fails(
        row, seen, *(Change(f"bodies.{body:02X}.silence_needs_acknowledgement", True) for body in unmarked)
    )


async def link_master_forgets(row: Assumption, bench: RorzeBench) -> Finding:
    """Ask a virtual body after the power of the link master was off."""
    found = await outage(bench)
    if not found.returned:
        return cannot_tell(row, NOT_SWITCHED)
    if found.group_answers is None:
        return cannot_tell(
            row, "No virtual body was defined.", f"An answer for the RC-400 itself ({LINK_MASTER:02X})."
        )
    if found.group_answers:
        return fails(row, "The virtual body that was defined has outlasted the loss of power.")
    return agrees("The virtual body that was defined was gone after the power was off.")


def _named(bodies: Iterable[int]) -> str:
    return ", ".join(f"{body:02X}" for body in bodies)


# Motion


@dataclass(frozen=True, slots=True)
class Way:
    """A slow move to one of the places that were named."""

    body: int
    here: int
    target: int
    speed: int
    """Pulses/s: the start speed, at which slow moves run without ramps."""


async def _way(row: Assumption, bench: RorzeBench, what: str) -> Way | Finding:
    """Find out where a body may go, and have people agree.

    A motor that stands outside the two places is moved nowhere.
    """
    places = bench.terms.places
    if places is None:
        return cannot_tell(row, "No two places were named.", "Name two places with `--between A B`.")
    await bench.sample()
    said = f"{what} between {places.one:g} and {places.other:g} at its start speed (2AM)."
    for body in sorted(bench.present):
        if await _agrees(bench, body, said):
            break
    else:
        return cannot_tell(row, NOT_AGREED)
    mode, place = await bench.read(body, GetOperatingMode()), await bench.read(body, GetPosition())
    status, speed = await bench.read(body, GetControllerStatus()), await bench.read(body, GetStartSpeed())
    if (
        None in (mode, place, status, speed)
        or mode.mode == "encoder"
        or _is_busy(status.bits)
        or not speed.speed
    ):
        return cannot_tell(row, f"Body {body:02X} moves, has an error, or counts by its encoder.")
    low, high = sorted((round(places.one), round(places.other)))
    here = place.pulses
    if not low <= here <= high:
        return cannot_tell(
            row, f"Body {body:02X} is at {here}.", "The axis has to stand between both places."
        )
    target = max((low, high), key=lambda place: abs(place - here))
    takes_s = abs(target - here) / speed.speed
    if not SAMPLE_S * LEAST_SAMPLES <= takes_s <= LONGEST_MOVE_S:
        seen = f"At {speed.speed} pulses/s the way from {here} to {target} takes {takes_s:.1f} s."
        return cannot_tell(row, seen, f"Two places that are up to {LONGEST_MOVE_S:g} s apart at that speed.")
    return Way(body, here, target, speed.speed)


def _is_busy(bits: int) -> bool:
    """Tell whether the motor runs or has an error; a refusal, such as those of these trials, is none."""
    return bool(bits & ~COMMAND_ERROR)


async def curve_tick(row: Assumption, bench: RorzeBench) -> Finding:
    """Sample a slow move, and compare its speed with the setting."""
    way = await _way(row, bench, "it moves there and back")
    if isinstance(way, Finding):
        return way
    async with _stopped_if_broken_off(bench, way.body):
        return await _there_and_back(row, bench, way)


@asynccontextmanager
async def _stopped_if_broken_off(bench: RorzeBench, body: int) -> AsyncIterator[None]:
    """Stop the motor where a trial ends before its time, by Ctrl-C or a fault of our own."""
    try:
        yield
    except BaseException:
        with suppress(TransportError):
            await bench.ask(body, StopImmediately())
        raise


async def _there_and_back(row: Assumption, bench: RorzeBench, way: Way) -> Finding:
    samples, end = await _move(bench, way, way.target)
    if end != way.target:
        return _surprise(f"Body {way.body:02X} was sent to {way.target} and is at {end}. It was stopped.")
    _, back = await _move(bench, way, way.here)
    if back != way.here:
        return _surprise(f"Body {way.body:02X} was sent back to {way.here} and is at {back}. It was stopped.")
    if len(samples) < LEAST_SAMPLES:
        return cannot_tell(row, f"Only {len(samples)} positions were read on the way.")
    slope = abs(linear_regression(*zip(*samples, strict=True)).slope)
    seen = f"Body {way.body:02X} moved at {slope:.1f} pulses/s, its setting is {way.speed}."
    return agrees(seen) if abs(slope / way.speed - 1) <= SPEED_SLACK else fails(row, seen)


async def _taken(bench: RorzeBench, way: Way, target: int) -> bool:
    """Begin a slow move; False if it is refused.

    :raises Unanswered: it is not known; the motor has to be stopped.
    """
    move = MoveToSlowly(position=target)
    answer = await bench.ask(way.body, move)
    if answer is None:
        raise Unanswered(f"{move.code} to body {way.body:02X} was not answered. The motor was stopped.")
    return isinstance(answer, Answer)


async def _move(bench: RorzeBench, way: Way, target: int) -> tuple[list[tuple[float, float]], int | None]:
    """Move slowly; gives the positions on the way and the last place. A move that takes too long is ended."""
    if not await _taken(bench, way, target):
        await bench.ask(way.body, StopImmediately())
        return [], None
    deadline = bench.talk.now() + 1.5 * abs(way.target - way.here) / way.speed + 2 * bench.patience_s
    samples: list[tuple[float, float]] = []
    low, high = sorted((way.here, way.target))
    while bench.talk.now() < deadline:
        asked_at = bench.talk.now()
        place = await bench.read(way.body, GetPosition())
        if place is None or not low <= place.pulses <= high:
            break
        samples.append(((asked_at + bench.talk.now()) / 2, float(place.pulses)))
        status = await bench.read(way.body, GetControllerStatus())
        if status is not None and not _is_busy(status.bits):
            moved = [sample for sample in samples if sample[1] not in (way.here, way.target)]
            end = await bench.read(way.body, GetPosition())
            return moved, None if end is None else end.pulses
        await bench.pause(SAMPLE_S)
    await bench.ask(way.body, StopImmediately())
    end = await bench.read(way.body, GetPosition())
    return [], None if end is None else end.pulses


def _surprise(seen: str) -> Finding:
    return Finding(Result.CONTRADICTS, seen, surprise=True)


async def stop_overtakes(row: Assumption, bench: RorzeBench) -> Finding:
    """Stop a slow move by both stops, one right after the other."""
    way = await _way(row, bench, "it moves, and is stopped on its way")
    if isinstance(way, Finding):
        return way
    async with _stopped_if_broken_off(bench, way.body):
        return await _stopped_twice(row, bench, way)


async def _stopped_twice(row: Assumption, bench: RorzeBench, way: Way) -> Finding:
    if not await _taken(bench, way, way.target):
        await bench.ask(way.body, StopImmediately())
        return _surprise(f"Body {way.body:02X} did not take a slow move.")
    await bench.pause(STOP_AFTER_S * min(1.0, abs(way.target - way.here) / way.speed))
    first = await bench.ask(way.body, StopDecelerating())
    second = await bench.ask(way.body, StopImmediately())
    await bench.pause(STOP_AFTER_S)
    status = await bench.read(way.body, GetControllerStatus())
    if status is None or _is_busy(status.bits) or not isinstance(first, Answer):
        await bench.ask(way.body, StopImmediately())
        return _surprise(f"Body {way.body:02X} does not stand still after both stops.")
    if isinstance(second, Refusal):
        code = "without a code" if second.error is None else f"with {second.error:02X}h"
        return fails(row, f"5IS right after 5SS is refused {code}; the motor stands.")
    return agrees("5SS and 5IS right after it are both taken; the motor stands.")


TRIALS: Final[Mapping[str, Trial]] = MappingProxyType(
    {
        **QUESTIONS,
        "link-master-forgets": link_master_forgets,
        "power-on-position": power_on_position,
        "comment-kept": comment_kept,
        "curve-tick": curve_tick,
        "stop-overtakes": stop_overtakes,
    }
)
