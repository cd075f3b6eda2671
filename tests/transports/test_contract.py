"""The promises of every transport, over real ports."""

import asyncio
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.transports.far_ends import PATIENCE_S, DpramFarEnd, Ear, FarEnd, PtyFarEnd, TcpFarEnd
from transports import Transport, TransportLost, TransportUnavailable, create
from transports.recorder import Recorded, Recorder

pytestmark = pytest.mark.anyio

EVERY_BYTE = bytes(range(256)) + b"\r"  # two messages, where a port carries messages
LARGE = EVERY_BYTE * 2048  # more than the far end's side of the way holds


@pytest.fixture(params=["serial", "tcp", "dpram"])
def far(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[FarEnd]:
    end: FarEnd
    match request.param:
        case "serial":
            end = PtyFarEnd(tmp_path)
        case "tcp":
            end = TcpFarEnd()
        case _:
            end = DpramFarEnd(tmp_path)
    yield end
    end.vanish()


@pytest.fixture(params=["bare", "recorded"])
def transport(request: pytest.FixtureRequest, far: FarEnd) -> Transport:
    bare = create(far.address)
    return bare if request.param == "bare" else Recorded(bare, Recorder())


@pytest.fixture
def ear() -> Ear:
    return Ear()


class TestTransport:
    """One story per promise of `transports.base`."""

    async def connect(self, transport: Transport, far: FarEnd, ear: Ear) -> None:
        await transport.open(ear)
        await far.answer()

    async def test_every_byte_value_passes_both_ways(
        self, transport: Transport, far: FarEnd, ear: Ear
    ) -> None:
        await self.connect(transport, far, ear)
        transport.write(EVERY_BYTE)
        assert await far.read(257) == EVERY_BYTE
        await far.write(EVERY_BYTE)
        assert await ear.hears(257) == EVERY_BYTE
        await transport.close()

    async def test_bytes_sent_one_by_one_arrive_in_order(
        self, transport: Transport, far: FarEnd, ear: Ear
    ) -> None:
        await self.connect(transport, far, ear)
        for value in EVERY_BYTE:
            transport.write(bytes([value]))
            await far.write(bytes([value]))
        assert await far.read(257) == EVERY_BYTE
        assert await ear.hears(257) == EVERY_BYTE
        await transport.close()

    async def test_a_large_write_arrives_whole_and_is_unsent_until_it_is_taken(
        self, transport: Transport, far: FarEnd, ear: Ear
    ) -> None:
        await self.connect(transport, far, ear)
        transport.write(LARGE)
        assert transport.unsent() > 0
        assert await far.read(len(LARGE)) == LARGE
        assert transport.unsent() == 0
        await transport.close()

    async def test_a_port_that_goes_away_is_told_once_and_takes_no_more_bytes(
        self, transport: Transport, far: FarEnd, ear: Ear
    ) -> None:
        await self.connect(transport, far, ear)
        far.vanish()
        loss = await ear.loses()
        assert transport.address in str(loss)
        with pytest.raises(TransportLost, match="nothing was sent"):
            transport.write(b"&3F1+M\r")
        assert transport.unsent() == 0
        await transport.close()
        assert ear.losses == [loss]

    async def test_a_loss_is_told_at_once_though_bytes_are_still_unsent(
        self, transport: Transport, far: FarEnd, ear: Ear
    ) -> None:
        await self.connect(transport, far, ear)
        transport.write(LARGE)
        await far.read(1)
        far.vanish()
        await ear.loses()
        await transport.close()
        assert len(ear.losses) == 1

    async def test_a_lost_port_opens_again(self, transport: Transport, far: FarEnd, ear: Ear) -> None:
        await self.connect(transport, far, ear)
        far.vanish()
        await ear.loses()
        far.appear()
        second = Ear()
        await self.connect(transport, far, second)
        await far.write(b">&3F1+M\r")
        assert await second.hears(8) == b">&3F1+M\r"
        assert ear.heard == b""
        await transport.close()

    async def test_a_closed_port_is_silent_and_opens_again(
        self, transport: Transport, far: FarEnd, ear: Ear
    ) -> None:
        await self.connect(transport, far, ear)
        await transport.close()
        await transport.close()
        with pytest.raises(TransportLost, match="nothing was sent"):
            transport.write(b"&3F1+M\r")
        again = Ear()
        await self.connect(transport, far, again)
        transport.write(b"&3F1+M\r")
        assert await far.read(7) == b"&3F1+M\r"
        await transport.close()
        assert (ear.heard, ear.losses, again.losses) == (b"", [], [])

    async def test_closing_does_not_wait_for_a_far_end_that_takes_nothing(
        self, transport: Transport, far: FarEnd, ear: Ear
    ) -> None:
        await self.connect(transport, far, ear)
        transport.write(LARGE)
        async with asyncio.timeout(PATIENCE_S):
            await transport.close()
        assert ear.losses == []

    async def test_what_is_unsent_at_closing_never_arrives(
        self, transport: Transport, far: FarEnd, ear: Ear
    ) -> None:
        await self.connect(transport, far, ear)
        transport.write(LARGE)
        unsent = transport.unsent()
        await transport.close()
        await self.connect(transport, far, ear)
        transport.write(b"&3F1+M\r")
        heard = b""
        while not heard.endswith(b"&3F1+M\r"):
            heard += await far.read(1)
        assert unsent > 0
        assert len(heard) <= len(LARGE) - unsent + 7
        await transport.close()

    async def test_closing_a_port_that_was_never_opened_is_harmless(self, transport: Transport) -> None:
        await transport.close()
        assert transport.unsent() == 0
        with pytest.raises(TransportLost, match="not open"):
            transport.write(b"&3F1+M\r")

    async def test_a_port_that_is_not_there_says_so(
        self, transport: Transport, far: FarEnd, ear: Ear
    ) -> None:
        far.vanish()
        with pytest.raises(TransportUnavailable, match="Nothing was sent") as refusal:
            await transport.open(ear)
        assert transport.address in str(refusal.value)
        assert ear.losses == []

    async def test_an_open_port_is_not_opened_twice(
        self, transport: Transport, far: FarEnd, ear: Ear
    ) -> None:
        await self.connect(transport, far, ear)
        with pytest.raises(TransportUnavailable, match="open already"):
            await transport.open(Ear())
        await far.write(b"still the first one's\r")
        assert await ear.hears(22) == b"still the first one's\r"
        await transport.close()
