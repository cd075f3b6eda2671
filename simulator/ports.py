"""Where a simulated machine can be reached: behind a pseudo-terminal or a TCP listener, paced or not."""

import asyncio
import contextlib
import os
import tty
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable
from math import inf
from pathlib import Path
from time import monotonic
from typing import Protocol, TypeVar, cast

from simulator.wire import up_to_each_cr

T = TypeVar("T")

BITS_PER_BYTE = 10
"""Start bit, eight data bits, no parity, one stop bit."""

MOST_UNREAD = 65_536
"""Bytes for a TCP client that does not read; more are lost, as on a serial line without a reader."""

WATCH_S = 0.0025
"""This time before a byte is due the event loop stops sleeping: its timers are up to 2 ms late."""

LINGER_S = 0.001
"""Seconds after a frame during which the event loop stays awake, to notice the next one in time."""


class Machine(Protocol):
    """A simulated machine: bytes and the time in, bytes out, and nothing happens but in a call."""

    def receive(self, data: bytes, now: float) -> None:
        """Take bytes from the host."""

    def take_output(self, now: float) -> bytes:
        """Give the bytes that have left for the host by now."""

    def wake_at(self) -> float | None:
        """The next moment at which something happens without a request."""


class Host(Protocol):
    """The receiver of what the machine says."""

    def write(self, data: bytes, /) -> None:
        """Take bytes at once, or lose them."""


