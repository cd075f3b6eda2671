"""A body as its features see it: what they ask of it and heed. `gateway.rorze.bodies.Body` is one."""

import asyncio
import re
import secrets
from collections import deque
from collections.abc import AsyncGenerator, Awaitable, Callable, Coroutine, Iterable, Mapping, Sequence
from contextlib import AbstractAsyncContextManager, AbstractContextManager
from operator import eq
from typing import Any, Final, Literal, Protocol, TypeVar

from typing_extensions import TypeAliasType

from gateway.core.errors import GatewayError, NotSent
from gateway.core.exchange import Lane
from gateway.core.move_record import CountedIn
from gateway.rorze.units import Scale
from protocols.rorze.encoder import GetEncoderRatio
from protocols.rorze.modes import GetOperatingMode
from protocols.rorze.notation import PositionReference
from protocols.rorze.position_table import GetNumberedPositionEntry
from protocols.rorze.row import ModeName, RorzeCommand
from protocols.table import Reply

R = TypeVar("R", bound=Reply)
_MARK: Final = re.compile("GW-[0-9a-f]{8}")


class Epochs(Protocol):
    """The stops that there were: what was admitted before one is not written any more."""

    def epoch(self, target: int, /) -> int:
        """Counts them."""

    def overtaken(self, target: int, /) -> GatewayError:
        """Why what was admitted earlier is not written."""


class AskedLine(Protocol):
    """The line of a body."""

    @property
    def id(self) -> str:
        """Its id in the configuration."""

    @property
    def gate(self) -> Epochs:
        """The gate that every frame passes."""

    def errs(self) -> bool:
        """True while it has lately garbled or lost a frame."""

    def undivided(
        self, targets: Iterable[int], expires_at: float | None = None, /
    ) -> AbstractAsyncContextManager[Any]:
        """Send a series to several targets that nothing but stops divides."""

    def sending(self, body: int, commands: Sequence[RorzeCommand[Any]], /) -> AbstractContextManager[None]:
        """Wait for the disk once, whatever of these is sent."""


class KnownFlash(Protocol):
    """The known content of flash memory."""

    @property
    def known(self) -> bool:
        """True if anything is known."""

    def held(self, question: RorzeCommand[Any], /) -> Reply | None:
        """How a question would be answered by it."""

    def may_be_unset(self, command: RorzeCommand[Any], /) -> bool:
        """True if what a command sets may never have been set, though it reads so."""


Homed = TypeAliasType("Homed", Literal["yes", "no", "unknown"])


class PowerLosses(Protocol):
    """The losses of a body's power."""

    @property
    def homed(self) -> Homed:
        """True if it was homed, and has kept its power since."""

    @property
    def losses(self) -> int:
        """Counts them."""


class StandingMark(Protocol):
    """A mark that a body forgets without power."""

    async def stands(self, lane: Lane, /) -> bool | None:
        """True if it is there; None where that is not known."""


def new_mark() -> str:
    """Make a mark that no body has had before."""
    return f"GW-{secrets.token_hex(4)}"


def is_mark(text: str) -> bool:
    """True if a comment is empty, or a mark of this gateway or of an earlier one: it may be overwritten."""
    return not text or _MARK.fullmatch(text) is not None


def counted_in(mode: ModeName | None) -> CountedIn:
    """The unit in which positions and amounts are counted (RC-420 manual 13.1)."""
    return "encoder_counts" if mode == "encoder" else "pulses"


class Resting(Protocol):
    """A body's answer about its motor."""

    @property
    def runs(self) -> bool:
        """True if pulses run."""


class AskedBody(Protocol):
    """One RC-420 axis controller."""

    number: int
    """Number of the body on its line."""
    changing: asyncio.Lock
    """Held while its settings are being changed."""

    @property
    def scale(self) -> Scale | None:
        """Its pulses in a unit; None: not configured."""

    @property
    def input_names(self) -> Mapping[int, str]:
        """The names of its inputs, by their numbers."""

    @property
    def output_names(self) -> Mapping[int, str]:
        """The names of its outputs, by their numbers."""

    @property
    def sent_count(self) -> int:
        """Counts the commands sent to it that are no reads."""

    @property
    def poll_interval_s(self) -> float:
        """While it has a move, its state is asked for this often."""

    @property
    def line(self) -> AskedLine:
        """The line that it is on."""

    @property
    def address(self) -> str:
        """Its address that is always unique, such as `LINE.3F`."""

    @property
    def flash(self) -> KnownFlash:
        """The content of its flash memory, as far as known."""

    @property
    def power(self) -> PowerLosses:
        """The state of its power, as far as known."""

    @property
    def mark(self) -> StandingMark:
        """The mark that shows that it has kept its power."""

    @property
    def move(self) -> object | None:
        """The move that is not over yet."""

    @property
    def on_news(self) -> Callable[[str, dict[str, object]], None]:
        """Called with what it does unasked: the kind of event, and its data."""

    def looking(self) -> AbstractAsyncContextManager[None]:
        """Leave no command error of questions that are refused inside, where no caller has caused one."""

    async def ask(self, command: RorzeCommand[R], /) -> tuple[R, Any]:
        """Send a command and give its reply, with when it came.

        :raises GatewayError: it was refused, not sent, or not answered; the error says which.
        """

    async def where_it_rests(self) -> Resting:
        """Give the state it was seen at rest in a moment ago; otherwise ask.

        :raises GatewayError: it did not tell.
        """


# what decides something is read twice on a line that errs

MOST_READINGS = 8
"""Readings without two equal ones in a row, after which a value counts as unknown."""

AHEAD = 2
"""Questions of one reader at the line: enough to keep it busy, few enough not to delay others."""

T = TypeVar("T")


async def believed(
    line: AskedLine, read: Callable[[], Awaitable[T]], agree: Callable[[Any, Any], bool] = eq
) -> T:
    """Give a reading; while the line errs, one that came twice in a row.

    :raises NotSent: no two readings agree.
    :raises GatewayError: it was not read.
    """
    found = await read()
    for _ in range(MOST_READINGS):
        if not line.errs():
            return found
        again = await read()
        if agree(found, again):
            return again
        found = again
    raise NotSent(
        f"Line {line.id} garbles its frames: no two readings agree; only questions were sent.", "Try again."
    )


async def read_pulses(body: AskedBody, number: int) -> int:
    """Read one stored position (3ND); on a line that errs it is believed when it came twice.

    :raises GatewayError: it was not read.
    """
    command = GetNumberedPositionEntry(entry=PositionReference(position=number))

    async def ask() -> int:
        return (await body.ask(command))[0].pulses

    return await believed(body.line, ask)


async def pulses_per_count(body: AskedBody) -> float:
    """The pulses that are put out for one unit of the operating mode, which may be an encoder count.

    :raises GatewayError: it was not read.
    """
    mode, _ = await body.ask(GetOperatingMode())
    if mode.mode != "encoder":
        return 1.0
    ratio, _ = await body.ask(GetEncoderRatio())
    return ratio.ratio


async def closely(questions: Iterable[Coroutine[Any, Any, T]]) -> AsyncGenerator[T, None]:
    """Give answers in order; the next question waits at the line while the one before is answered.

    :raises GatewayError: one was not answered.
    """
    asked: deque[asyncio.Task[T]] = deque()
    try:
        for question in questions:
            asked.append(asyncio.create_task(question))
            if len(asked) == AHEAD:
                yield await asked.popleft()
        while asked:
            yield await asked.popleft()
    finally:
        for task in asked:
            task.cancel()
        await asyncio.gather(*asked, return_exceptions=True)
