"""The dual-port RAM of a Fics board: its layout, its flags, and how it is polled."""

import asyncio
import contextlib
import errno
import fcntl
import mmap
import os
import re
import stat
import threading
from array import array
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Literal

from transports.addresses import Address
from transports.base import Receiver, Transport, TransportLost, TransportRefused, TransportUnavailable

# The layout, C-HOST manual 1-4. A flag is 1 while its area holds a message that has not been taken.
HOST_MODE = 256  # the host sets it to 0
TO_FICS_FLAG = 257
TO_FICS, ROOM = 258, 254
FROM_FICS_FLAG = 512  # the data after it
FROM_FICS_END = 768
HIGHEST_SIZE = 1 << 24

LAST_MAP = 4
"""A UIO device has at most five maps; map N is mapped at N pages."""
STRIDES = (1, 2, 4, 8)
"""Distances from one byte of the RAM to the next, in bytes of the mapping."""
CELLS: Final[Mapping[int, Literal["B", "H", "I"]]] = {8: "B", 16: "H", 32: "I"}
"""The bits of one access, and how `struct` calls such a number."""

FREE, FULL = 0, 1

# Assumed of the board, whose manual gives no times: Fics takes a message within this.
STUCK_MS = 1000
# Assumed as well: a message without CR is complete by its flag, but a CR has this time to come, in case a
# board sets the flag first: half an answer looks like a whole one.
UNENDED_S = 0.01
# Bytes that are read at once in search of the end of a message: each access to a board takes about 1 us.
SCOOP = 32
# Bytes that may wait for Fics. The gateway writes a frame at a time; this only bounds memory.
MOST_UNSENT = 1 << 20

# After a message either way the next one is near: the RAM is looked at in every turn of the event loop for
# this time, then after pauses that double up to the longest, which costs an idle port about 1 % of a core.
SPIN_S = 0.002
FIRST_PAUSE_S = 0.0005
LONGEST_PAUSE_S = 0.005

_MESSAGE = re.compile(rb"[^\r]*\r\n?")
_UIO = re.compile(r"/dev/uio\d+", re.ASCII)
_REASONS = {
    errno.ENOENT: "there is no such file or device; load the board's driver, or start the simulator",
    errno.EACCES: "permission was denied; let this user read and write the device",
    errno.EAGAIN: "another program is using it; close that program",
    errno.ENODEV: "it cannot be mapped into memory",
    errno.EINVAL: "it has no such map, or less memory than is asked for; check map, offset, stride and size",
}


class DpramPort(Transport):
    """`dpram:///dev/uio0?map=1&offset=0x400`: a UIO device, a PCI resource file or a plain file, locked.

    Writes travel as messages of at most 254 bytes, each with its CR; C-HOST manual 1-4. The options of
    `Place` tell where the RAM lies in the mapping, and by which accesses it is reached.
    """

    def __init__(self, address: Address) -> None:
        super().__init__(address.text)
        if address.host or address.port is not None or address.path in ("", "/"):
            raise ValueError(
                f"address {address.text!r} must name a device after three slashes: dpram:///dev/uio0"
            )
        address.expect_options("map", "offset", "stride", "width", "size", "stuck_ms")
        self._path = address.path
        self._place = Place.read(address)
        self.stuck_s = address.integer("stuck_ms", STUCK_MS, 1, 60_000) / 1000
        self._session: _Session | None = None

    async def open(self, receiver: Receiver) -> None:
        """Map the memory, empty both its sides and begin to poll; an open port is refused.

        A reply that lies there answers another program's question: it is thrown away. A message to Fics that
        lies there is the last program's, and is taken back as `close` does.
        """
        if self._live_session() is not None:
            raise TransportUnavailable(f"{self.address} is open already; nothing was sent.")
        try:
            memory = _Memory(self._path, self._place)
        except (OSError, ValueError) as error:
            reason = _REASONS.get(getattr(error, "errno", None) or 0, str(error))
            raise TransportUnavailable(
                f"{self.address} was not opened: {reason}. Nothing was sent."
            ) from error
        self._session = _Session(self.address, memory, receiver, self.stuck_s)

    def write(self, data: bytes) -> None:
        """Put a message into the RAM now if it is free, else when Fics has taken the one before.

        :raises TransportRefused: a message is longer than 254 bytes with its CR, or too many wait.
        """
        session = self._live_session()
        if session is None:
            raise TransportLost(f"{self.address} is not open; nothing was sent.")
        session.write(data)

    def unsent(self) -> int:
        """Bytes that Fics has not taken, waiting or in the RAM; 0 when the port is not open."""
        session = self._live_session()
        return 0 if session is None else session.unsent()

    async def close(self) -> None:
        """Stop polling, take back a message that Fics has not taken, and let go of the memory.

        Fics is told by its flag alone. If it has begun to read the message, it carries it out all the same,
        and nothing in the RAM tells.
        """
        session, self._session = self._session, None
        if session is not None:
            session.end()

    def _live_session(self) -> "_Session | None":
        return None if self._session is None or self._session.ended else self._session


