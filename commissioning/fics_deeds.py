"""The trials of a robot that set something, need a person at the power switch, or move an axis."""

import asyncio
from collections.abc import AsyncIterator, Callable, Mapping
from contextlib import AsyncExitStack, asynccontextmanager, suppress
from dataclasses import dataclass, field
from functools import partial
from itertools import pairwise
from statistics import median
from types import MappingProxyType
from typing import Any, Final

from commissioning.assumptions import Assumption
from commissioning.bench import LONGEST_ANSWER, OUTAGE
from commissioning.fics import (
    ANY_UNIT,
    NO_ERROR,
    NOBODY,
    QUESTIONS,
    REST_S,
    STANDS,
    FicsBench,
    Trial,
    at_rest,
    stored,
)
from commissioning.findings import Finding, Result, agrees, cannot_tell, fails
from gateway.fics.session import NO_UPLOAD
from protocols.fics.alarms import ResetErrors, TakeCurrentError
from protocols.fics.jog import StartJog, StopJog
from protocols.fics.link import FicsRefusal
from protocols.fics.moves import MoveAbsolute
from protocols.fics.notation import UNKNOWN
from protocols.fics.positions import (
    LAST_POSITION,
    BeginPositionUpload,
    ClearPositions,
    EndPositionUpload,
    UploadPosition,
)
from protocols.fics.row import UPLOAD_ERROR, FicsCommand, RobotAction
from protocols.fics.soft_limits import (
    GetLowerSoftLimits,
    GetUpperSoftLimits,
    SetLowerSoftLimits,
    SetUpperSoftLimits,
)
from protocols.fics.speeds import GetMaximumSpeeds, GetSpeedPercent, SetMaximumSpeeds, SetSpeedPercent
from protocols.fics.status import GetAxisStatus, GetUserPosition, MotionMode
from protocols.fics.stops import StopAllDecelerating, StopAllImmediately
from protocols.fics.system import GetSystemVersion
from protocols.fics.variables import LAST_VARIABLE, GetVariable, SetVariable
from transports import TransportError

VALUES: Final = (0.125, -12345.678, 99_999_999.0)
"""Numbers of many digits."""
LISTEN_S: Final = 0.05
"""Seconds between questions to a robot whose power is switched or whose axis moves."""
LEAST_GAP_S: Final = 0.15
"""A shorter silence is none."""
RETURNS_S: Final = 60.0
"""Seconds after its power is switched on by which a robot answers, or it is missing."""
EARLY_S: Final = 0.5
"""Seconds by which the first answer may precede the word of the person at the switch."""
UNIT_HOLDS_S: Final = 0.5
SLOW_PERCENT: Final = 5.0
SLOWLY: Final = f"at {SLOW_PERCENT:g} % (VAO, LMA)"
LONGEST_MOVE_S: Final = 60.0
STOP_AFTER_S: Final = 0.3
JOG_S: Final = 1.0
"""The longest time in seconds for which an axis jogs."""
LOOKS: Final = 3
"""Looks at an axis that jogs: of the first the motor may just have begun to move."""
LEAST_SPEED: Final = 0.1
"""The least speed in units/s that can be written with the decimals of all robots."""
STOPS: Final = 3
"""Times that AES is sent to a robot that is not seen to stand."""
STOPPED_WITHIN_S: Final = 1.0
"""Seconds after which an axis that is not seen to stand is stopped again."""
HARDWARE_STOP: Final = "Use the hardware stop."
NOT_AGREED: Final = "Nobody has agreed to it."
NEEDS_A_BOOT: Final = (
    "An answer at the moment in which the robot is switched on, and a robot that takes more than {:g} s from "
    "then to its first answer; of one that is up sooner, the time that its power supply bridges."
)


async def _agreed(row: Assumption, bench: FicsBench, what: str) -> Finding | None:
    """Give the reason not to touch a robot: it does not answer, no person agrees, or it is not at rest."""
    if not await bench.is_there():
        return cannot_tell(row, NOBODY)
    robot = bench.line.robot.id
    if not await bench.consents(robot, f"Robot {robot}: {what} Do it?"):
        return cannot_tell(row, NOT_AGREED)
    if await at_rest(bench) is None:
        return cannot_tell(
            row, "The robot moves, or has an error.", "A robot that stands still without error."
        )
    return None


