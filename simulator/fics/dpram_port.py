"""The Fics side of a dual-port RAM in a file, for a simulated machine."""

import asyncio
import mmap
import os
import re
from collections import deque
from dataclasses import dataclass, replace
from pathlib import Path

from simulator.ports import MOST_UNREAD, Clockwork, Machine, Port

SIZE = 1024
HOST_FLAG, FROM_HOST = 257, slice(258, 512)
FICS_FLAG, TO_HOST = 512, slice(513, 768)
FREE, FULL = 0, 1
"""The layout, C-HOST manual 1-4. A flag is 1 while its area holds a message that has not been taken."""

SPIN_S = 0.002
"""Seconds after a message during which every turn of the event loop looks at the RAM."""

PAUSE_S = 0.002
"""Seconds between two looks at other times."""

_MESSAGES = re.compile(rb"[^\r]*\r\n?|[^\r]+")


@dataclass(frozen=True, slots=True)
class Tears:
    """Messages whose flag is set before they are whole: the second half follows after the delay."""

    next_messages: int = 0
    delay_s: float = 0.002


class SimulatedDpram(Port):
    """A dual-port RAM; programs come and go at its host side, it stays until `aclose`."""

    def __init__(self, clockwork: Clockwork, path: Path, ram: mmap.mmap) -> None:
        super().__init__(f"dpram://{path}", clockwork)
        self.stalled = False
        """While set, Fics neither takes a message nor gives one, and the flags stay as they are."""
        self.tears = Tears()
        """The messages to the host that are to be torn, and their delay."""
        self.ends_with_cr = True
        """True if a message carries its CR, or is ended by its flag alone; an assumption."""
        self.takes_after_s = 0.0
        """Seconds for which a message of the host lies there before it is taken; an assumption."""
        self._full_since: float | None = None
        self._path = path
        self._inode = path.stat().st_ino
        self._ram = ram
        self._waiting: deque[bytes] = deque()
        self._mending: asyncio.Handle | None = None
        """The rest of a torn message is still to be written."""
        self._loop = asyncio.get_running_loop()
        self._busy_until = self._loop.time()
        clockwork.host = self
        self._timer: asyncio.Handle = self._loop.call_soon(self._turn)

    def write(self, data: bytes) -> None:
        """Put messages into the RAM as the host takes them; what is too much for it is lost."""
        if sum(map(len, self._waiting)) < MOST_UNREAD:
            self._waiting.extend(_MESSAGES.findall(data))
        self._give()

    @property
    def flags(self) -> tuple[int, int]:
        """The host's flag and that of Fics."""
        return self._ram[HOST_FLAG], self._ram[FICS_FLAG]

    async def aclose(self) -> None:
        """Stop, and remove the file."""
        self._clockwork.stop()
        self._timer.cancel()
        if self._mending is not None:
            self._mending.cancel()
        self._ram.close()
        if self._path.exists() and self._path.stat().st_ino == self._inode:
            self._path.unlink()

    def _turn(self) -> None:
        # Planned first: a message may make the machine fail, and that must not end the polling.
        if self._loop.time() < self._busy_until:
            self._timer = self._loop.call_soon(self._turn)
        else:
            self._timer = self._loop.call_later(PAUSE_S, self._turn)
        self._give()
        self._take()

    def _give(self) -> None:
        """Write a message if the host has taken the one before: the data first, its flag last."""
        if self._waiting and self._ram[FICS_FLAG] == FREE and not self.stalled and self._mending is None:
            message = self._waiting.popleft()
            if self.tears.next_messages:
                self.tears = replace(self.tears, next_messages=self.tears.next_messages - 1)
                self._fill(message[: len(message) // 2])
                self._mending = self._loop.call_later(self.tears.delay_s, self._mend, message)
            else:
                self._fill(message)
            self._ram[FICS_FLAG] = FULL
            self._stay_awake()

    def _mend(self, message: bytes) -> None:
        self._fill(message)
        self._mending = None

    def _fill(self, message: bytes) -> None:
        room = TO_HOST.stop - TO_HOST.start
        message = message if self.ends_with_cr else message.rstrip(b"\r\n")
        self._ram[TO_HOST] = message[:room].ljust(room, b"\0")

    def _take(self) -> None:
        """Read a message, free the area, and let the machine hear it."""
        if self._ram[HOST_FLAG] == FULL and not self.stalled and self._has_lain():
            area = self._ram[FROM_HOST].rstrip(b"\0")
            self._ram[HOST_FLAG] = FREE
            self._stay_awake()
            for message in _MESSAGES.findall(area)[:1]:
                self._clockwork.feed(message)

    def _has_lain(self) -> bool:
        """Tell whether a message has lain there as long as they do."""
        now = self._loop.time()
        since = self._full_since = now if self._full_since is None else self._full_since
        if now - since < self.takes_after_s:
            return False
        self._full_since = None
        return True

    def _stay_awake(self) -> None:
        self._busy_until = self._loop.time() + SPIN_S
        self._timer.cancel()
        self._timer = self._loop.call_soon(self._turn)


def serve_dpram(machine: Machine, path: Path) -> SimulatedDpram:
    """Put a machine behind a new dual-port RAM in a file at `path`, both sides empty.

    A file of an earlier run is replaced, so that a program at its host side sees that the RAM has gone.

    :raises FileExistsError: something else than such a file is there.
    :raises OSError: the file cannot be made.
    """
    if path.exists() and not (path.is_file() and path.stat().st_size == SIZE):
        raise FileExistsError(
            f"{path} exists and is no dual-port RAM; nothing was changed. Choose another path"
        )
    fresh = path.with_name(f".{path.name}.{os.getpid()}")
    fresh.write_bytes(bytes(SIZE))
    with fresh.open("r+b") as file:
        ram = mmap.mmap(file.fileno(), SIZE)
    fresh.replace(path)
    return SimulatedDpram(Clockwork(machine), path, ram)
