"""One port that only the trials use: every frame that passes is kept, with its time."""

import asyncio
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from typing import Literal

from pydantic import BaseModel

from protocols.lines import CR
from transports import Transport, TransportLost
from transports.trace import escape


class Frame(BaseModel):
    """Bytes that passed the port at one moment, as in a trace."""

    at: str
    """UTC wall time."""
    dir: Literal["tx", "rx"]
    data: str
    r"""Readable ASCII; unprintable bytes as \r or \x00."""


@dataclass(frozen=True, slots=True)
class Heard:
    """A line that came from the far end, its CR included."""

    at: float
    """Seconds, on the loop's clock."""
    data: bytes


class Conversation:
    """Sends frames and hears lines; opened once."""

    def __init__(self, port: Transport) -> None:
        self.port = port
        self.frames: list[Frame] = []
        self.heard: list[Heard] = []
        self._begun = datetime.now(UTC)
        self._begun_at = self.now()
        self._rest = b""
        self._news = asyncio.Event()
        self._lost: TransportLost | None = None

    async def open(self) -> None:
        """Open the port.

        :raises TransportUnavailable: it cannot be opened; nothing was sent.
        """
        await self.port.open(self)

    async def close(self) -> None:
        """Close the port, and keep what came without an end."""
        if self._rest:
            self._note("rx", self._rest)
        await self.port.close()

    def send(self, data: bytes) -> float:
        """Send bytes, and give the time at which they are on the wire as a whole.

        :raises TransportLost: the port has gone.
        """
        self._require()
        self._note("tx", data)
        self.port.write(data)
        return self.now() + len(data) * self.port.byte_time_s

    async def hear(
        self, until: Callable[[list[Heard]], bool], within_s: float, since: int = 0
    ) -> list[Heard]:
        """Listen until enough lines have come after the first `since`, or the time is over.

        :raises TransportLost: the port has gone.
        """
        deadline = self.now() + within_s
        while not until(self.heard[since:]) and (left_s := deadline - self.now()) > 0:
            self._news.clear()
            try:
                async with asyncio.timeout(left_s):
                    await self._news.wait()
            except TimeoutError:
                break
            self._require()
        return self.heard[since:]

    def data_received(self, data: bytes) -> None:
        """Bytes from the port."""
        now = self.now()
        *lines, self._rest = (self._rest + data).split(CR)
        for line in lines:
            whole = line + CR
            self._note("rx", whole)
            self.heard.append(Heard(now, whole))
        self._news.set()

    def connection_lost(self, error: TransportLost) -> None:
        """The port has gone."""
        self._lost = error
        self._news.set()

    def _require(self) -> None:
        if self._lost is not None:
            raise self._lost

    def _note(self, direction: Literal["tx", "rx"], data: bytes) -> None:
        at = self._begun + timedelta(seconds=self.now() - self._begun_at)
        stamp = at.isoformat(timespec="microseconds").replace("+00:00", "Z")
        self.frames.append(Frame(at=stamp, dir=direction, data=escape(data)))

    @staticmethod
    def now() -> float:
        """Seconds on the loop's clock."""
        return asyncio.get_running_loop().time()
