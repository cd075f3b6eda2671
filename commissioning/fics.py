"""The trials of a Fics robot."""

import re
from collections.abc import Awaitable, Callable, Iterator, Mapping, Sequence
from itertools import count
from types import MappingProxyType
from typing import Any, Final

from commissioning.assumptions import Assumption
from commissioning.bench import SETTLES_S, TRIES, Bench, Key, Terms, copies, echo, late_replies, turnaround
from commissioning.conversation import Conversation, Heard
from commissioning.debts import Debt
from commissioning.findings import Change, Finding, Unanswered, agrees, cannot_tell, fails
from gateway.fics.session import NO_UPLOAD
from gateway.fics.units import NOT_SET
from protocols.fics.alarms import GetErrorDetail, TakeCurrentError
from protocols.fics.commands import BY_NAME
from protocols.fics.link import (
    TERMINATORS,
    FicsRefusal,
    Frame,
    QueryAnswer,
    Terminator,
    Ver3Reader,
    encode,
)
from protocols.fics.motor_axes import GetMotorPosition
from protocols.fics.notation import DECIMALS, LARGEST, UNKNOWN
from protocols.fics.positions import DownloadPositions, EndPositionUpload
from protocols.fics.row import FicsCommand
from protocols.fics.status import STATUS_BITS, AxisStatuses, GetAxisStatus, GetUserPosition, MotionMode
from protocols.fics.system import GetCommunicationMode, GetSystemVersion, GetUnit, HostMode, SelectUnit
from protocols.fics.variables import GetVariable, VariableValue
from protocols.table import WireFault
from transports.addresses import Address

ROBOT: Final = 0
"""A robot is alone on its line."""
ANY_UNIT: Final = 0
NO_ERROR: Final = "E00"
STANDS: Final = frozenset({MotionMode.STANDING, MotionMode.STOPPED})
CLEARING: Final = b"!"
POSITIONS_READ: Final = 8
HUNDREDTHS: Final = 2
REST_S: Final = 0.3
"""An axis that stands still does not move in this time."""
_NUMBER = re.compile(r"[+-]?[0-9]*\.?([0-9]*)")


