"""A search for controllers at this machine's ports: an RC-400 and its bodies, or a Fics, and the baud rate.

Only frames that change no motor are sent: a line too long to be a command, so that a half command left on the
line is not executed; XID to the link master; reads of position entries; and the questions MOD, VER, UNT and
ACD to a Fics. Each unit of a Fics that stands is selected in turn, and then the first one again: its terminal
(RT1) shows them meanwhile. Any other device at a port hears bytes that it does not know.
"""

import asyncio
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, TypeVar
from urllib.parse import quote

from serial.tools import list_ports

from gateway.core.line import FrameReader
from gateway.fics.axes import at_rest
from gateway.found import Found, FoundLine, FoundRobot
from protocols.fics import link as fics
from protocols.fics.link import TERMINATORS
from protocols.fics.notation import LAST_UNIT
from protocols.fics.row import FicsCommand
from protocols.fics.status import AxisStatuses, GetAxisStatus
from protocols.fics.system import (
    CommunicationMode,
    GetCommunicationMode,
    GetSystemVersion,
    GetUnit,
    SelectUnit,
    SystemVersion,
    UnitNumbers,
)
from protocols.rorze import link as rorze
from protocols.rorze.link import POISON
from protocols.rorze.link_master import IdentifyControllers
from protocols.rorze.notation import PositionReference
from protocols.rorze.position_table import GetNumberedPositionEntry
from protocols.rorze.row import LAST_BODY, LINK_MASTER
from protocols.table import Reply, WireFault
from transports import Transport, TransportError, TransportLost, create
from transports.addresses import Address

BAUDS = (9600, 19200, 38400, 115200, 57600, 4800, 56000, 230400, 460800, 921600)
"""A Fics has 4800 to 56000 (C-HOST manual 1-3-1), an RC-400 9600 as delivered and up to 921600."""
ANSWERS_WITHIN_S = 0.3
"""A controller answers within milliseconds; a terminal server or an adapter may add its own."""
BODY_ANSWERS_WITHIN_S = 0.1
ROUNDS = 2
"""A body that missed the first question is asked again."""
SETTLES_S = 0.1
"""Seconds after the first bytes in which an answer to them ends."""
LONGEST_ANSWER = 64
"""Bytes of an answer that is waited for."""
LONGEST_NAMES = 3 * (LAST_BODY + 1) + len(">&7FXID")
"""Bytes of an answer to XID that names all bodies (RC-420 manual 17.2)."""
UNKNOWN_BYTE_S = 10 / BAUDS[0]
"""Time of a byte behind a terminal server, which does not tell its baud rate."""
ENTRIES = 2048

F = TypeVar("F")
T = TypeVar("T")
Tell = Callable[[str, str], None]
"""Called with the address of a port, and what goes on there."""


def serial_devices() -> list[str]:
    """The serial ports of this machine, by names that stay where there are such."""
    return sorted(map(_lasting_name, (port.device for port in list_ports.comports())))


def _lasting_name(device: str, links: Path = Path("/dev/serial/by-id")) -> str:
    for link in sorted(links.iterdir()) if links.is_dir() else ():
        if link.resolve() == Path(device).resolve():
            return str(link)
    return device


def addresses_of(port: str) -> list[str]:
    """All addresses to try for a port: those of each baud rate, where none is named.

    :raises ValueError: it is neither a device nor an address.
    """
    address = f"serial://{quote(port)}" if port.startswith("/") else port
    create(address)
    if Address.parse(address).scheme == "serial" and "baud" not in Address.parse(address).options:
        return [f"{address}?baud={baud}" for baud in BAUDS]
    return [address]


async def search(
    ports: Sequence[Sequence[str]],
    found: list[Found],
    tell: Tell,
    *,
    note: Callable[[str], None],
    open_transport: Callable[[str], Transport] = create,
    thorough: bool = True,
) -> None:
    """Search all ports at once, each by its addresses in turn; `found` grows as controllers answer.

    Where it is not to be thorough, only the bodies are asked that the link master names, if one of these
    answers: to wait for the silence of all others takes a minute. `note` is told which ports could not be
    opened. Cancelled, it leaves what was found.
    """
    async with asyncio.TaskGroup() as together:
        for addresses in ports:
            together.create_task(_search_port(addresses, found, tell, note, open_transport, thorough))


