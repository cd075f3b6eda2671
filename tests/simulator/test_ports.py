"""A machine behind a real pseudo-terminal and a real socket, and on a line with a speed."""

import asyncio
import os
import tty
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import pytest

from simulator.ports import PacedClockwork, Port, serve_pty, serve_tcp
from tests.virtual_time import run_virtual


class Parrot:
    """Repeats every line once it has its CR, and says `tick` at the moments it is given."""

    def __init__(self, *ticks: float) -> None:
        self.heard: list[tuple[float, bytes]] = []
        self.ticks = list(ticks)
        self._line = b""
        self._output = b""

    def receive(self, data: bytes, now: float) -> None:
        self.heard.append((now, data))
        self._line += data
        if self._line.endswith(b"\r"):
            self._output += self._line
            self._line = b""

    def take_output(self, now: float) -> bytes:
        while self.ticks and self.ticks[0] <= now:
            self.ticks.pop(0)
            self._output += b"tick\r"
        output, self._output = self._output, b""
        return output

    def wake_at(self) -> float | None:
        return self.ticks[0] if self.ticks else None


@contextmanager
def opened(path: Path) -> Iterator[int]:
    """A program at the terminal."""
    device = os.open(path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
    tty.setraw(device)
    yield device
    os.close(device)


async def read_line(device: int) -> bytes:
    loop = asyncio.get_running_loop()
    line = b""
    while not line.endswith(b"\r"):
        readable = asyncio.Event()
        loop.add_reader(device, readable.set)
        await asyncio.wait_for(readable.wait(), 60)
        loop.remove_reader(device)
        line += os.read(device, 1)
    return line


@pytest.mark.anyio
@pytest.mark.parametrize("baud", [None, 115_200])
async def test_a_terminal_carries_every_byte_as_it_is(tmp_path: Path, baud: int | None) -> None:
    every_byte = bytes(byte for byte in range(256) if byte != 13) + b"\r"
    port = serve_pty(Parrot(), tmp_path / "line", baud)
    with opened(tmp_path / "line") as device:
        os.write(device, every_byte)
        assert await read_line(device) == every_byte
    await port.aclose()


@pytest.mark.anyio
async def test_programs_come_and_go_at_a_terminal(tmp_path: Path) -> None:
    port = serve_pty(Parrot(), tmp_path / "line")
    for text in (b"one\r", b"two\r"):
        with opened(tmp_path / "line") as device:
            os.write(device, text)
            assert await read_line(device) == text
    await port.aclose()


@pytest.mark.anyio
async def test_the_link_replaces_a_stale_one_and_goes_at_the_end(tmp_path: Path) -> None:
    link = tmp_path / "line"
    link.symlink_to("/dev/pts/gone")
    port = serve_pty(Parrot(), link)
    with opened(link) as device:
        os.write(device, b"here\r")
        assert await read_line(device) == b"here\r"
    await port.aclose()
    assert not link.is_symlink()


@pytest.mark.anyio
async def test_the_link_of_a_living_terminal_is_left_alone(tmp_path: Path) -> None:
    link = tmp_path / "line"
    port = serve_pty(Parrot(), link)
    with pytest.raises(FileExistsError, match="which is in use"):
        serve_pty(Parrot(), link)
    assert link.is_symlink()
    await port.aclose()


@pytest.mark.anyio
async def test_a_link_that_has_become_anothers_stays(tmp_path: Path) -> None:
    link = tmp_path / "line"
    first = serve_pty(Parrot(), link)
    link.unlink()
    second = serve_pty(Parrot(), link)
    await first.aclose()
    assert link.is_symlink()
    await second.aclose()
    assert not link.is_symlink()


@pytest.mark.anyio
async def test_a_file_in_the_way_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "line").write_text("precious")
    with pytest.raises(FileExistsError, match="is no symbolic link"):
        serve_pty(Parrot(), tmp_path / "line")
    assert (tmp_path / "line").read_text() == "precious"


