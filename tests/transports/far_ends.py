"""The other ends of real ports: a pseudo-terminal, a TCP server and a dual-port RAM, driven by hand."""

import os
import socket
import tty
from abc import ABC, abstractmethod
from pathlib import Path

import anyio
import anyio.lowlevel

from tests.dpram_board import Wiring
from transports import TransportLost

PATIENCE_S = 60.0
"""Seconds after which, on a busy machine too, a thing that has not happened never will."""


class Ear:
    """A receiver that remembers what it was told."""

    def __init__(self) -> None:
        self.heard = b""
        self.losses: list[TransportLost] = []
        self._news = anyio.Event()

    def data_received(self, data: bytes) -> None:
        self.heard += data
        self._news.set()

    def connection_lost(self, error: TransportLost) -> None:
        self.losses.append(error)
        self._news.set()

    async def hears(self, count: int) -> bytes:
        while len(self.heard) < count:
            await self._next()
        return self.heard

    async def loses(self) -> TransportLost:
        while not self.losses:
            await self._next()
        return self.losses[0]

    async def _next(self) -> None:
        with anyio.fail_after(PATIENCE_S):
            await self._news.wait()
        self._news = anyio.Event()


class FarEnd(ABC):
    """The far end of the port under test."""

    address: str
    fd: int = -1

    @abstractmethod
    def appear(self) -> None:
        """Be there to be opened; again after it has gone."""

    @abstractmethod
    async def answer(self) -> None:
        """Take the connection, once the port has been opened."""

    @abstractmethod
    def vanish(self) -> None:
        """Hang up, and leave nothing to be opened."""

    async def write(self, data: bytes) -> None:
        while data:
            with anyio.fail_after(PATIENCE_S):
                await anyio.wait_writable(self.fd)
            data = data[os.write(self.fd, data) :]

    async def read(self, count: int) -> bytes:
        data = b""
        while len(data) < count:
            with anyio.fail_after(PATIENCE_S):
                await anyio.wait_readable(self.fd)
            data += os.read(self.fd, 65536)
        return data


class PtyFarEnd(FarEnd):
    """The master side of a pseudo-terminal whose slave has a name that lasts."""

    def __init__(self, directory: Path) -> None:
        self.name = directory / "port"
        self.address = f"serial://{self.name}?baud=115200"
        self.appear()

    def appear(self) -> None:
        self.fd, slave = os.openpty()
        tty.setraw(slave)
        os.set_blocking(self.fd, False)
        self.name.symlink_to(os.ttyname(slave))
        os.close(slave)

    async def answer(self) -> None:
        assert self.fd >= 0

    def vanish(self) -> None:
        if self.fd >= 0:
            os.close(self.fd)
            self.name.unlink()
            self.fd = -1


class TcpFarEnd(FarEnd):
    """A TCP server for one client."""

    def __init__(self) -> None:
        self._port = 0
        self.client = socket.socket()
        self.appear()
        self.address = f"tcp://127.0.0.1:{self._port}"

    def appear(self) -> None:
        self._server = socket.create_server(("127.0.0.1", self._port))
        self._server.setblocking(False)
        self._port = self._server.getsockname()[1]

    async def answer(self) -> None:
        with anyio.fail_after(PATIENCE_S):
            await anyio.wait_readable(self._server)
        self.client.close()
        self.client, _ = self._server.accept()
        self.client.setblocking(False)
        self.fd = self.client.fileno()

    def vanish(self) -> None:
        self.client.close()
        self._server.close()

    async def end(self) -> bytes:
        """Bytes at the end of a connection that the port has closed: none."""
        with anyio.fail_after(PATIENCE_S):
            await anyio.wait_readable(self.client)
        return self.client.recv(1)


class DpramFarEnd(FarEnd):
    """The Fics side of a dual-port RAM in a file, reached by reading and writing that file."""

    def __init__(self, directory: Path, wiring: Wiring | None = None) -> None:
        self.name = directory / "dpram"
        self.wiring = wiring or Wiring()
        self.address = f"dpram://{self.name}{self.wiring.options if wiring else '?size=1024'}"
        self._unfinished = b""
        self.appear()

    def appear(self) -> None:
        self.fd = os.open(self.name, os.O_RDWR | os.O_CREAT)
        os.truncate(self.fd, self.wiring.length)

    async def answer(self) -> None:
        assert self.fd >= 0

    def vanish(self) -> None:
        if self.fd >= 0:
            os.truncate(self.fd, 0)
            self.name.unlink()
            os.close(self.fd)
            self.fd = -1

    def peek(self, start: int, count: int = 1) -> bytes:
        places = self.wiring.places(slice(start, start + count))
        return os.pread(self.fd, places.stop - places.start, places.start)[:: places.step]

    def poke(self, start: int, data: bytes) -> None:
        places = self.wiring.places(slice(start, start + len(data)))
        for at, value in zip(range(places.start, places.stop, places.step), data, strict=True):
            os.pwrite(self.fd, bytes([value]), at)

    async def write(self, data: bytes) -> None:
        *messages, self._unfinished = (self._unfinished + data).split(b"\r")
        for message in messages:
            await self.sees(512, 0)
            self.poke(513, (message + b"\r").ljust(255, b"\0"))
            self.poke(512, b"\1")

    async def read(self, count: int) -> bytes:
        data = b""
        while len(data) < count:
            await self.sees(257, 1)
            data += self.peek(258, 254).partition(b"\r")[0] + b"\r"
            self.poke(257, b"\0")
        return data

    async def sees(self, flag: int, value: int) -> None:
        with anyio.fail_after(PATIENCE_S):
            while self.peek(flag) != bytes([value]):
                await anyio.lowlevel.checkpoint()