@dataclass(frozen=True, slots=True)
class Place:
    """Where the RAM lies in the mapping, and by which accesses it is reached."""

    map: int
    """Number of the UIO device's mapping, 0-4."""
    offset: int
    """Offset of the first byte of the RAM in the mapping, in bytes."""
    stride: int
    """Distance from one byte of the RAM to the next, in bytes of the mapping: 1, 2, 4 or 8."""
    width: int
    """Bits of every access, which is aligned: 8, 16 or 32."""
    size: int
    """Bytes to map."""

    @classmethod
    def read(cls, address: Address) -> "Place":
        """Take the options of an address.

        :raises ValueError: one is not possible, or they do not go together.
        """
        stride = address.choice("stride", STRIDES)
        width = address.choice("width", tuple(CELLS))
        offset = address.integer("offset", 0, 0, HIGHEST_SIZE - FROM_FICS_END * stride)
        cell = width // 8
        if stride < cell and offset % cell:
            raise ValueError(
                f"address {address.text!r}: with a width of {width} and a stride of {stride}, offset must be "
                f"a multiple of {cell}, not {offset}"
            )
        needed = -(-(offset + FROM_FICS_END * stride) // cell) * cell
        return cls(
            address.integer("map", 0, 0, LAST_MAP),
            offset,
            stride,
            width,
            address.integer("size", needed, needed, HIGHEST_SIZE),
        )

    @property
    def start(self) -> int:
        """Where the mapping begins in the device, or in a file that stands for one."""
        return self.map * mmap.PAGESIZE


class _Memory:
    """The mapped RAM, reached by aligned accesses of one width: a board may bear no others.

    A processor may fault on an unaligned access to a device (ARM64), so nothing is copied in one piece. An
    access to a mapping that has gone kills the process with SIGBUS: before each copy it is made sure that the
    name still leads to the same device or file. The lock that each copy takes and releases keeps the copies
    in order on any processor.
    """

    def __init__(self, path: str, place: Place) -> None:
        self._path = path
        self._place = place
        self._kind = CELLS[place.width]
        self._cell = place.width // 8
        self._step = max(1, place.stride // self._cell)
        """Cells from one that holds bytes of the RAM to the next."""
        self._spacing = min(place.stride, self._cell)
        """Bytes from one byte of the RAM to the next, within such cells laid side by side."""
        self._in_order = threading.Lock()
        if Path(path).is_char_device() and not _UIO.fullmatch(os.path.realpath(path)):
            # To open one may be a command already, as to a watchdog; this may be memory of the machine.
            raise OSError("it is another device than a UIO device such as /dev/uio0")
        with contextlib.ExitStack() as stack:  # whatever fails, nothing stays open
            # Nothing here waits: neither the file, nor the device, nor the lock.
            fd = os.open(path, os.O_RDWR | os.O_NONBLOCK | os.O_NOCTTY | os.O_CLOEXEC)
            stack.callback(os.close, fd)
            self._identity = _identity(os.fstat(fd), place)
            fcntl.flock(fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
            mapping = stack.enter_context(mmap.mmap(fd, place.size, offset=place.start))
            view = stack.enter_context(memoryview(mapping))
            whole = stack.enter_context(view[: place.size // self._cell * self._cell])
            self._cells = stack.enter_context(whole.cast(self._kind))
            self.take_back()  # before anything that may make Fics look
            self.store(HOST_MODE, bytes([0]))
            if self.load(FROM_FICS_FLAG, 1)[0] != FREE:  # else Fics may be writing the bytes beside it
                self.store(FROM_FICS_FLAG, bytes([FREE]))
            self._resources = stack.pop_all()

    def load(self, start: int, count: int) -> bytes:
        """Copy bytes out of the RAM.

        :raises OSError: it is not there any more.
        """
        where, lane = self._find(start, count)
        self._check_presence()
        with self._in_order:
            found = self._read(where)
        return found[lane :: self._spacing][:count]

    def store(self, start: int, data: bytes) -> None:
        """Copy bytes into the RAM; others that share an access with them are written again as they are.

        :raises OSError: it is not there any more.
        """
        where, lane = self._find(start, len(data))
        image = bytearray(len(where) * self._cell)
        self._check_presence()
        with self._in_order:
            if self._spacing < self._cell:
                image[: self._cell] = self._read(where[:1])
                image[-self._cell :] = self._read(where[-1:])
            image[lane : lane + len(data) * self._spacing : self._spacing] = data
            for cell, value in zip(where, memoryview(image).cast(self._kind), strict=True):
                self._cells[cell] = value

    def take_back(self) -> None:
        """Tell Fics that no message lies there.

        The data stays as it is: a Fics that has begun to read must not find half a command.

        :raises OSError: it is not there any more.
        """
        self.store(TO_FICS_FLAG, bytes([FREE]))

    def close(self) -> None:
        """Unmap and unlock."""
        self._resources.close()

    def _find(self, start: int, count: int) -> tuple[range, int]:
        """The cells that hold bytes of the RAM, and the place of the first byte in the first of them."""
        first, lane = divmod(self._place.offset + start * self._place.stride, self._cell)
        last = (self._place.offset + (start + count - 1) * self._place.stride) // self._cell
        return range(first, last + 1, self._step), lane

    def _read(self, where: range) -> bytes:
        return array(self._kind, map(self._cells.__getitem__, where)).tobytes()

    def _check_presence(self) -> None:
        """Make sure that the name still leads here.

        :raises OSError: it leads nowhere, or to something else, or the file has shrunk.
        """
        if _identity(os.stat(self._path), self._place) != self._identity:  # noqa: PTH116  # a tenth of the cost
            raise OSError("another file or device has taken its name")


def _identity(found: os.stat_result, place: Place) -> tuple[int, int]:
    """Identity of the file or device.

    :raises OSError: it cannot hold the RAM.
    """
    if stat.S_ISREG(found.st_mode):
        if found.st_size < place.start + place.size:
            raise OSError(f"it holds {found.st_size} bytes and should hold {place.start + place.size}")
    elif not stat.S_ISCHR(found.st_mode):
        raise OSError("it is neither a file nor a device")
    return found.st_dev, found.st_ino


class _Patience:
    """The time for which something has been in the way, and its limit."""

    def __init__(self, limit_s: float) -> None:
        self._limit_s = limit_s
        self._since: float | None = None

    def age_s(self, now: float) -> float:
        """Seconds it has lasted by now; the first question starts it."""
        if self._since is None:
            self._since = now
        return now - self._since

    def bear(self, now: float, reason: str) -> None:
        """Go on, unless it has lasted too long.

        :raises OSError: it has.
        """
        if self.age_s(now) >= self._limit_s:
            raise OSError(f"{reason} for {self._limit_s:g} s")

    def renew(self) -> None:
        """Note that nothing is in the way any more."""
        self._since = None


class _Session:
    """One opening of the RAM, from open to lost or closed."""

    def __init__(self, address: str, memory: _Memory, receiver: Receiver, stuck_s: float) -> None:
        self.ended = False
        self._address = address
        self._memory = memory
        self._receiver = receiver
        self._unfinished = b""
        self._waiting: deque[bytes] = deque()
        self._in_ram = 0
        self._sending = _Patience(stuck_s)
        self._taking = _Patience(stuck_s)
        self._loop = asyncio.get_running_loop()
        self._busy_until = self._loop.time()
        self._pause_s = FIRST_PAUSE_S
        self._timer: asyncio.Handle = self._loop.call_soon(self._turn)

    def write(self, data: bytes) -> None:
        """Send messages, or keep them for the next turns.

        :raises TransportRefused: nothing of this was or will be written.
        """
        text = self._unfinished + data
        messages = _MESSAGE.findall(text)
        unfinished = text[sum(map(len, messages)) :]
        longest = max(map(len, [*messages, unfinished + b"\r"]))
        if longest > ROOM:
            raise TransportRefused(
                f"{self._address} carries messages of at most {ROOM} bytes, and this one has {longest}; "
                "nothing of it was sent. Send less at once."
            )
        if self.unsent() + len(data) > MOST_UNSENT:
            raise TransportRefused(
                f"{self._address} has {self.unsent()} bytes waiting for Fics; nothing more was sent. "
                "Wait until they have been taken."
            )
        self._unfinished = unfinished
        self._waiting.extend(messages)
        now = self._loop.time()
        self._timer.cancel()
        try:
            self._send(now)
        except OSError as error:
            self.end()
            self._timer = self._loop.call_soon(self._tell_loss, error)  # never within the caller's call
            return
        self._stay_awake(now)
        self._timer = self._loop.call_soon(self._turn)

    def unsent(self) -> int:
        """Bytes that Fics has not taken, as of this moment."""
        waiting = sum(map(len, self._waiting)) + len(self._unfinished)
        if self._in_ram:
            with contextlib.suppress(OSError):
                waiting += self._in_ram if self._flag(TO_FICS_FLAG) != FREE else 0
        return waiting

    def end(self) -> None:
        """Take back what Fics has not taken, let go of the RAM, and tell the receiver nothing more."""
        self._timer.cancel()
        if self.ended:
            return
        self.ended = True
        if self._in_ram:
            with contextlib.suppress(OSError):
                self._memory.take_back()
        self._memory.close()

    def _turn(self) -> None:
        now = self._loop.time()
        try:
            sent = self._send(now)
            message = self._take(now)
        except OSError as error:
            self.end()
            self._tell_loss(error)
            return
        if sent or message:
            self._stay_awake(now)
        if now < self._busy_until:
            self._timer = self._loop.call_soon(self._turn)
        else:
            self._timer = self._loop.call_later(self._pause_s, self._turn)
            self._pause_s = min(2 * self._pause_s, LONGEST_PAUSE_S)
        if message:
            self._receiver.data_received(message)

    def _send(self, now: float) -> bool:
        """Write a message if Fics has taken the one before: the data first, its flag last."""
        if not self._waiting and not self._in_ram:
            return False
        if self._flag(TO_FICS_FLAG) != FREE:
            self._sending.bear(now, f"Fics has taken no message: the flag at {TO_FICS_FLAG} was not 0")
            return False
        self._in_ram = 0
        self._sending.renew()
        if not self._waiting:
            return False
        message = self._waiting[0]
        # The host mode goes with every message: a Fics that was switched on since may have changed it.
        self._memory.store(HOST_MODE, bytes([0, FREE]) + message.ljust(ROOM, b"\0"))
        if self._memory.load(TO_FICS, len(message)) != message:
            raise OSError("it does not keep what is written into it")
        self._memory.store(TO_FICS_FLAG, bytes([FULL]))
        self._in_ram = len(self._waiting.popleft())
        return True

    def _take(self, now: float) -> bytes:
        """Read a message if a whole one is there: two equal looks at flag and data, then the flag cleared."""
        if self._flag(FROM_FICS_FLAG) == FREE:
            self._taking.renew()
            return b""
        seen = self._scoop()
        message = _MESSAGE.match(seen, 1)
        steady = seen[0] == FULL and seen == self._memory.load(FROM_FICS_FLAG, len(seen))
        if not steady or (message is None and self._taking.age_s(now) < UNENDED_S):
            self._taking.bear(now, f"the flag at {FROM_FICS_FLAG} or the data after it was not steady")
            return b""
        self._taking.renew()
        self._memory.store(FROM_FICS_FLAG, bytes([FREE]))
        if message is not None:
            return message[0]  # what lies behind its end is padding, or left from longer messages
        text = seen[1:].partition(b"\0")[0]
        return text and text + b"\r"

    def _scoop(self) -> bytes:
        """The flag of Fics and the data after it, a little further than to the end of the message."""
        seen = b""
        while (left := FROM_FICS_END - FROM_FICS_FLAG - len(seen)) and b"\r" not in seen[1:]:
            seen += self._memory.load(FROM_FICS_FLAG + len(seen), min(SCOOP, left))
        return seen

    def _flag(self, where: int) -> int:
        return self._memory.load(where, 1)[0]

    def _stay_awake(self, now: float) -> None:
        self._busy_until = now + SPIN_S
        self._pause_s = FIRST_PAUSE_S

    def _tell_loss(self, error: OSError) -> None:
        self._receiver.connection_lost(
            TransportLost(
                f"{self._address} was lost ({error}). What was sent last may not have arrived; check the "
                "controller's power and its driver."
            )
        )