class FicsBench(Bench):
    """A robot at its port."""

    rows = BY_NAME
    kind = "a Fics"

    def __init__(self, line: Any, talk: Conversation, terms: Terms) -> None:
        super().__init__(line, talk, terms)
        self._variables = count()
        self.terminator: Terminator = line.terminator
        """The end of a line that the robot understands."""

    @property
    def speakers(self) -> Sequence[int]:
        """The robot."""
        return [ROBOT]

    def numbered(self, speaker: int) -> tuple[Key, bytes]:
        """Ask for the next variable."""
        number = next(self._variables)
        return (speaker, number), self.frame(GetVariable(number=number))

    def key_of(self, heard: bytes) -> Key | None:
        """Read the number of an answer to VAR."""
        for frame in Ver3Reader().feed(heard):
            if isinstance(frame, QueryAnswer) and frame.name == GetVariable.code:
                try:
                    return ROBOT, VariableValue.read(frame.payload).number
                except WireFault:
                    return None
        return None

    def frame(self, command: FicsCommand[Any]) -> bytes:
        """Write a command with the end that the robot understands."""
        return encode(command, self.terminator)

    async def reach(self) -> None:
        """Find the end of a line that the robot understands, the configured one first."""
        for terminator in sorted(TERMINATORS, key=lambda terminator: terminator != self.line.terminator):
            self.terminator = terminator
            if await self.told(GetSystemVersion()) is not None:
                return
        self.terminator = self.line.terminator

    async def ask(self, command: FicsCommand[Any], within_s: float = 0.0) -> list[Frame]:
        """Send a command and give the frames that answer it: of several the last ends them."""
        frame = self.frame(command)
        since = len(self.talk.heard)
        self.talk.send(frame)
        names = [name for name in command.reply_names if name]

        def answers(lines: Sequence[Heard]) -> list[Frame]:
            return [frame for frame in _frames(lines) if getattr(frame, "name", None) in names]

        def over(lines: Sequence[Heard]) -> bool:
            last = answers(lines)[-1:]
            return bool(last) and (not command.ends_with or not isinstance(last[0], QueryAnswer))

        return answers(await self.talk.hear(over, self.within_s(frame) + within_s, since))

    async def told(self, command: FicsCommand[Any], tries: int = TRIES) -> str | None:
        """Ask for one answer, and give its text; None if none came to any of `tries` questions."""
        for _ in range(tries):
            answers = await self.ask(command)
            if answers:
                return next((frame.payload for frame in answers if isinstance(frame, QueryAnswer)), None)
        return None

    async def read(self, command: FicsCommand[Any], tries: int = TRIES) -> Any:
        """Ask for one answer, and give it as the command's row reads it; None if none came."""
        payload = await self.told(command, tries)
        try:
            return None if payload is None else command.read_reply(payload)
        except WireFault:
            return None

    async def refused(self, command: FicsCommand[Any]) -> str | None:
        """Send a command, and give the error that refused it; a robot in Ver.2 tells it only if asked (ERR).

        :raises Unanswered: it has told neither.
        """
        reply = await self.read(GetCommunicationMode()) if not self.memory.get("uploading") else None
        tells = reply is not None and reply.mode == HostMode.VER_3
        self.memory["tells"] = tells = self.memory.get("tells", tells) if reply is None else tells
        if tells or command.is_query():
            frames = await self.ask(command)
            refusals = [frame.error for frame in frames if isinstance(frame, FicsRefusal)]
            if tells and not frames:
                raise Unanswered(f"{command.code} was not answered.")
            if frames:
                return refusals[0] if refusals else None
        else:
            self.talk.send(self.frame(command))
            await self.settle()
        error = await self.read(TakeCurrentError(), tries=1)  # asking has cleared it
        if error is None:
            raise Unanswered(f"The robot did not tell whether it has refused {command.code}.")
        return None if error.error == NO_ERROR else str(error.error)

    async def unit(self) -> int | None:
        """The number of the unit that the robot has selected; None if it does not tell."""
        units, told = self.line.robot.units, await self.read(GetUnit())
        return told.host_unit if told is not None else units[0].number if len(units) == 1 else None

    async def places_at_rest(self) -> str | None:
        """The places of all motors, where each tells that it stands; None if one does not."""
        status, places = await self.read(GetAxisStatus()), await self.told(GetMotorPosition())
        return places if status is not None and {axis.motion_mode for axis in status.axes} <= STANDS else None

    def frame_of(self, debt: Debt) -> bytes:
        """The frame that pays a debt."""
        return self.frame(self.command_of(debt))

    def subject_of(self, debt: Debt) -> str:  # noqa: ARG002  # a robot is alone on its line
        """The robot."""
        return str(self.line.robot.id)

    async def set_back(self, place: int, command: FicsCommand[Any]) -> None:
        """Restore a setting, with its unit selected and all axes at rest.

        :raises Unanswered: it was not taken, or that is not known.
        """
        self.memory["uploading"] = isinstance(command, EndPositionUpload)  # then all but ERR is refused
        if place != ANY_UNIT:
            if place != await self.unit():
                await self.refused(SelectUnit(unit=place))
            if await self.places_at_rest() is None:
                raise Unanswered("Something moves: it would go faster, or farther.")
        error = await self.refused(command)
        self.memory["uploading"] = False
        if error not in (None, NO_UPLOAD):
            raise Unanswered(f"{command.code} was refused with {error}.")

    async def is_there(self) -> bool:
        """Tell whether the robot answers."""
        await self.sample()
        return bool(self.present)

    async def describe(self) -> None:
        """Ask for the versions."""
        told = await self.told(GetSystemVersion()) if self.present else None
        if told is not None:
            self.serial_numbers[self.line.robot.id] = told


def _frames(lines: Sequence[Heard]) -> Iterator[Frame]:
    for line in lines:
        yield from Ver3Reader().feed(line.data)


NOBODY: Final = "The robot has not answered."


# Questions


async def robot_terminator(row: Assumption, bench: FicsBench) -> Finding:
    """Say which end of a line the robot understands."""
    if not await bench.is_there():
        return cannot_tell(row, NOBODY)
    seen = f"The robot answers lines that end with {bench.terminator.upper()}."
    if bench.terminator == bench.line.terminator:
        return agrees(seen)
    return fails(row, seen, Change(row.key, bench.terminator))


async def half_robot_command(row: Assumption, bench: FicsBench) -> Finding:
    """Send half a question, and what ends it."""
    if not await bench.is_there():
        return cannot_tell(row, NOBODY)
    question = GetSystemVersion()
    since = len(bench.talk.heard)
    bench.talk.send(question.text.encode("ascii"))
    await bench.pause(SETTLES_S)
    ending = CLEARING + TERMINATORS[bench.terminator]
    bench.talk.send(ending)
    await bench.talk.hear(lambda _: False, bench.within_s(ending), since)
    lines = bench.talk.heard[since:]
    if any(isinstance(frame, QueryAnswer) and frame.name == question.code for frame in _frames(lines)):
        return fails(row, "Half a question was answered, and what ended it with it.")
    if not await bench.ask_number(ROBOT):
        return fails(row, "Nothing is answered any more after half a question and what ends it.")
    told = b"".join(line.data for line in lines).decode("ascii", "replace").strip()
    return agrees(f"Half a question and what ends it were answered by {told or 'nothing'}.")