SETS: Final = "numbers and positions are set and set back, no axis moves because of it."


async def upload_end(row: Assumption, bench: FicsBench) -> Finding:
    """Send POF 2 where no upload is open."""
    if unable := await _agreed(row, bench, SETS):
        return unable
    error = await bench.refused(EndPositionUpload())
    seen = f"POF 2 without an upload is {'done' if error is None else f'refused with {error}'}."
    return agrees(seen) if error == NO_UPLOAD else fails(row, seen)


@asynccontextmanager
async def _upload(bench: FicsBench) -> AsyncIterator[str | None]:
    """Open an upload at the last number, and end it whatever happens: until then no stop is taken."""
    async with bench.owing(ANY_UNIT, EndPositionUpload()):
        error = await bench.refused(BeginPositionUpload(first=LAST_POSITION))
        bench.memory["uploading"] = True
        yield error


async def upload_refusal(row: Assumption, bench: FicsBench) -> Finding:
    """Ask a question while an upload is open."""
    if unable := await _agreed(row, bench, SETS):
        return unable
    async with _upload(bench) as error:
        if error is not None:
            return cannot_tell(row, f"POF 1 is refused with {error}.")
        refused = await bench.refused(GetVariable(number=LAST_VARIABLE))
    seen = f"A question in an upload is {'answered' if refused is None else f'refused with {refused}'}."
    return agrees(seen) if refused == UPLOAD_ERROR else fails(row, seen)


async def pos_left_out(row: Assumption, bench: FicsBench) -> Finding:
    """Store a position without its first axis over another one, at a free number."""
    if unable := await _agreed(row, bench, SETS):
        return unable
    axes = len((await bench.told(GetUserPosition()) or "").split(","))
    before, _ = await stored(bench, LAST_POSITION, 1)
    if before or axes < 2:
        return cannot_tell(row, f"Position {LAST_POSITION} is taken, or the unit has one axis.")
    whole: list[float | None] = [float(number) for number in range(1, axes + 1)]
    async with bench.owing(await bench.unit() or ANY_UNIT, ClearPositions(first=LAST_POSITION, count=1)):
        for coordinates in (whole, [None, *whole[1:]]):
            async with _upload(bench) as error:
                if error is not None:
                    return cannot_tell(row, f"POF 1 is refused with {error}.")
                await bench.refused(UploadPosition(coordinates=coordinates))
        after, _ = await stored(bench, LAST_POSITION, 1)
    if not after:
        return cannot_tell(row, "What was stored is not told.")
    seen = f"A position without its first axis over another one is told as {after[0]}."
    return agrees(seen) if after[0].startswith(",") else fails(row, seen)


async def numbers_as_set(row: Assumption, bench: FicsBench) -> Finding:
    """Set a variable to numbers of many digits, read it back, and set it as it was."""
    if unable := await _agreed(row, bench, SETS):
        return unable
    before = await bench.read(GetVariable(number=LAST_VARIABLE))
    if before is None:
        return cannot_tell(row, f"Variable V{LAST_VARIABLE} is not told.")
    told: dict[float, float | None] = {}
    async with bench.owing(ANY_UNIT, SetVariable(number=LAST_VARIABLE, value=before.value)):
        for value in VALUES:
            await bench.refused(SetVariable(number=LAST_VARIABLE, value=value))
            after = await bench.read(GetVariable(number=LAST_VARIABLE))
            told[value] = None if after is None else after.value
    wrong = {value: answer for value, answer in told.items() if answer != value}
    if wrong:
        return fails(
            row, "; ".join(f"{value} was set and {answer} is told" for value, answer in wrong.items()) + "."
        )
    return agrees(f"{', '.join(map(str, VALUES))} are told as they were set.")


# The power


@dataclass(frozen=True, slots=True)
class Outage:
    """A robot before and after its power was off."""

    silent_s: float
    boots_s: float
    """Least time in seconds from the power to the first answer; 0 if it answered before the switch was
    reported."""
    homed: bool
    """Before."""
    positions: str
    """The answer of the position query after the outage."""
    error: str
    """The answer of ERR after."""


async def _outage(row: Assumption, bench: FicsBench) -> Outage | Finding:
    """Have the power switched once for all trials, and see what is left."""
    if OUTAGE not in bench.memory:
        bench.memory[OUTAGE] = await _see_outage(row, bench)
    found: Outage | Finding = bench.memory[OUTAGE]
    return found if isinstance(found, Outage) else cannot_tell(row, found.seen, found.needed)


