"""The dual-port RAM of a Fics board: its layout, its flags, and how it is polled."""

import asyncio
import contextlib
import errno
import fcntl
import logging
import mmap
import os
import re
import stat
from collections import deque

from transports.addresses import Address
from transports.base import Receiver, Transport, TransportLost, TransportRefused, TransportUnavailable

# The layout, C-HOST manual 1-4. A flag is 1 while its area holds a message that has not been taken.
HOST_MODE = 256  # the host sets it to 0
TO_FICS_FLAG = 257
TO_FICS = slice(258, 512)
FROM_FICS_FLAG = 512
FROM_FICS = slice(512, 768)  # with its flag before it
LOWEST_SIZE = 768
HIGHEST_SIZE = 1 << 24

FREE, FULL = 0, 1
ROOM = TO_FICS.stop - TO_FICS.start

# Assumed of the board, whose manual gives no times: Fics takes a message within this.
STUCK_MS = 1000
# Assumed as well: a message without its CR is still being written, and complete after so long.
UNENDED_S = 0.01
# Bytes that may wait for Fics. The gateway writes a frame at a time; this only bounds memory.
MOST_UNSENT = 1 << 20

# After a message either way the next one is near: the RAM is looked at in every turn of the event loop for
# so long, then after pauses that double up to the longest, which costs an idle port under 1 % of a core.
SPIN_S = 0.002
FIRST_PAUSE_S = 0.0005
LONGEST_PAUSE_S = 0.005
# How often it is made sure that the name still leads to the memory that was opened.
PRESENCE_S = 0.1

_MESSAGE = re.compile(rb"[^\r]*\r\n?")
_REASONS = {
    errno.ENOENT: "there is no such file or device; load the board's driver, or start the simulator",
    errno.EACCES: "permission was denied; let this user read and write the device",
    errno.EAGAIN: "another program is using it; close that program",
    errno.ENODEV: "it cannot be mapped into memory",
}

log = logging.getLogger(__name__)


class DpramPort(Transport):
    """`dpram:///dev/uio0?size=1024&stuck_ms=1000`: a UIO device, a PCI resource file or a plain file, locked.

    What is written travels as messages of at most 254 bytes, each with its CR; C-HOST manual 1-4.
    """

    def __init__(self, address: Address) -> None:
        super().__init__(address.text)
        if address.host or address.port is not None or address.path in ("", "/"):
            raise ValueError(
                f"address {address.text!r} must name a device after three slashes: dpram:///dev/uio0"
            )
        address.expect_options("size", "stuck_ms")
        self._path = address.path
        self._size = address.integer("size", LOWEST_SIZE, LOWEST_SIZE, HIGHEST_SIZE)
        self._stuck_s = address.integer("stuck_ms", STUCK_MS, 1, 60_000) / 1000
        self._session: _Session | None = None

    @property
    def stuck_s(self) -> float:
        """`stuck_ms` of the address."""
        return self._stuck_s

    async def open(self, receiver: Receiver) -> None:
        """Map the memory, empty both its sides and begin to poll; an open port is refused.

        A reply that lies there is an answer to somebody else's question: it is thrown away. A message to Fics
        that lies there is the last program's, and is taken back as `close` does.
        """
        if self._live_session() is not None:
            raise TransportUnavailable(f"{self.address} is open already; nothing was sent.")
        try:
            memory = _Memory(self._path, self._size)
        except (OSError, ValueError) as error:
            reason = _REASONS.get(getattr(error, "errno", None) or 0, str(error))
            raise TransportUnavailable(
                f"{self.address} was not opened: {reason}. Nothing was sent."
            ) from error
        self._session = _Session(self.address, memory, receiver, self._stuck_s)

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