async def _coordinates(bench: FicsBench) -> list[str]:
    """All coordinates that the robot tells of its present unit, as text."""
    texts = [await bench.told(question) for question in (GetUserPosition(), GetMotorPosition())]
    numbers = [number for text in texts if text for number in text.split(",")]
    return [number for number in numbers if number and number != UNKNOWN]


async def stored(bench: FicsBench, first: int, wanted: int) -> tuple[list[str], Frame | None]:
    """Stored positions as text, and what ended them."""
    frames = await bench.ask(DownloadPositions(first=first, count=wanted))
    ends = [frame for frame in frames if not isinstance(frame, QueryAnswer)]
    return [frame.payload for frame in frames if isinstance(frame, QueryAnswer)], ends[0] if ends else None


async def robot_decimals(row: Assumption, bench: FicsBench) -> Finding:
    """Look at the decimals and the size of all coordinates that are told."""
    if not await bench.is_there():
        return cannot_tell(row, NOBODY)
    positions, _ = await stored(bench, 1, POSITIONS_READ)
    numbers = await _coordinates(bench) + [
        number for text in positions for number in text.split(",") if number
    ]
    if not numbers:
        return cannot_tell(row, "The robot tells no coordinates.")
    most, largest = max(map(_decimals, numbers)), max(abs(float(number)) for number in numbers)
    seen = f"Coordinates have {most} decimals at most, the largest is {largest:g}."
    return agrees(seen) if most <= DECIMALS and largest <= LARGEST else fails(row, seen)


def _decimals(number: str) -> int:
    match = _NUMBER.fullmatch(number)
    return len(match[1]) if match is not None and "." in number else 0


async def displayed_hundredths(row: Assumption, bench: FicsBench) -> Finding:
    """Count the decimals of positions; those of pulses have none."""
    if not await bench.is_there():
        return cannot_tell(row, NOBODY)
    numbers = [number for number in await _coordinates(bench) if "." in number]
    if not numbers:
        return cannot_tell(row, "The robot tells no positions with decimals.")
    most = max(map(_decimals, numbers))
    seen = f"Positions have {most} decimals, such as {max(numbers, key=_decimals)}."
    if most == HUNDREDTHS:
        return agrees(seen)
    if most < HUNDREDTHS and not any(number.endswith("0") for number in numbers):
        return cannot_tell(row, seen, "A robot at a place with hundredths.")
    return fails(row, seen)


async def at_rest(bench: FicsBench) -> tuple[AxisStatuses, bool] | None:
    """The status of a unit at rest without an error, and whether it is homed; None if it is not so."""
    before = await bench.told(GetMotorPosition())
    await bench.pause(REST_S)
    status, after, detail = (
        await bench.read(GetAxisStatus()),
        await bench.told(GetMotorPosition()),
        await bench.told(GetErrorDetail()),
    )
    still = status is not None and all(axis.motion_mode == MotionMode.STANDING for axis in status.axes)
    no_error = detail is not None and not detail.strip("- ")
    if not still or before is None or before != after or not no_error:
        return None
    return status, UNKNOWN not in after


async def status_bits(row: Assumption, bench: FicsBench) -> Finding:
    """Compare the status bits of a robot at rest with what its positions and errors tell."""
    if not await bench.is_there():
        return cannot_tell(row, NOBODY)
    rest = await at_rest(bench)
    if rest is None:
        return cannot_tell(row, "The robot moves, has an error, or does not tell its status.")
    status, homed = rest
    order = bench.line.robot.status_bits
    on = {
        tuple(place for place, name in enumerate(STATUS_BITS) if getattr(axis, name)) for axis in status.axes
    }
    expected = {"servo_ready", *(["origin_done"] if homed else [])}
    digits = ", ".join(sorted(f"{sum(1 << place for place in places):X}" for places in on))
    seen = f"A robot at rest that is {'' if homed else 'not '}homed tells {digits} in ACD."
    if all({order[place] for place in places} == expected for places in on):
        return agrees(seen)
    if not homed and all({order[place] for place in places} == expected | {"origin_done"} for places in on):
        return cannot_tell(
            row, f"{seen} It may be homed, and hide its positions.", "See to hidden-positions."
        )
    (places, *others) = on
    if others or len(places) != len(expected):
        return fails(row, seen)
    return fails(row, seen, Change(row.key, list(_order(order, places, expected))))


def _order(order: Sequence[str], places: Sequence[int], expected: set[str]) -> Iterator[str]:
    """Give the bits that are on the names that are so, and leave the rest in its order."""
    on = [name for name in order if name in expected]
    off = [name for name in order if name not in expected]
    for place in range(len(order)):
        yield (on if place in places else off).pop(0)