async def _see_outage(row: Assumption, bench: FicsBench) -> Outage | Finding:
    what = "a command in a wrong form is sent, and a person switches its power. No axis moves because of it."
    if unable := await _agreed(row, bench, what):
        return unable
    before = await bench.told(GetUserPosition())
    bench.talk.send(b"VER!\r")  # an error of communication, which nobody asks for
    await bench.settle()
    robot = bench.line.robot.id
    since, begun_at = len(bench.talk.heard), bench.talk.now()
    switching = bench.background(
        bench.terms.switch(
            robot,
            f"While nothing moves, switch {robot} off, and on again as fast as you can. Answer at the moment "
            "in which you switch it on. Is it on?",
        )
    )
    while not switching.done():
        await _knock(bench)
    if not switching.result():
        return cannot_tell(row, "The power was not switched.")
    on_at = bench.talk.now()
    while not _is_back(bench, on_at) and bench.talk.now() < on_at + RETURNS_S:
        await _knock(bench)
    await bench.settle()
    times = [begun_at, *(line.at for line in bench.talk.heard[since:])]
    gone_at, back_at = max(pairwise(times), key=lambda gap: gap[1] - gap[0], default=(0.0, 0.0))
    silent_s = back_at - gone_at
    if not _is_back(bench, on_at) or silent_s < LEAST_GAP_S:
        return cannot_tell(row, "The robot was not seen to lose its power, or did not come back.")
    error, positions = await bench.read(TakeCurrentError()), await bench.told(GetUserPosition())
    if error is None or positions is None:
        return cannot_tell(row, "The robot did not tell its error or its positions after its power was off.")
    return Outage(
        silent_s,
        max(back_at - on_at - EARLY_S, 0.0),
        before is not None and UNKNOWN not in before,
        positions,
        str(error.error),
    )


async def _knock(bench: FicsBench) -> None:
    """Ask, and wait about as long as an answer takes: many that were not waited for would queue up."""
    question, since = bench.frame(GetSystemVersion()), len(bench.talk.heard)
    bench.talk.send(question)
    await bench.pause(LISTEN_S)
    byte_s = bench.talk.port.byte_time_s
    takes_s = 2 * median(bench.times) + (len(question) + LONGEST_ANSWER) * byte_s - LISTEN_S
    await bench.talk.hear(bool, max(takes_s, 0.0), since)


def _is_back(bench: FicsBench, on_at: float) -> bool:
    return bool(bench.talk.heard) and bench.talk.heard[-1].at > on_at


async def power_loss_read(row: Assumption, bench: FicsBench) -> Finding:
    """Measure the silence of a loss of power, against the time for which a selected unit is believed."""
    return await _silence(row, bench, UNIT_HOLDS_S)


async def power_loss_motion(row: Assumption, bench: FicsBench) -> Finding:
    """Measure the silence of a loss of power, against the time from the last question to a motion."""
    return await _silence(row, bench, bench.line.reply_timeout_s)


async def _silence(row: Assumption, bench: FicsBench, least_s: float) -> Finding:
    found = await _outage(row, bench)
    if isinstance(found, Finding):
        return found
    seen = f"Without power the robot was silent for {found.silent_s:.2f} s, {least_s:g} s are assumed."
    if found.silent_s < least_s:
        return fails(row, seen)
    if found.boots_s < least_s:
        return cannot_tell(
            row, f"{seen} How much of that it needs to be up was not seen.", NEEDS_A_BOOT.format(least_s)
        )
    return agrees(f"{seen} It takes {found.boots_s:.2f} s at least from its switch to its first answer.")


async def positions_after_power(row: Assumption, bench: FicsBench) -> Finding:
    """Read the positions after the power was off."""
    found = await _outage(row, bench)
    if isinstance(found, Finding):
        return found
    if not found.homed:
        return cannot_tell(row, "The robot was not homed before.", "A robot that is homed.")
    seen = f"After its power was off the robot tells its positions as {found.positions}."
    return agrees(seen) if set(found.positions.split(",")) == {UNKNOWN} else fails(row, seen)


