"""A machine behind a dual-port RAM in a real file, seen from its host side."""

import asyncio
from pathlib import Path

import anyio.lowlevel
import pytest

from simulator.fics.dpram_port import SIZE, SimulatedDpram, Tears, serve_dpram
from simulator.ports import MOST_UNREAD
from tests.simulator.test_ports import Parrot

pytestmark = pytest.mark.anyio


class Host:
    """A program at the host side: offsets as in C-HOST manual 1-4."""

    def __init__(self, path: Path) -> None:
        self.file = path.open("r+b", buffering=0)

    def peek(self, start: int, count: int = 1) -> bytes:
        self.file.seek(start)
        return self.file.read(count)

    def poke(self, start: int, data: bytes) -> None:
        self.file.seek(start)
        self.file.write(data)

    async def sends(self, message: bytes) -> None:
        await self.sees(257, 0)
        self.poke(258, message.ljust(254, b"\0"))
        self.poke(257, b"\1")

    async def hears(self) -> bytes:
        await self.sees(512, 1)
        area = self.peek(513, 255)
        self.poke(512, b"\0")
        return area

    async def sees(self, flag: int, value: int) -> None:
        async with asyncio.timeout(60):
            while self.peek(flag) != bytes([value]):
                await anyio.lowlevel.checkpoint()


async def test_messages_go_both_ways_one_at_a_time_padded_with_zeros(tmp_path: Path) -> None:
    port = serve_dpram(Parrot(), tmp_path / "ram")
    host = Host(tmp_path / "ram")
    await host.sends(b"ACD\r")
    await host.sends(b"APS 1.5,-2\r")
    await host.sees(257, 0)
    assert await host.hears() == b"ACD\r".ljust(255, b"\0")
    assert await host.hears() == b"APS 1.5,-2\r".ljust(255, b"\0")
    host.file.close()
    await port.aclose()


async def test_a_message_may_be_ended_by_its_flag_alone(tmp_path: Path) -> None:
    port = serve_dpram(Parrot(), tmp_path / "ram")
    port.ends_with_cr = False
    host = Host(tmp_path / "ram")
    await host.sends(b"APS 1.5,-2\r")
    assert await host.hears() == b"APS 1.5,-2".ljust(255, b"\0")
    host.file.close()
    await port.aclose()


async def test_what_lies_behind_the_cr_is_no_message(tmp_path: Path) -> None:
    parrot = Parrot()
    port = serve_dpram(parrot, tmp_path / "ram")
    host = Host(tmp_path / "ram")
    await host.sends(b"ACD\rLMA 100\r")
    assert (await host.hears()).startswith(b"ACD\r\0")
    await host.sends(b"")
    await host.sends(b"ASD\r\n")
    await host.sees(257, 0)
    assert [data for _, data in parrot.heard] == [b"ACD\r", b"ASD\r\n"]
    host.file.close()
    await port.aclose()


async def test_it_gives_unasked_and_in_pieces_what_the_machine_says(tmp_path: Path) -> None:
    parrot = Parrot()
    port = serve_dpram(parrot, tmp_path / "ram")
    host = Host(tmp_path / "ram")
    port.touch(lambda now: parrot.ticks.append(now + 0.001))
    assert (await host.hears()).rstrip(b"\0") == b"tick\r"
    port.write(b"LMA\rERR 0")
    port.write(b"x" * 300)
    assert [(await host.hears()).rstrip(b"\0") for _ in range(3)] == [b"LMA\r", b"ERR 0", b"x" * 255]
    host.file.close()
    await port.aclose()


async def test_a_host_that_takes_nothing_costs_messages_and_not_memory(tmp_path: Path) -> None:
    port = serve_dpram(Parrot(), tmp_path / "ram")
    for _ in range(10):
        port.write(b"POS 1\r" * 10_000)
    assert sum(map(len, port._waiting)) < 2 * MOST_UNREAD
    await port.aclose()


async def test_a_stalled_fics_leaves_the_flags_as_they_are(tmp_path: Path) -> None:
    parrot = Parrot()
    port = serve_dpram(parrot, tmp_path / "ram")
    host = Host(tmp_path / "ram")
    port.stalled = True
    await host.sends(b"ACD\r")
    port.write(b"LMA\r")
    for _ in range(100):
        await asyncio.sleep(0)
    assert (host.peek(257), host.peek(512), parrot.heard) == (b"\1", b"\0", [])
    port.stalled = False
    assert (await host.hears()).rstrip(b"\0") == b"LMA\r"
    assert (await host.hears()).rstrip(b"\0") == b"ACD\r"
    host.file.close()
    await port.aclose()


async def test_the_file_is_new_at_each_start_and_goes_at_the_end(tmp_path: Path) -> None:
    path = tmp_path / "ram"
    path.write_bytes(b"\1" * SIZE)
    old = Host(path)
    first = serve_dpram(Parrot(), path)
    assert path.read_bytes() == bytes(SIZE)
    assert old.peek(512) == b"\1"
    second: SimulatedDpram = serve_dpram(Parrot(), path)
    assert second.address == f"dpram://{path}"
    await first.aclose()
    assert path.exists()
    await second.aclose()
    assert not path.exists()
    old.file.close()


async def test_a_file_in_the_way_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "ram").write_text("precious")
    with pytest.raises(FileExistsError, match="no dual-port RAM"):
        serve_dpram(Parrot(), tmp_path / "ram")
    assert (tmp_path / "ram").read_text() == "precious"


async def test_a_torn_message_is_whole_after_its_delay(tmp_path: Path) -> None:
    port = serve_dpram(Parrot(), tmp_path / "ram")
    host = Host(tmp_path / "ram")
    port.tears = Tears(next_messages=1, delay_s=0.005)
    port.write(b"APS 1.5,-2\r")
    port.write(b"ACD\r")
    assert (host.peek(512), host.peek(513, 255)) == (b"\1", b"APS 1".ljust(255, b"\0"))
    async with asyncio.timeout(60):
        while port.flags == (0, 1) and b"\r" not in host.peek(513, 255):
            await anyio.lowlevel.checkpoint()
    assert (await host.hears()).rstrip(b"\0") == b"APS 1.5,-2\r"
    assert (await host.hears()).rstrip(b"\0") == b"ACD\r"
    assert port.tears.next_messages == 0
    host.file.close()
    await port.aclose()


async def test_the_end_comes_while_a_message_is_torn(tmp_path: Path) -> None:
    port = serve_dpram(Parrot(), tmp_path / "ram")
    port.tears = Tears(next_messages=1, delay_s=0.0)
    port.write(b"ACD\r")
    assert port.flags == (0, 1)
    await port.aclose()
    await asyncio.sleep(0)