@pytest.mark.anyio
async def test_a_terminal_that_nobody_reads_does_not_stop_the_machine(tmp_path: Path) -> None:
    port = serve_pty(Parrot(), tmp_path / "line")
    for _ in range(100):
        port.write(bytes(1000))
    with opened(tmp_path / "line") as device:
        with suppress(BlockingIOError):
            while os.read(device, 4096):
                pass
        os.write(device, b"alive\r")
        assert (await read_line(device)).endswith(b"alive\r")
    await port.aclose()


def address_of(port: Port) -> tuple[str, int]:
    host, _, number = port.address.removeprefix("tcp://").rpartition(":")
    return host, int(number)


@pytest.mark.anyio
@pytest.mark.parametrize("baud", [None, 115_200])
async def test_one_tcp_client_at_a_time(baud: int | None) -> None:
    port = await serve_tcp(Parrot(), "127.0.0.1", 0, baud)
    reader, writer = await asyncio.open_connection(*address_of(port))
    writer.write(b"first\r")
    assert await reader.readuntil(b"\r") == b"first\r"

    late_reader, late_writer = await asyncio.open_connection(*address_of(port))
    assert await late_reader.read() == b""
    late_writer.close()
    writer.write(b"still here\r")
    assert await reader.readuntil(b"\r") == b"still here\r"

    writer.close()
    await writer.wait_closed()
    reader, writer = await reconnected(port)
    writer.close()
    await port.aclose()
    assert await reader.read() == b""


async def reconnected(port: Port) -> tuple[asyncio.StreamReader, asyncio.StreamWriter]:
    """The machine is free as soon as it has seen the last client go."""
    while True:
        reader, writer = await asyncio.open_connection(*address_of(port))
        writer.write(b"next\r")
        if await reader.read(5) == b"next\r":
            return reader, writer
        writer.close()


@pytest.mark.anyio
async def test_what_the_machine_says_unasked_is_sent_at_once(tmp_path: Path) -> None:
    parrot = Parrot()
    port = serve_pty(parrot, tmp_path / "line")
    with opened(tmp_path / "line") as device:
        port.touch(lambda now: parrot.ticks.extend([now + 0.002, now + 0.004]))
        assert await read_line(device) + await read_line(device) == b"tick\rtick\r"
    await port.aclose()


class Ear:
    """A host that notes when it is told something."""

    def __init__(self) -> None:
        self.heard: list[tuple[float, bytes]] = []

    def write(self, data: bytes) -> None:
        self.heard.append((asyncio.get_running_loop().time(), data))


BYTE_S = 10 / 9600


def test_on_a_paced_line_every_byte_takes_its_time(monkeypatch: pytest.MonkeyPatch) -> None:
    parrot, ear = Parrot(0.5), Ear()

    async def story() -> None:
        loop = asyncio.get_running_loop()
        monkeypatch.setattr("simulator.ports.monotonic", loop.time)
        # Spinning takes no virtual time: the last stretch is slept through as well.
        monkeypatch.setattr("simulator.ports.WATCH_S", 0.0)
        monkeypatch.setattr("simulator.ports.LINGER_S", 0.0)
        line = PacedClockwork(parrot, 9600)
        line.host = ear
        line.feed(b"1234\r12")
        await asyncio.sleep(4 * BYTE_S)
        line.feed(b"34\r")
        await asyncio.sleep(1.0)
        line.feed(b"5\r\n")
        await asyncio.sleep(1.0)
        line.stop()

    run_virtual(story())
    assert [data for _, data in parrot.heard] == [b"1234\r", b"12", b"34\r", b"5\r\n"]
    # The LF comes with its CR: a line that has another end than CR is known by it.
    heard_at = [5 * BYTE_S, 7 * BYTE_S, 10 * BYTE_S, 1.0 + 7 * BYTE_S]
    assert [at for at, _ in parrot.heard] == pytest.approx(heard_at)
    # The second command queues behind the first, and its reply behind the first reply.
    assert [data for _, data in ear.heard] == [b"1234\r", b"1234\r", b"tick\r"]
    assert [at for at, _ in ear.heard] == pytest.approx([10 * BYTE_S, 15 * BYTE_S, 0.5 + 5 * BYTE_S])