async def error_after_power(row: Assumption, bench: FicsBench) -> Finding:
    """Read the error of communication after the power was off."""
    found = await _outage(row, bench)
    if isinstance(found, Finding):
        return found
    seen = f"After its power was off the robot tells the error {found.error}."
    return agrees(seen) if found.error == NO_ERROR else fails(row, seen)


# Motion


@dataclass(frozen=True, slots=True)
class Way:
    """A slow motion of the first axis towards one of the places that were named."""

    axis: str
    axes: int
    here: float
    target: float

    def to(self, place: float) -> MoveAbsolute:
        """The move of the first axis to a place."""
        return MoveAbsolute(coordinates=[place, *[None] * (self.axes - 1)])

    @property
    def ends(self) -> tuple[float, float]:
        """The lower and the upper of the place where it stands and the one that it goes to."""
        return min(self.here, self.target), max(self.here, self.target)


async def _first_axis(bench: FicsBench) -> str | None:
    """The name of the first axis of the unit that the robot has selected; None if it does not tell."""
    number = await bench.unit()
    axes = next((unit.axes for unit in bench.line.robot.units if unit.number == number), None)
    return None if axes is None else f"{axes[0]} of unit {number}"


async def _way(row: Assumption, bench: FicsBench, what: str) -> Way | Finding:
    """Find out where the first axis may go, and have people agree."""
    places = bench.terms.places
    if places is None:
        return cannot_tell(row, "No two places were named.", "Name two places with `--between A B`.")
    if not await bench.is_there():
        return cannot_tell(row, NOBODY)
    axis = await _first_axis(bench)
    if axis is None:
        return cannot_tell(
            row, "It is not known which unit the robot has selected.", "A unit of the configuration (UNT)."
        )
    said = f"axis {axis} {what.format(places=f'{places.one:g} and {places.other:g}')}."
    if unable := await _agreed(row, bench, said):
        return unable
    if await _first_axis(bench) != axis:
        return cannot_tell(
            row, f"Axis {axis} is not selected any more.", "A robot that nobody else speaks to."
        )
    told = await bench.read(GetUserPosition())
    if told is None or told.coordinates[0] is None:
        return cannot_tell(row, "The robot is not homed.", "A robot that is homed.")
    low, high = sorted((places.one, places.other))
    here = told.coordinates[0]
    if not low <= here <= high or low == high:
        return cannot_tell(row, f"Axis {axis} is at {here:g}.", "The axis has to stand between both places.")
    target = max((low, high), key=lambda place: abs(place - here))
    return Way(axis[0], len(told.coordinates), here, target)


Values = list[float | None]


@asynccontextmanager
async def _meanwhile(
    bench: FicsBench,
    question: FicsCommand[Any],
    setting: type[RobotAction],
    change: Callable[[Values], Values],
) -> AsyncIterator[bool]:
    """Give a setting other values until the block ends, and those that it had after it.

    Gives whether they were read back: without that nothing moves.
    """
    (name,) = setting.model_fields
    told = await bench.read(question)
    if told is None:
        yield False
        return
    before: Values = list(getattr(told, name))
    values = change(before)
    async with bench.owing(await bench.unit() or ANY_UNIT, setting(**{name: before})):
        await bench.refused(setting(**{name: values}))
        after = await bench.read(question)
        yield after is not None and all(
            value in (None, read) for value, read in zip(values, getattr(after, name), strict=False)
        )


@asynccontextmanager
async def _slowly(bench: FicsBench) -> AsyncIterator[bool]:
    """Let moves be slow, and the speed be as it was after; whatever goes on then is stopped.

    Gives whether the slow speed was read back: without that nothing moves.
    """

    def slow(percents: Values) -> Values:
        return [None if percent is None else min(SLOW_PERCENT, percent) for percent in percents]

    async with _meanwhile(bench, GetSpeedPercent(), SetSpeedPercent, slow) as is_slow:
        try:
            yield is_slow
        except BaseException:
            await _halted(bench)
            raise


async def _halted(bench: FicsBench, *gently: FicsCommand[Any]) -> bool:
    """Stop all that moves until it is seen to stand still; False if it is not.

    :param gently: stops that are tried before.
    """
    with suppress(TransportError):
        for stop in (*gently, *[StopAllImmediately()] * STOPS):
            bench.talk.send(bench.frame(stop))
            deadline = bench.talk.now() + STOPPED_WITHIN_S
            while bench.talk.now() < deadline:
                before = await bench.places_at_rest()
                await bench.pause(REST_S)
                if before is not None and before == await bench.places_at_rest():
                    return True
    return False