class _Memory:
    """The mapped RAM. The operating system does the copying, through a pipe.

    When a file is cut short or a driver goes, touching its mapping kills the process with SIGBUS. A system
    call that copies from there or to there fails with EFAULT instead, at half a microsecond more. The pipe's
    lock, which every copy takes and releases, keeps the copies in order on any processor.
    """

    def __init__(self, path: str, size: int) -> None:
        self._path = path
        self._size = size
        with contextlib.ExitStack() as stack:  # whatever fails, nothing stays open
            # Nothing here waits: neither the file, nor the device, nor the lock.
            fd = os.open(path, os.O_RDWR | os.O_NONBLOCK | os.O_NOCTTY | os.O_CLOEXEC)
            stack.callback(os.close, fd)
            self._identity = _identity(os.fstat(fd), size)
            fcntl.flock(fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
            self._view = stack.enter_context(memoryview(stack.enter_context(mmap.mmap(fd, size))))
            self._pipe_out, self._pipe_in = os.pipe()
            stack.callback(os.close, self._pipe_out)
            stack.callback(os.close, self._pipe_in)
            self.take_back()  # before anything that may make Fics look
            self.store(HOST_MODE, bytes([0]))
            self.store(FROM_FICS_FLAG, bytes([FREE]))
            self._resources = stack.pop_all()

    def load(self, where: slice) -> bytes:
        """Copy bytes out of the RAM.

        :raises OSError: it is not there any more.
        """
        return os.read(self._pipe_out, os.write(self._pipe_in, self._view[where]))

    def store(self, start: int, data: bytes) -> None:
        """Copy bytes into the RAM.

        :raises OSError: it is not there any more.
        """
        os.write(self._pipe_in, data)
        try:
            os.readv(self._pipe_out, [self._view[start : start + len(data)]])
        except OSError:
            os.read(self._pipe_out, len(data))  # or the next copy would begin with it
            raise

    def take_back(self) -> None:
        """Tell Fics that no message lies there.

        The data stays as it is: a Fics that has begun to read must not find half a command.

        :raises OSError: it is not there any more.
        """
        self.store(TO_FICS_FLAG, bytes([FREE]))

    def check_presence(self) -> None:
        """Make sure that the name still leads here.

        :raises OSError: it leads nowhere, or to something else, or the file has shrunk.
        """
        if _identity(os.stat(self._path), self._size) != self._identity:  # noqa: PTH116  # a tenth of the cost
            raise OSError("another file or device has taken its name")

    def close(self) -> None:
        """Unmap and unlock."""
        self._resources.close()


def _identity(found: os.stat_result, size: int) -> tuple[int, int]:
    """Which file or device it is.

    :raises OSError: it cannot hold the RAM.
    """
    if stat.S_ISREG(found.st_mode):
        if found.st_size < size:
            raise OSError(f"it holds {found.st_size} bytes and should hold {size}")
    elif not stat.S_ISCHR(found.st_mode):
        raise OSError("it is neither a file nor a device")
    return found.st_dev, found.st_ino


class _Patience:
    """How long something has been in the way, and whether that is too long."""

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
        """It is over."""
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
        self._busy_until = self._look_at = self._loop.time()
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
            self._look_for_it(now)
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
        data = self._waiting[0].ljust(ROOM, b"\0")
        self._memory.store(TO_FICS.start, data)
        if self._memory.load(TO_FICS) != data:
            raise OSError("it does not keep what is written into it")
        self._memory.store(TO_FICS_FLAG, bytes([FULL]))
        self._in_ram = len(self._waiting.popleft())
        return True

    def _take(self, now: float) -> bytes:
        """Read a message if a whole one is there: two equal looks at flag and data, then the flag cleared."""
        if self._flag(FROM_FICS_FLAG) == FREE:
            self._taking.renew()
            return b""
        seen = self._memory.load(FROM_FICS)
        message = _MESSAGE.match(seen, 1)
        steady = seen[0] == FULL and seen == self._memory.load(FROM_FICS)
        if not steady or (message is None and self._taking.age_s(now) < UNENDED_S):
            self._taking.bear(now, f"the flag at {FROM_FICS_FLAG} or the data after it was not steady")
            return b""
        self._taking.renew()
        self._memory.store(FROM_FICS_FLAG, bytes([FREE]))
        if message is None:
            log.warning("%s: a message without a CR has come; it is passed on as it is.", self._address)
            return seen[1:].rstrip(b"\0")
        return message[0]  # what lies behind the CR is padding, or left from longer messages

    def _look_for_it(self, now: float) -> None:
        if now >= self._look_at:
            self._memory.check_presence()
            self._look_at = now + PRESENCE_S

    def _flag(self, where: int) -> int:
        return self._memory.load(slice(where, where + 1))[0]

    def _stay_awake(self, now: float) -> None:
        self._busy_until = now + SPIN_S
        self._pause_s = FIRST_PAUSE_S

    def _tell_loss(self, error: OSError) -> None:
        reason = "its memory has gone" if error.errno == errno.EFAULT else str(error)
        self._receiver.connection_lost(
            TransportLost(
                f"{self._address} was lost ({reason}). What was sent last may not have arrived; check the "
                "controller's power and its driver."
            )
        )