async def _search_port(
    addresses: Sequence[str],
    found: list[Found],
    tell: Tell,
    note: Callable[[str], None],
    open_transport: Callable[[str], Transport],
    thorough: bool,
) -> None:
    for address in addresses:
        tell(address, "asking who is there")
        port = open_transport(address)
        try:
            if await _search_address(Questions(port), found, tell, thorough):
                return
        except TransportError as error:
            note(f"{error}")
            return
        finally:
            await port.close()


async def _search_address(questions: "Questions", found: list[Found], tell: Tell, thorough: bool) -> bool:
    """Search one address; say whether a controller answers there."""
    await questions.open()
    address = questions.port.address
    if not address.startswith("dpram:"):
        line = await _find_line(questions)
        if line is not None:
            found.append(line)
            await _find_bodies(questions, line, tell, thorough)
            return True
    robot = await _find_robot(questions)
    if robot is not None:
        found.append(robot)
        await _describe(questions, robot)
    return robot is not None


class Questions:
    """One port, on which one question is asked after the other."""

    def __init__(self, port: Transport) -> None:
        self.port = port
        self.took_s = 0.0
        """Seconds from the last question that was answered to its answer: a slow line is given its time."""
        self._received: asyncio.Queue[bytes | TransportLost] = asyncio.Queue()

    async def open(self) -> None:
        """Open the port and end whatever was half said on it.

        :raises TransportUnavailable: it cannot be opened.
        """
        await self.port.open(self)
        self.port.write(POISON)
        await asyncio.sleep(len(POISON) * self.port.byte_time_s + SETTLES_S)

    def data_received(self, data: bytes) -> None:
        """Bytes from the port."""
        self._received.put_nowait(data)

    def connection_lost(self, error: TransportLost) -> None:
        """The port has gone."""
        self._received.put_nowait(error)

    async def ask(
        self,
        question: bytes,
        reader: FrameReader[F],
        answer: Callable[[F], T | None],
        within_s: float,
        longest: int = LONGEST_ANSWER,
    ) -> T | None:
        """Ask, and give the first answer that is one, of `longest` bytes at most; None if none comes.

        :raises TransportLost: the port has gone.
        """
        while not self._received.empty():
            self._next(self._received.get_nowait())
        self.port.write(question)
        wire_s = (len(question) + longest) * (self.port.byte_time_s or UNKNOWN_BYTE_S)
        asked_at = asyncio.get_running_loop().time()
        try:
            async with asyncio.timeout(wire_s + within_s):
                while True:
                    for frame in reader.feed(self._next(await self._received.get())):
                        if (found := answer(frame)) is not None:
                            self.took_s = asyncio.get_running_loop().time() - asked_at
                            return found
        except TimeoutError:
            return None

    @staticmethod
    def _next(received: bytes | TransportLost) -> bytes:
        if isinstance(received, TransportLost):
            raise received
        return received


# an RC-400


async def _find_line(questions: Questions) -> FoundLine | None:
    def answer(frame: rorze.Frame) -> str | None:
        if not isinstance(frame, rorze.Answer | rorze.Refusal):
            return None
        if (frame.body, frame.code) != (LINK_MASTER, IdentifyControllers.code):
            return None
        return frame.payload if isinstance(frame, rorze.Answer) else ""

    question = rorze.encode(LINK_MASTER, IdentifyControllers())
    controllers = await questions.ask(question, rorze.LinkReader(), answer, ANSWERS_WITHIN_S, LONGEST_NAMES)
    return None if controllers is None else FoundLine(questions.port.address, controllers)