class Clockwork:
    """Runs a machine on the monotonic clock; bytes are there as soon as they are sent."""

    def __init__(self, machine: Machine) -> None:
        self.host: Host | None = None
        """The receiver of its bytes; without one they are lost."""
        self._machine = machine
        self._loop = asyncio.get_running_loop()
        self._timer: asyncio.Handle | None = None
        self._timer_at: float | None = None

    def feed(self, data: bytes) -> None:
        """Take bytes from the host."""
        now = monotonic()
        self._machine.receive(data, now)
        self._run(now)

    def touch(self, deed: Callable[[float], T]) -> T:
        """Do something to the machine now, other than through its line, and what follows from it."""
        now = monotonic()
        result = deed(now)
        self._run(now)
        return result

    def stop(self) -> None:
        """Let the machine stand still."""
        self._cancel()

    def _turn(self) -> None:
        self._timer_at = None
        self._run(monotonic())

    def _run(self, now: float) -> None:
        output = self._machine.take_output(now)
        if output:
            self._tell(output)
        wake_at = self._machine.wake_at()
        if wake_at != self._timer_at:
            self._cancel()
            self._timer_at = wake_at
            if wake_at is not None:
                self._timer = self._loop.call_later(max(wake_at - now, 0.0), self._turn)

    def _tell(self, output: bytes) -> None:
        if self.host is not None:
            self.host.write(output)

    def _cancel(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None


class _Wire:
    """One direction of a serial line: bytes follow each other at its speed, a frame is seen at its end."""

    def __init__(self, byte_time_s: float) -> None:
        self._byte_time_s = byte_time_s
        self._free_at = -inf
        self._under_way: deque[tuple[float, bytes]] = deque()

    def put(self, data: bytes, now: float) -> None:
        """Start sending, behind what is still being sent."""
        frames, rest = up_to_each_cr(data)
        for part in filter(None, (*frames, rest)):
            self._free_at = max(self._free_at, now) + len(part) * self._byte_time_s
            self._under_way.append((self._free_at, part))

    def next_at(self) -> float:
        """When the next part has arrived."""
        return self._under_way[0][0] if self._under_way else inf

    def take(self) -> bytes:
        """Take the part that has arrived."""
        return self._under_way.popleft()[1]


class PacedClockwork(Clockwork):
    """Runs a machine behind a line with a speed.

    A request is there when its last byte would have arrived, and so is a reply. The machine sees each at its
    due moment, however late this process wakes, so that delays do not add up.
    """

    def __init__(self, machine: Machine, baud: int) -> None:
        super().__init__(machine)
        self._requests = _Wire(BITS_PER_BYTE / baud)
        self._replies = _Wire(BITS_PER_BYTE / baud)
        self._awake_until = -inf

    def feed(self, data: bytes) -> None:
        """Take bytes from the host as it starts to send them."""
        now = monotonic()
        self._requests.put(data, now)
        self._run(now)

    def _run(self, now: float) -> None:
        self._run_machine(now)
        while self._replies.next_at() <= now:
            self._tell(self._replies.take())
            self._awake_until = now + LINGER_S
        self._cancel()
        due_at = min(self._requests.next_at(), self._replies.next_at(), self._machine_at())
        if now < self._awake_until or due_at - now < WATCH_S:
            self._timer = self._loop.call_soon(self._poll)
        elif due_at < inf:
            self._timer = self._loop.call_later(due_at - now - WATCH_S, self._turn)

    def _poll(self) -> None:
        """Look again, but let others that wait for this processor go first: they may bring the next frame."""
        os.sched_yield()
        self._turn()

    def _run_machine(self, now: float) -> None:
        """Let the machine live through the moments up to now, one after the other."""
        while (at := min(self._requests.next_at(), self._machine_at())) <= now:
            if self._requests.next_at() <= at:
                self._machine.receive(self._requests.take(), at)
            self._replies.put(self._machine.take_output(at), at)
        self._replies.put(self._machine.take_output(now), now)

    def _machine_at(self) -> float:
        at = self._machine.wake_at()
        return inf if at is None else at


class Port(ABC):
    """A machine that can be reached; `address` says where."""

    def __init__(self, address: str, clockwork: Clockwork) -> None:
        self.address = address
        self._clockwork = clockwork

    def touch(self, deed: Callable[[float], T]) -> T:
        """Do something to the machine now, other than through its line, and what follows from it."""
        return self._clockwork.touch(deed)

    @abstractmethod
    async def aclose(self) -> None:
        """End it; the machine stands still."""


def _clockwork(machine: Machine, baud: int | None) -> Clockwork:
    return Clockwork(machine) if baud is None else PacedClockwork(machine, baud)


class PtyPort(Port):
    """A pseudo-terminal with a symbolic link to it; programs come and go, it stays."""

    def __init__(self, clockwork: Clockwork, link: Path, master: int, device: int) -> None:
        super().__init__(str(link), clockwork)
        self._link = link
        self._master = master
        # Kept open: a master without any program at its device would report an error for ever.
        self._device = device
        clockwork.host = self
        self._loop = asyncio.get_running_loop()
        self._loop.add_reader(master, self._readable)

    def _readable(self) -> None:
        with contextlib.suppress(BlockingIOError):
            self._clockwork.feed(os.read(self._master, 4096))

    def write(self, data: bytes) -> None:
        """Put bytes into the terminal; what it cannot hold is lost."""
        with contextlib.suppress(BlockingIOError):
            os.write(self._master, data)

    async def aclose(self) -> None:
        """Remove the link and close the terminal."""
        self._clockwork.stop()
        self._loop.remove_reader(self._master)
        if self._link.is_symlink() and self._link.readlink() == Path(os.ttyname(self._device)):
            self._link.unlink()
        os.close(self._master)
        os.close(self._device)


def serve_pty(machine: Machine, path: Path, baud: int | None = None) -> PtyPort:
    """Put a machine behind a new pseudo-terminal and a symbolic link to it at `path`.

    :raises FileExistsError: something is there, other than a link that leads nowhere any more.
    :raises OSError: the link cannot be made.
    """
    if path.exists():
        what = f"leads to {path.resolve()}, which is in use" if path.is_symlink() else "is no symbolic link"
        raise FileExistsError(
            f"{path} exists and {what}; nothing was changed. Remove it, or choose another path"
        )
    master, device = os.openpty()
    try:
        tty.setraw(device)
        os.set_blocking(master, False)
        _replace_link(path, Path(os.ttyname(device)))
    except OSError:
        os.close(master)
        os.close(device)
        raise
    return PtyPort(_clockwork(machine, baud), path, master, device)


def _replace_link(path: Path, target: Path) -> None:
    """Replace a link in one step, so that the path is never missing."""
    fresh = path.with_name(f".{path.name}.{os.getpid()}")
    fresh.symlink_to(target)
    fresh.replace(path)


class _Client(asyncio.Protocol):
    """One connection to a listener."""

    def __init__(self, clockwork: Clockwork) -> None:
        self._clockwork = clockwork
        self._transport: asyncio.Transport | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Take the machine, unless another client has it."""
        if self._clockwork.host is not None:
            transport.close()
            return
        self._transport = cast("asyncio.Transport", transport)
        self._clockwork.host = self

    def data_received(self, data: bytes) -> None:
        """Pass on what the host sends."""
        if self._transport is not None:
            self._clockwork.feed(data)

    def connection_lost(self, _error: Exception | None) -> None:
        """Leave the machine to the next client."""
        if self._transport is not None:
            self._clockwork.host = None

    def write(self, data: bytes) -> None:
        """Send bytes to the client; what it does not read is lost."""
        if self._transport is not None and self._transport.get_write_buffer_size() < MOST_UNREAD:
            self._transport.write(data)

    def drop(self) -> None:
        """Send the client away."""
        if self._transport is not None:
            self._transport.abort()


class TcpPort(Port):
    """A TCP listener with one client at a time, as a serial line has one host; others are turned away."""

    def __init__(self, clockwork: Clockwork, server: asyncio.Server) -> None:
        host, port = server.sockets[0].getsockname()[:2]
        super().__init__(f"tcp://{f'[{host}]' if ':' in host else host}:{port}", clockwork)
        self._server = server

    async def aclose(self) -> None:
        """Close the listener and the client."""
        self._clockwork.stop()
        self._server.close()
        if isinstance(self._clockwork.host, _Client):
            self._clockwork.host.drop()
        await self._server.wait_closed()


async def serve_tcp(machine: Machine, host: str, port: int, baud: int | None = None) -> TcpPort:
    """Put a machine behind a TCP listener; port 0 takes any free one.

    :raises OSError: the address cannot be listened at.
    """
    clockwork = _clockwork(machine, baud)
    server = await asyncio.get_running_loop().create_server(lambda: _Client(clockwork), host, port)
    return TcpPort(clockwork, server)