async def _stands(bench: FicsBench) -> float | None:
    """Wait until the robot stands, and give the place of its first axis; stop a move that takes too long."""
    deadline = bench.talk.now() + LONGEST_MOVE_S
    while bench.talk.now() < deadline:
        status = await bench.read(GetAxisStatus())
        if status is not None and {axis.motion_mode for axis in status.axes} <= STANDS:
            told = await bench.read(GetUserPosition())
            place: float | None = None if told is None else told.coordinates[0]
            return place
        await bench.pause(LISTEN_S)
    await _halted(bench)
    return None


async def homing_outlasts(row: Assumption, bench: FicsBench) -> Finding:
    """Look whether a slow move leaves the robot homed."""
    way = await _way(row, bench, f"moves there and back between {{places}} {SLOWLY}")
    if isinstance(way, Finding):
        return way
    async with _slowly(bench) as is_slow:
        if not is_slow:
            return _surprise("The slow speed was not taken (VAO). Nothing has moved.")
        for place in (way.target, way.here):
            bench.talk.send(bench.frame(way.to(place)))
            await bench.settle()
            at = await _stands(bench)
            if at is None:
                told = await bench.told(GetUserPosition()) or "nothing"
                return fails(row, f"After a slow move the robot tells its positions as {told}.")
            if abs(at - place) > 0.02:
                return _surprise(f"The axis was sent to {place:g} and is at {at:g}.")
    return agrees("A slow move there and back has left the robot homed.")


async def stop_overtakes(row: Assumption, bench: FicsBench) -> Finding:
    """Stop a slow move by both stops, one right after the other."""
    what = "and is stopped on its way; the state EMERGENCY is reset then (DRT)"
    way = await _way(row, bench, f"moves between {{places}} {SLOWLY}, {what}")
    if isinstance(way, Finding):
        return way
    async with _slowly(bench) as is_slow:
        if not is_slow:
            return _surprise("The slow speed was not taken (VAO). Nothing has moved.")
        bench.talk.send(bench.frame(way.to(way.target)))
        await bench.pause(STOP_AFTER_S)
        since = len(bench.talk.heard)
        for stop in (StopAllDecelerating(), StopAllImmediately()):
            bench.talk.send(bench.frame(stop))
        await bench.settle()
        place = await _stands(bench)
        told = [line.data.decode("ascii", "replace").strip() for line in bench.talk.heard[since:]]
        error = await bench.read(TakeCurrentError())
        await bench.ask(ResetErrors())
        if place is None:
            return _surprise("The robot does not stand after both stops.")
    refusals = [
        answer for answer in (*told, "" if error is None else str(error.error)) if answer.endswith("E04")
    ]
    if refusals:
        return fails(row, "AES right after ASS is refused with E04; the robot stands.")
    return agrees("ASS and AES right after it are both taken; the robot stands.")


# A JOG, which has no end of its own


@dataclass(slots=True)
class Jogged:
    """An axis that jogs, as its robot tells of it."""

    modes: list[set[MotionMode]] = field(default_factory=list)
    """The motion modes of its unit, at each look."""
    places: list[float] = field(default_factory=list)
    """The places of the axis, where the robot tells them."""
    refusal: str | None = None
    """The error that refused the JOG in Ver.3."""

    def has_moved(self, way: Way) -> bool:
        """Tell whether the axis has left the place where it stood."""
        return any(place != way.here for place in self.places)

    def is_seen(self, way: Way) -> bool:
        """Tell whether enough is seen: it moves, is where it must not be, or was refused."""
        low, high = way.ends
        beyond = any(not low <= place <= high for place in self.places)
        return self.refusal is not None or beyond or (self.has_moved(way) and len(self.modes) >= LOOKS)


