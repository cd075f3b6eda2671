"""A host that talks to a simulated Fics in bytes: at each of its real ports, with a clock turned by hand."""

import asyncio
import os
import tty
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import AbstractAsyncContextManager, asynccontextmanager
from pathlib import Path

import anyio.lowlevel

from simulator.fics.dpram_port import serve_dpram
from simulator.fics.line import SimulatedFics
from simulator.ports import Port, serve_pty, serve_tcp

CR = b"\r"
PATIENCE_S = 60.0
LONGEST_MOTION_S = 600.0


class StoppedClock:
    """A machine whose time passes only when a test advances it."""

    def __init__(self, line: SimulatedFics) -> None:
        self.line = line
        self._now = 0.0
        self._said = b""

    def receive(self, data: bytes, _now: float) -> None:
        self.line.receive(data, self._now)

    def take_output(self, _now: float) -> bytes:
        said, self._said = self._said + self.line.take_output(self._now), b""
        return said

    def wake_at(self) -> None:
        return None

    def wait(self, seconds: float) -> None:
        self._now += seconds

    def finish(self) -> None:
        """Let time pass until nothing moves."""
        end = self._now + LONGEST_MOTION_S
        while (wake_at := self.line.wake_at()) is not None:
            assert wake_at < end
            self._now = max(self._now, wake_at)
            self._said += self.line.take_output(self._now)


class Host:
    """A host at a port of a machine: sends and hears messages in bytes, and turns the clock."""

    def __init__(
        self,
        machine: StoppedClock,
        port: Port,
        send: Callable[[bytes], Awaitable[None]],
        hear: Callable[[], Awaitable[bytes]],
    ) -> None:
        self._machine = machine
        self._port = port
        self._send = send
        self._hear = hear
        self._sent = 0

    async def send(self, message: bytes) -> None:
        """Send a message, its terminator included."""
        await self._send(message)
        self._sent += 1

    async def hear(self) -> bytes:
        """Wait for the next message, its terminator included."""
        async with asyncio.timeout(PATIENCE_S):
            return await self._hear()

    async def wait(self, seconds: float) -> None:
        """Let time pass for the machine, after it has received everything."""
        await self._arrived()
        self._port.touch(lambda _now: self._machine.wait(seconds))

    async def finish(self) -> None:
        """Let time pass until nothing moves."""
        await self._arrived()
        self._port.touch(lambda _now: self._machine.finish())

    async def _arrived(self) -> None:
        async with asyncio.timeout(PATIENCE_S):
            while self._machine.line.requests < self._sent:
                await anyio.lowlevel.checkpoint()


@asynccontextmanager
async def _at_terminal(machine: StoppedClock, path: Path) -> AsyncIterator[Host]:
    port = serve_pty(machine, path)
    device = os.open(path, os.O_RDWR | os.O_NOCTTY)
    tty.setraw(device)
    received = asyncio.StreamReader()
    loop = asyncio.get_running_loop()
    loop.add_reader(device, lambda: received.feed_data(os.read(device, 4096)))

    async def send(message: bytes) -> None:
        os.write(device, message)

    try:
        yield Host(machine, port, send, lambda: received.readuntil(CR))
    finally:
        loop.remove_reader(device)
        os.close(device)
        await port.aclose()


@asynccontextmanager
async def _at_socket(machine: StoppedClock, _path: Path) -> AsyncIterator[Host]:
    port = await serve_tcp(machine, "127.0.0.1", 0)
    reader, writer = await asyncio.open_connection("127.0.0.1", int(port.address.rpartition(":")[2]))

    async def send(message: bytes) -> None:
        writer.write(message)

    try:
        yield Host(machine, port, send, lambda: reader.readuntil(CR))
    finally:
        writer.close()
        await writer.wait_closed()
        await port.aclose()


@asynccontextmanager
async def _at_dpram(machine: StoppedClock, path: Path) -> AsyncIterator[Host]:
    """Flags and areas as in C-HOST manual 1-4."""
    port = serve_dpram(machine, path)
    ram = os.open(path, os.O_RDWR)

    async def until(flag: int, value: bytes) -> None:
        while os.pread(ram, 1, flag) != value:
            await anyio.lowlevel.checkpoint()

    async def send(message: bytes) -> None:
        await until(257, b"\0")
        os.pwrite(ram, message.ljust(254, b"\0"), 258)
        os.pwrite(ram, b"\1", 257)

    async def hear() -> bytes:
        await until(512, b"\1")
        message = os.pread(ram, 255, 513)
        os.pwrite(ram, b"\0", 512)
        return message.rstrip(b"\0")

    try:
        yield Host(machine, port, send, hear)
    finally:
        os.close(ram)
        await port.aclose()


At = Callable[[StoppedClock, Path], AbstractAsyncContextManager[Host]]
PORTS: dict[str, At] = {"pty": _at_terminal, "tcp": _at_socket, "dpram": _at_dpram}