async def hidden_positions(row: Assumption, bench: FicsBench) -> Finding:
    """Read the positions of a robot that stands still and is homed."""
    if not await bench.is_there():
        return cannot_tell(row, NOBODY)
    status = await bench.read(GetAxisStatus())
    place = bench.line.robot.status_bits.index("origin_done")
    homed = status is not None and all(
        getattr(axis, STATUS_BITS[place]) and axis.motion_mode == MotionMode.STANDING for axis in status.axes
    )
    if not homed:
        return cannot_tell(row, "The robot is not homed, or something runs in it.")
    told = await bench.told(GetUserPosition()) or ""
    seen = f"A robot that is homed and at rest tells its positions as {told or 'nothing'}."
    return fails(row, seen) if UNKNOWN in told or not told else agrees(seen)


async def por_end(row: Assumption, bench: FicsBench) -> Finding:
    """Read stored positions at once and one by one."""
    if not await bench.is_there():
        return cannot_tell(row, NOBODY)
    at_once, end = await stored(bench, 1, POSITIONS_READ)
    if end is None:
        return cannot_tell(row, "POR is not answered to its end.")
    one_by_one: list[str] = []
    told = [await stored(bench, number, 1) for number in range(1, POSITIONS_READ + 1)]
    for answers, _ in told:
        if not answers:
            break
        one_by_one += answers
    set_at_all = sum(bool(answers) for answers, _ in told)
    seen = f"POR of {POSITIONS_READ} numbers tells {len(at_once)} positions, one by one {set_at_all}."
    if at_once != one_by_one:
        return fails(row, seen)
    refusals = {end.error for answers, end in told if not answers and isinstance(end, FicsRefusal)}
    if refusals - {NOT_SET}:
        return fails(row, f"{seen} A number that is not set is refused with {', '.join(sorted(refusals))}.")
    if set_at_all == len(one_by_one):
        return cannot_tell(row, f"{seen} There is no hole among them.")
    return agrees(f"{seen} It has ended at the hole.")


async def dpram_map(row: Assumption, bench: FicsBench) -> Finding:
    """Say whether the robot answers at the place that is configured."""
    if Address.parse(bench.line.address).scheme != "dpram":
        return cannot_tell(row, "The line is at no dual-port RAM.")
    if not await bench.is_there():
        return cannot_tell(row, NOBODY)
    return agrees("The robot answers at the place that is configured.")


TAKEN: Final = 0.001
"""Seconds between looks at the flag of a message that waits in the dual-port RAM."""


async def dpram_times(row: Assumption, bench: FicsBench) -> Finding:
    """Measure how long a question waits in the RAM."""
    address = Address.parse(bench.line.address)
    if address.scheme != "dpram":
        return cannot_tell(row, "The line is at no dual-port RAM.")
    if not await bench.is_there():
        return cannot_tell(row, NOBODY)
    stuck_ms = address.integer("stuck_ms", 1000, 1, 60_000)
    waits = max([await _waits(bench) for _ in range(3)])
    seen = f"A question waits {waits * 1000:.0f} ms in the RAM, {stuck_ms} ms are allowed."
    if waits * 1000 <= stuck_ms:
        return agrees(seen)
    return fails(row, seen, Change(row.key, with_option(bench.line.address, "stuck_ms", int(3000 * waits))))


async def _waits(bench: FicsBench) -> float:
    question = bench.frame(GetSystemVersion())
    since = len(bench.talk.heard)
    sent_at = bench.talk.send(question)
    while bench.talk.port.unsent():
        await bench.pause(TAKEN)
    waited_s = bench.talk.now() - sent_at
    await bench.talk.hear(bool, bench.within_s(question), since)
    return waited_s


def with_option(address: str, name: str, value: int) -> str:
    """Give an address with another value of an option."""
    place, _, query = address.partition("?")
    others = [option for option in query.split("&") if option and not option.startswith(f"{name}=")]
    return f"{place}?{'&'.join((*others, f'{name}={value}'))}"


Trial = Callable[[Assumption, FicsBench], Awaitable[Finding]]

QUESTIONS: Final[Mapping[str, Trial]] = MappingProxyType(
    {
        "echo": echo,
        "late-replies": late_replies,
        "turnaround": turnaround,
        "copies-of-answers": copies,
        "robot-terminator": robot_terminator,
        "half-robot-command": half_robot_command,
        "robot-decimals": robot_decimals,
        "displayed-hundredths": displayed_hundredths,
        "status-bits": status_bits,
        "hidden-positions": hidden_positions,
        "por-end": por_end,
        "dpram-map": dpram_map,
        "dpram-times": dpram_times,
    }
)