async def jog_mode(row: Assumption, bench: FicsBench) -> Finding:
    """Let an axis jog for a moment, and ask for its motion mode meanwhile."""
    way = await _way(
        row,
        bench,
        f"jogs towards the farther of {{places}} for {JOG_S:g} s at most (JOG), and is stopped; until then "
        f"its maximum speed is {SLOW_PERCENT:g} % of its own (VSO), and its soft limits are the ends of that "
        "way (SLP, SLM)",
    )
    if isinstance(way, Finding):
        return way
    low, high = way.ends
    others: Values = [None] * (way.axes - 1)
    async with AsyncExitStack() as bounds:
        for question, setting, value in (
            (GetMaximumSpeeds(), SetMaximumSpeeds, _slow),
            (GetUpperSoftLimits(), SetUpperSoftLimits, partial(min, high)),
            (GetLowerSoftLimits(), SetLowerSoftLimits, partial(max, low)),
        ):
            change = partial(_of_first, value, others)
            if not await bounds.enter_async_context(_meanwhile(bench, question, setting, change)):
                return cannot_tell(row, f"{question.code} was not taken. Nothing has moved.")
        jogged, end = await _jog(bench, way)
    if not end:
        return _surprise(f"Axis {way.axis} was not seen to stand still after its JOG. {HARDWARE_STOP}")
    return _told_of_jog(row, way, jogged)


def _of_first(change: Callable[[float], float], others: Values, values: Values) -> Values:
    """Other values of the first axis; those of the others are not set."""
    first = values[0]
    return [None if first is None else change(first), *others]


def _slow(speed: float) -> float:
    return max(round(speed * SLOW_PERCENT / 100, 1), LEAST_SPEED)


async def _jog(bench: FicsBench, way: Way) -> tuple[Jogged, bool]:
    """Let the axis jog until enough is seen, or its time is over; gives whether it was seen to stand then."""
    jogged = Jogged()
    stop = StopJog(axis=way.axis)
    try:
        async with asyncio.timeout(JOG_S):
            await _watch_jog(bench, way, jogged)
    except TimeoutError:
        pass
    except BaseException:
        await _halted(bench, stop)
        raise
    return jogged, await _halted(bench, stop, stop)


async def _watch_jog(bench: FicsBench, way: Way, jogged: Jogged) -> None:
    """Begin the JOG, and look at it; in Ver.2 it is answered only where it is refused."""
    start = StartJog(axis=way.axis, direction="+" if way.target > way.here else "-")
    if bench.memory["tells"]:
        answers = await bench.ask(start)
        jogged.refusal = next((frame.error for frame in answers if isinstance(frame, FicsRefusal)), None)
    else:
        bench.talk.send(bench.frame(start))
    while not jogged.is_seen(way):
        await bench.pause(LISTEN_S)
        status, place = await bench.read(GetAxisStatus()), await bench.read(GetUserPosition())
        if status is not None:
            jogged.modes.append({axis.motion_mode for axis in status.axes})
        if place is not None and place.coordinates[0] is not None:
            jogged.places.append(place.coordinates[0])


def _told_of_jog(row: Assumption, way: Way, jogged: Jogged) -> Finding:
    low, high = way.ends
    beyond = [place for place in jogged.places if not low <= place <= high]
    if beyond:
        return _surprise(
            f"Axis {way.axis} was to jog between {low:g} and {high:g}, and was at {beyond[0]:g}."
        )
    if jogged.refusal is not None:
        return cannot_tell(row, f"JOG is refused with {jogged.refusal}.")
    if not jogged.has_moved(way) or not jogged.modes:
        return cannot_tell(row, f"Axis {way.axis} was not seen to move in {JOG_S:g} s.")
    told = ", ".join(sorted({str(int(mode)) for modes in jogged.modes for mode in modes}))
    seen = f"ACD tells motion mode {told} of a unit whose axis {way.axis} jogs."
    if all(MotionMode.JOG in modes for modes in jogged.modes):
        return agrees(seen)
    return _surprise(seen) if any(modes <= STANDS for modes in jogged.modes) else fails(row, seen)


def _surprise(seen: str) -> Finding:
    return Finding(Result.CONTRADICTS, seen, surprise=True)


TRIALS: Final[Mapping[str, Trial]] = MappingProxyType(
    {
        **QUESTIONS,
        "upload-end": upload_end,
        "upload-refusal": upload_refusal,
        "pos-left-out": pos_left_out,
        "numbers-as-set": numbers_as_set,
        "power-loss-read": power_loss_read,
        "power-loss-motion": power_loss_motion,
        "positions-after-power": positions_after_power,
        "error-after-power": error_after_power,
        "homing-outlasts": homing_outlasts,
        "jog-mode": jog_mode,
        "stop-overtakes": stop_overtakes,
    }
)