async def _find_bodies(questions: Questions, line: FoundLine, tell: Tell, thorough: bool) -> None:
    """Ask those that are named, or all body numbers."""
    named = [body for body in line.named() if body <= LAST_BODY]
    if not thorough:
        await _ask_bodies(questions, line, tell, named)
    if thorough or not line.bodies:
        await _ask_bodies(questions, line, tell, range(LAST_BODY + 1))
        line.complete = True


async def _ask_bodies(questions: Questions, line: FoundLine, tell: Tell, bodies: Sequence[int]) -> None:
    """Ask body numbers; each by another position entry, whose number comes back."""
    missing = list(bodies)
    for turn in range(ROUNDS):
        for body in list(missing):
            tell(line.address, f"asking body {body:02X} of {LAST_BODY:02X}; {len(line.bodies)} found")
            if await _is_there(questions, body, entry=(turn * (LAST_BODY + 1) + body) % ENTRIES):
                missing.remove(body)
                line.bodies.append(body)
                line.bodies.sort()


async def _is_there(questions: Questions, body: int, entry: int) -> bool:
    command = GetNumberedPositionEntry(entry=PositionReference(position=entry))

    def answer(frame: rorze.Frame) -> bool | None:
        if not isinstance(frame, rorze.Answer) or (frame.body, frame.code) != (body, command.code):
            return None
        try:
            return True if command.read_reply(frame.payload).position == entry else None
        except WireFault:
            return None

    question = rorze.encode(body, command)
    within_s = max(BODY_ANSWERS_WITHIN_S, 2 * questions.took_s)
    return bool(await questions.ask(question, rorze.LinkReader(), answer, within_s))


# a Fics


async def _find_robot(questions: Questions) -> FoundRobot | None:
    """Ask with either end of a line; in motion VER is answered, and MOD is not (C-HOST manual 2-36)."""
    for terminator in TERMINATORS:
        robot = FoundRobot(questions.port.address, terminator)
        for query in (GetCommunicationMode(), GetSystemVersion()):
            answer = await _ask_robot(questions, robot, query)
            if isinstance(answer, CommunicationMode):
                robot.mode = answer.mode
            if answer is not None:
                return robot
    return None


async def _describe(questions: Questions, robot: FoundRobot) -> None:
    """Ask for what the configuration needs; units are selected only where nothing moves."""
    version = await _ask_robot(questions, robot, GetSystemVersion())
    robot.version = version if isinstance(version, SystemVersion) else None
    present = await _present_unit(questions, robot)
    axes = await _ask_robot(questions, robot, GetAxisStatus())
    if not isinstance(axes, AxisStatuses):
        return
    robot.units = {present or 1: len(axes.axes)}
    if present is not None and at_rest(axes.axes):
        await _find_units(questions, robot, present)


async def _find_units(questions: Questions, robot: FoundRobot, present: int) -> None:
    """Select units from 1 up until one is refused, and count their axes; `present` is selected again."""
    try:
        for number in range(1, LAST_UNIT + 1):
            await _ask_robot(questions, robot, SelectUnit(unit=number))
            if await _present_unit(questions, robot) != number:
                break
            axes = await _ask_robot(questions, robot, GetAxisStatus())
            if isinstance(axes, AxisStatuses):
                robot.units[number] = len(axes.axes)
    finally:
        for _ in range(ROUNDS):
            await _ask_robot(questions, robot, SelectUnit(unit=present))
            if await _present_unit(questions, robot) == present:
                break


async def _present_unit(questions: Questions, robot: FoundRobot) -> int | None:
    numbers = await _ask_robot(questions, robot, GetUnit())
    return numbers.host_unit if isinstance(numbers, UnitNumbers) else None


async def _ask_robot(
    questions: Questions, robot: FoundRobot, query: FicsCommand[Any]
) -> Reply | fics.FicsRefusal | fics.SystemFailure | fics.Completion | None:
    """Its answer or its refusal: either shows that a Fics is there."""
    return await questions.ask(
        fics.encode(query, robot.terminator),
        fics.Ver3Reader(),  # reads both modes
        lambda frame: fics.credit(query, frame),
        ANSWERS_WITHIN_S,
    )
