"""Hosts that talk to a simulated line in bytes: one at a real port, one whose clock is turned by hand."""

import asyncio
import os
import tty
from abc import ABC, abstractmethod
from collections.abc import AsyncIterator, Callable, Iterable
from contextlib import asynccontextmanager
from pathlib import Path
from time import monotonic

from simulator.ports import Port, serve_pty, serve_tcp
from simulator.rorze.line import Rc400Line, build_line

BODY = 0x3F
PATIENCE_S = 60.0
FAR_S = 1e6


class Host(ABC):
    """Sends frames and hears frames, both without their CR, on a line that it can also lay hands on."""

    def __init__(self, line: Rc400Line) -> None:
        self.line = line
        self._unread = b""

    @abstractmethod
    def send(self, frame: str) -> None:
        """Send a frame; the CR is added."""

    @abstractmethod
    async def receive(self) -> bytes:
        """Wait for bytes, and take all there are."""

    @abstractmethod
    def touch(self, deed: Callable[[float], None]) -> None:
        """Do something to the machine now."""

    async def hear(self) -> str:
        """Wait for the next frame."""
        while b"\r" not in self._unread:
            self._unread += await self.receive()
        frame, _, self._unread = self._unread.partition(b"\r")
        return frame.decode()

    def change(self, body: int = BODY, **world: object) -> None:
        """Change the world round an axis: the attributes of its `World`."""
        axis = self.line.axes[body]

        def act(now: float) -> None:
            axis.advance(now)
            for name, value in world.items():
                assert hasattr(axis.world, name)
                setattr(axis.world, name, value)
            axis.sense(now)
            self.line.look_after(body)

        self.touch(act)

    async def ask(self, frame: str) -> str:
        """Send a frame and wait for the next one."""
        self.send(frame)
        return await self.hear()

    async def command(self, *texts: str, body: int = BODY) -> None:
        """Send commands to a body; each must be accepted with the bare echo of its code."""
        for text in texts:
            assert await self.ask(f"&{body:02X}{text}") == f">&{body:02X}{text[:3]}", text

    async def play(self, dialogue: str) -> None:
        """Go through a dialogue as the manual prints it: lines with > are what must be heard next."""
        for line in dialogue.split("\n"):
            frame = line.strip()
            if frame.startswith(">"):
                heard = await self.hear()
                assert heard == frame, f"expected {frame}, heard {heard}"
            elif frame:
                self.send(frame)


class ClockHost(Host):
    """A host in given time: waiting takes none."""

    def __init__(self, *bodies: int) -> None:
        super().__init__(build_line(bodies or (BODY,), 0.0))
        self.now = 0.0
        self._heard = b""

    def send(self, frame: str) -> None:
        self._listen()
        self.line.receive(frame.encode() + b"\r", self.now)
        self._listen()

    async def receive(self) -> bytes:
        while not self._heard:
            wake_at = self.line.wake_at()
            assert wake_at is not None, "nothing more will ever be said"
            assert wake_at < self.now + FAR_S
            self.now = max(self.now, wake_at)
            self._listen()
        heard, self._heard = self._heard, b""
        return heard

    def wait(self, seconds: float) -> None:
        """Let time go by."""
        self.now += seconds
        self._listen()

    def unheard(self) -> str:
        """Text said up to now that no question has read."""
        self._listen()
        heard, self._unread, self._heard = self._unread + self._heard, b"", b""
        return heard.decode()

    def touch(self, deed: Callable[[float], None]) -> None:
        deed(self.now)
        self._listen()

    def _listen(self) -> None:
        self._heard += self.line.take_output(self.now)


class PortHost(Host):
    """A host in real time, at a port of the machine."""

    def __init__(self, line: Rc400Line, port: Port, write: Callable[[bytes], object]) -> None:
        super().__init__(line)
        self.received = asyncio.StreamReader()
        self._port = port
        self._write = write

    def send(self, frame: str) -> None:
        self._write(frame.encode() + b"\r")

    async def receive(self) -> bytes:
        async with asyncio.timeout(PATIENCE_S):
            return await self.received.read(4096)

    def touch(self, deed: Callable[[float], None]) -> None:
        self._port.touch(deed)


@asynccontextmanager
async def at_terminal(path: Path, bodies: Iterable[int] = (BODY,)) -> AsyncIterator[PortHost]:
    """A host at the pseudo-terminal of a new line."""
    line = build_line(bodies, monotonic())
    port = serve_pty(line, path)
    device = os.open(path, os.O_RDWR | os.O_NOCTTY)
    tty.setraw(device)
    host = PortHost(line, port, lambda data: os.write(device, data))
    loop = asyncio.get_running_loop()
    loop.add_reader(device, lambda: host.received.feed_data(os.read(device, 4096)))
    try:
        yield host
    finally:
        loop.remove_reader(device)
        os.close(device)
        await port.aclose()


@asynccontextmanager
async def at_socket(bodies: Iterable[int] = (BODY,)) -> AsyncIterator[PortHost]:
    """A host at the TCP listener of a new line."""
    line = build_line(bodies, monotonic())
    port = await serve_tcp(line, "127.0.0.1", 0)
    reader, writer = await asyncio.open_connection("127.0.0.1", int(port.address.rpartition(":")[2]))
    host = PortHost(line, port, writer.write)
    host.received = reader
    try:
        yield host
    finally:
        writer.close()
        await writer.wait_closed()
        await port.aclose()
