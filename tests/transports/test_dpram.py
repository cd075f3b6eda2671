"""A dual-port RAM in a file, whose Fics side is driven by hand."""

import asyncio
import operator
import os
from collections.abc import Coroutine, Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.dpram_board import WIRINGS, Wiring
from tests.transports.far_ends import DpramFarEnd, Ear
from tests.virtual_time import run_virtual
from transports import TransportLost, TransportRefused, TransportUnavailable, create, dpram
from transports.addresses import Address
from transports.recorder import Recorded, Recorder

HOST_MODE, TO_FICS_FLAG, TO_FICS, FROM_FICS_FLAG, FROM_FICS = 256, 257, 258, 512, 513
"""C-HOST manual 1-4, as offsets."""


@pytest.fixture
def far(tmp_path: Path) -> Iterator[DpramFarEnd]:
    end = DpramFarEnd(tmp_path)
    yield end
    end.vanish()


def port_at(far: DpramFarEnd, options: str = "") -> dpram.DpramPort:
    return dpram.DpramPort(Address.parse(far.address + options))


@pytest.fixture(autouse=True)
def _spinning_takes_no_virtual_time(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(dpram, "SPIN_S", 0.0)


def play(story: Coroutine[Any, Any, None]) -> None:
    run_virtual(story)


def open_files() -> int:
    return len(list(Path("/proc/self/fd").iterdir()))


async def looks() -> None:
    """Long enough for the port to look at the RAM, however idle it is."""
    await asyncio.sleep(2 * dpram.LONGEST_PAUSE_S)


class TestSending:
    def test_a_message_lies_at_its_offsets_with_its_cr_and_zeros_behind_it(self, far: DpramFarEnd) -> None:
        async def story() -> None:
            far.poke(HOST_MODE, b"\1")
            far.poke(TO_FICS, b"left from a longer message\r")
            port = port_at(far)
            await port.open(Ear())
            port.write(b"LMA 10.0,,30\r")
            assert far.peek(HOST_MODE, 2) == b"\0\1"
            assert far.peek(TO_FICS, 254) == b"LMA 10.0,,30\r".ljust(254, b"\0")
            assert port.unsent() == 13
            far.poke(TO_FICS_FLAG, b"\0")
            assert port.unsent() == 0
            await port.close()

        play(story())

    def test_the_data_is_there_before_its_flag(
        self, far: DpramFarEnd, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        flags_and_data: list[bytes] = []
        store = dpram._Memory.store

        def watched(memory: dpram._Memory, start: int, data: bytes) -> None:
            store(memory, start, data)
            flags_and_data.append(far.peek(TO_FICS_FLAG, 5))

        async def story() -> None:
            port = port_at(far)
            await port.open(Ear())
            monkeypatch.setattr(dpram._Memory, "store", watched)
            port.write(b"AES\r")
            assert flags_and_data == [b"\0AES\r", b"\1AES\r"]
            await port.close()

        play(story())

    def test_a_message_waits_until_the_one_before_has_been_taken(self, far: DpramFarEnd) -> None:
        async def story() -> None:
            port = port_at(far)
            await port.open(Ear())
            port.write(b"VAO 50\r")
            port.write(b"POM 1\rA")
            port.write(b"CD\r")
            assert (far.peek(TO_FICS, 6), port.unsent()) == (b"VAO 50", 17)
            await looks()
            assert far.peek(TO_FICS, 6) == b"VAO 50"
            far.poke(TO_FICS_FLAG, b"\0")
            assert port.unsent() == 10
            assert [await far.read(1), await far.read(1)] == [b"POM 1\r", b"ACD\r"]
            assert port.unsent() == 0
            await port.close()

        # The far end looks in every turn, which leaves no pause that virtual time could jump over.
        asyncio.run(story())

    def test_a_cr_lf_stays_with_its_message(self, far: DpramFarEnd) -> None:
        async def story() -> None:
            port = port_at(far)
            await port.open(Ear())
            port.write(b"APS\r\nACD\r\n")
            assert far.peek(TO_FICS, 6) == b"APS\r\n\0"
            await port.close()

        play(story())

    @pytest.mark.parametrize("text", [b"x" * 254 + b"\r", b"ACD\r" + b"x" * 254 + b"\r", b"x" * 254])
    def test_a_message_that_does_not_fit_is_refused_before_anything_is_written(
        self, far: DpramFarEnd, text: bytes
    ) -> None:
        async def story() -> None:
            port, ear = port_at(far), Ear()
            await port.open(ear)
            with pytest.raises(
                TransportRefused, match=r"at most 254 bytes, and this one has 255; nothing of"
            ):
                port.write(text)
            assert (port.unsent(), far.peek(TO_FICS_FLAG)) == (0, b"\0")
            port.write(b"y" * 253 + b"\r")
            assert far.peek(TO_FICS, 254) == b"y" * 253 + b"\r"
            await port.close()
            assert ear.losses == []

        play(story())

    def test_what_waits_is_bounded(self, far: DpramFarEnd, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(dpram, "MOST_UNSENT", 10)

        async def story() -> None:
            port = port_at(far)
            await port.open(Ear())
            port.write(b"ACD\rAPS\r")
            with pytest.raises(
                TransportRefused, match=r"has 8 bytes waiting for Fics; nothing more was sent"
            ):
                port.write(b"ASS\r")
            assert port.unsent() == 8
            await port.close()

        play(story())

    def test_a_flag_that_stays_set_is_a_loss_and_nothing_that_waits_is_written(
        self, far: DpramFarEnd
    ) -> None:
        async def story() -> None:
            loop = asyncio.get_running_loop()
            port, ear = port_at(far, "&stuck_ms=300"), Ear()
            await port.open(ear)
            far.poke(TO_FICS, b"somebody else's")
            far.poke(TO_FICS_FLAG, b"\1")
            await asyncio.sleep(10)
            assert ear.losses == []  # it stands in nobody's way

            began_at = loop.time()
            port.write(b"AES\r")
            loss = await ear.loses()
            assert loop.time() - began_at == pytest.approx(0.3, abs=0.01)
            assert "Fics has taken no message: the flag at 257 was not 0 for 0.3 s" in str(loss)
            assert far.peek(TO_FICS, 15) == b"somebody else's"
            with pytest.raises(TransportLost, match="nothing was sent"):
                port.write(b"AES\r")
            assert port.unsent() == 0

        play(story())

    def test_a_message_that_is_never_taken_is_a_loss(self, far: DpramFarEnd) -> None:
        async def story() -> None:
            port, ear = port_at(far), Ear()
            await port.open(ear)
            port.write(b"ACD\r")
            await asyncio.sleep(0.95)
            assert ear.losses == []
            await asyncio.sleep(0.1)
            assert "was not 0 for 1 s" in str(ear.losses[0])

        play(story())

    def test_a_fics_that_takes_a_message_now_and_then_is_not_stuck(self, far: DpramFarEnd) -> None:
        async def story() -> None:
            port, ear = port_at(far), Ear()
            await port.open(ear)
            port.write(b"ACD\r" * 10)
            for _ in range(10):
                await asyncio.sleep(0.9)
                far.poke(TO_FICS_FLAG, b"\0")
            assert (port.unsent(), ear.losses) == (0, [])
            await port.close()

        play(story())

    def test_a_memory_that_keeps_nothing_is_a_loss(
        self, far: DpramFarEnd, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        def read_only(memory: dpram._Memory, start: int, data: bytes) -> None:
            """Keep nothing."""

        async def story() -> None:
            port, ear = port_at(far), Ear()
            await port.open(ear)
            monkeypatch.setattr(dpram._Memory, "store", read_only)
            port.write(b"ACD\r")
            assert ear.losses == []  # never within a call of ours
            assert "does not keep what is written" in str(await ear.loses())
            assert far.peek(TO_FICS_FLAG) == b"\0"

        play(story())


class TestTakingBack:
    """A message that Fics has not taken must not be carried out after its caller has stopped waiting."""

    def test_closing_takes_it_back_by_its_flag_and_leaves_the_data_whole(self, far: DpramFarEnd) -> None:
        async def story() -> None:
            port = port_at(far)
            await port.open(Ear())
            port.write(b"LMI ,,-5\rLMI ,,-6\r")
            assert far.peek(TO_FICS_FLAG) == b"\1"
            await port.close()
            assert far.peek(TO_FICS_FLAG, 10) == b"\0LMI ,,-5\r"

            await port.open(Ear())
            await looks()
            assert (far.peek(TO_FICS_FLAG), port.unsent()) == (b"\0", 0)
            await port.close()

        play(story())

    def test_a_loss_takes_it_back_before_it_is_told(self, far: DpramFarEnd) -> None:
        class Witness(Ear):
            def connection_lost(self, error: TransportLost) -> None:
                flags.append(far.peek(TO_FICS_FLAG))
                super().connection_lost(error)

        flags: list[bytes] = []

        async def story() -> None:
            port, ear = port_at(far), Witness()
            await port.open(ear)
            port.write(b"LMI ,,-5\r")
            assert "Fics has taken no message" in str(await ear.loses())
            assert flags == [b"\0"]

        play(story())

    def test_opening_takes_back_what_a_program_that_died_has_left(self, far: DpramFarEnd) -> None:
        async def story() -> None:
            far.poke(TO_FICS, b"LMI ,,-5\r")
            far.poke(TO_FICS_FLAG, b"\1")
            port = port_at(far)
            await port.open(Ear())
            assert far.peek(TO_FICS_FLAG, 10) == b"\0LMI ,,-5\r"
            await port.close()

        play(story())

    def test_opening_takes_back_before_it_sets_the_host_mode(
        self, far: DpramFarEnd, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        mode_and_flag: list[bytes] = []
        store = dpram._Memory.store

        def watched(memory: dpram._Memory, start: int, data: bytes) -> None:
            store(memory, start, data)
            mode_and_flag.append(far.peek(HOST_MODE, 2))

        async def story() -> None:
            far.poke(HOST_MODE, b"\1\1")
            monkeypatch.setattr(dpram._Memory, "store", watched)
            port = port_at(far)
            await port.open(Ear())
            assert mode_and_flag[:2] == [b"\1\0", b"\0\0"]
            await port.close()

        play(story())

    def test_a_flag_that_the_port_has_not_set_is_left_alone_at_closing(self, far: DpramFarEnd) -> None:
        async def story() -> None:
            port = port_at(far)
            await port.open(Ear())
            far.poke(TO_FICS_FLAG, b"\1")
            port.write(b"AES\r")
            await port.close()
            assert far.peek(TO_FICS_FLAG) == b"\1"

        play(story())


class TestReceiving:
    def arrive(self, far: DpramFarEnd, area: bytes) -> None:
        far.poke(FROM_FICS, area)
        far.poke(FROM_FICS_FLAG, b"\1")

    @pytest.mark.parametrize(
        ("area", "heard"),
        [
            (b"APS 1.5,-2\r" + bytes(244), b"APS 1.5,-2\r"),
            (b"APS 1.5,-2\r\n" + bytes(243), b"APS 1.5,-2\r\n"),
            (b"ACD\rleft from a longer one\r" + bytes(228), b"ACD\r"),
            (b"x" * 254 + b"\r", b"x" * 254 + b"\r"),
            (b"x" * 255, b"x" * 255 + b"\r"),
            (b"APS 1.5" + bytes(248), b"APS 1.5\r"),
            (b"MOD 3\0eft from a longer one" + bytes(228), b"MOD 3\r"),
            (b"\0APS\0\r" + bytes(249), b"\0APS\0\r"),
            (bytes(255), b""),
        ],
    )
    def test_an_area_gives_one_message_without_its_padding(
        self, far: DpramFarEnd, area: bytes, heard: bytes
    ) -> None:
        async def story() -> None:
            port, ear = port_at(far), Ear()
            await port.open(ear)
            self.arrive(far, area)
            await asyncio.sleep(0.1)
            assert (ear.heard, far.peek(FROM_FICS_FLAG)) == (heard, b"\0")
            await port.close()

        play(story())

    def test_a_message_without_a_cr_is_complete_by_its_flag_after_a_moment(self, far: DpramFarEnd) -> None:
        async def story() -> None:
            port, ear = port_at(far), Ear()
            await port.open(ear)
            self.arrive(far, b"APS 1.")
            await asyncio.sleep(0.5 * dpram.UNENDED_S)
            far.poke(FROM_FICS, b"APS 1.5\r")
            await looks()
            assert ear.heard == b"APS 1.5\r"
            self.arrive(far, b"ACD 0000".ljust(255, b"\0"))
            await asyncio.sleep(3 * dpram.UNENDED_S)
            assert ear.heard == b"APS 1.5\rACD 0000\r"
            await port.close()

        play(story())

    def test_a_reply_that_lies_there_at_the_start_is_thrown_away(self, far: DpramFarEnd) -> None:
        async def story() -> None:
            self.arrive(far, b"LMA\r")
            port, ear = port_at(far), Ear()
            await port.open(ear)
            assert far.peek(FROM_FICS_FLAG) == b"\0"
            await looks()
            self.arrive(far, b"ACD 0000\r")
            await looks()
            assert ear.heard == b"ACD 0000\r"
            await port.close()

        play(story())

    def test_data_whose_flag_was_never_set_is_ignored(self, far: DpramFarEnd) -> None:
        """Either side may have died between data and flag."""

        async def story() -> None:
            far.poke(TO_FICS, b"LMA 100\r")
            far.poke(FROM_FICS, b"LMA 002\r")
            port, ear = port_at(far), Ear()
            await port.open(ear)
            await asyncio.sleep(10)
            assert (ear.heard, ear.losses, port.unsent()) == (b"", [], 0)
            assert far.peek(TO_FICS_FLAG) == b"\0"
            port.write(b"ACD\r")
            assert far.peek(TO_FICS, 9) == b"ACD\r".ljust(9, b"\0")
            await port.close()

        play(story())

    def test_a_message_that_changes_while_it_is_read_is_read_again(
        self, far: DpramFarEnd, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        halves = [b"APS 1111,2222\r", b"APS 3333,2222\r", b"APS 3333,4444\r"]
        load = dpram._Memory.load

        def while_fics_writes(memory: dpram._Memory, start: int, count: int) -> bytes:
            seen = load(memory, start, count)
            if start == FROM_FICS_FLAG and count > 1 and halves:
                far.poke(FROM_FICS, halves.pop(0))
            return seen

        async def story() -> None:
            port, ear = port_at(far), Ear()
            await port.open(ear)
            monkeypatch.setattr(dpram._Memory, "load", while_fics_writes)
            self.arrive(far, b"APS 0000,0000\r")
            await asyncio.sleep(0.1)
            assert ear.heard == b"APS 3333,4444\r"
            await port.close()

        play(story())

    def test_a_flag_taken_back_during_the_read_gives_no_message(
        self, far: DpramFarEnd, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        load = dpram._Memory.load

        def while_fics_retracts(memory: dpram._Memory, start: int, count: int) -> bytes:
            seen = load(memory, start, count)
            if (start, count) == (FROM_FICS_FLAG, 1):
                far.poke(FROM_FICS_FLAG, b"\0")
            return seen

        async def story() -> None:
            port, ear = port_at(far), Ear()
            await port.open(ear)
            monkeypatch.setattr(dpram._Memory, "load", while_fics_retracts)
            self.arrive(far, b"ACD 0000\r")
            await asyncio.sleep(10)
            assert (ear.heard, ear.losses) == (b"", [])
            await port.close()

        play(story())

    def test_a_board_that_reads_as_all_ones_is_lost(self, far: DpramFarEnd) -> None:
        async def story() -> None:
            port, ear = port_at(far), Ear()
            await port.open(ear)
            far.poke(0, b"\xff" * 1024)
            assert "the flag at 512 or the data after it was not steady for 1 s" in str(await ear.loses())
            assert ear.heard == b""

        play(story())

    @given(area=st.binary(max_size=255), flag=st.integers(0, 255))
    def test_no_content_of_the_ram_does_harm(
        self, area: bytes, flag: int, tmp_path_factory: pytest.TempPathFactory
    ) -> None:
        far = DpramFarEnd(tmp_path_factory.mktemp("ram"))

        async def story() -> None:
            port, ear = port_at(far), Ear()
            await port.open(ear)
            far.poke(FROM_FICS, area)
            far.poke(FROM_FICS_FLAG, bytes([flag]))
            await asyncio.sleep(2)
            assert len(ear.losses) == (flag > 1)
            assert ear.heard == b"" or (area + b"\r").startswith((ear.heard, ear.heard.rstrip(b"\r")))
            await port.close()

        play(story())
        far.vanish()

    def test_a_receiver_may_write_and_close_when_it_is_told_something(self, far: DpramFarEnd) -> None:
        class Curt(Ear):
            def data_received(self, data: bytes) -> None:
                super().data_received(data)
                port.write(b"ACD\r")
                closing.append(asyncio.ensure_future(port.close()))

        port, closing = port_at(far), list[asyncio.Future[None]]()

        async def story() -> None:
            ear = Curt()
            await port.open(ear)
            self.arrive(far, b"LMA\r")
            await looks()
            await closing[0]
            self.arrive(far, b"MOD 3\r")
            await looks()
            assert (ear.heard, ear.losses, far.peek(TO_FICS, 4)) == (b"LMA\r", [], b"ACD\r")

        play(story())


class Watched:
    """The cells of a mapping, each access remembered."""

    def __init__(self, cells: memoryview) -> None:
        self.cells = cells
        self.touched: list[int] = []

    def __getitem__(self, cell: int) -> int:
        self.touched.append(operator.index(cell))
        return self.cells[cell]

    def __setitem__(self, cell: int, value: int) -> None:
        self.touched.append(operator.index(cell))
        self.cells[cell] = value


class TestWiring:
    """Boards differ in where their RAM lies in what is mapped, and in the accesses they bear."""

    @pytest.mark.parametrize("wiring", WIRINGS, ids=lambda wiring: wiring.options)
    def test_messages_and_flags_lie_where_the_address_says(self, tmp_path: Path, wiring: Wiring) -> None:
        far = DpramFarEnd(tmp_path, wiring)

        async def story() -> None:
            far.poke(0, bytes(range(256)))
            far.poke(HOST_MODE, b"\1\1")
            port, ear = port_at(far), Ear()
            await port.open(ear)
            assert far.peek(HOST_MODE, 2) == b"\0\0"
            port.write(b"LMA 10.0,,30\r")
            assert far.peek(HOST_MODE, 2) == b"\0\1"
            assert far.peek(TO_FICS, 254) == b"LMA 10.0,,30\r".ljust(254, b"\0")
            far.poke(FROM_FICS, b"APS 1.5,-2\rrest".ljust(255, b"\xaa"))
            far.poke(FROM_FICS_FLAG, b"\1")
            await looks()
            assert ear.heard == b"APS 1.5,-2\r"
            assert far.peek(FROM_FICS_FLAG, 256) == b"\0" + b"APS 1.5,-2\rrest".ljust(255, b"\xaa")
            await port.close()
            assert far.peek(0, 256) == bytes(range(256))

        play(story())
        far.vanish()

    @pytest.mark.parametrize("wiring", WIRINGS, ids=lambda wiring: wiring.options)
    def test_every_access_is_one_cell_of_the_width_and_holds_bytes_that_are_meant(
        self, tmp_path: Path, wiring: Wiring
    ) -> None:
        far = DpramFarEnd(tmp_path, wiring)
        memory = dpram._Memory(str(far.name), dpram.Place.read(Address.parse(far.address)))
        watched = Watched(memory._cells)
        memory._cells = watched  # type: ignore[assignment]  # stands in for it
        memory.store(TO_FICS, b"LMI 1,2\r")
        assert memory.load(TO_FICS, 8) == b"LMI 1,2\r"
        assert watched.cells.itemsize * 8 == wiring.width
        meant = range(
            wiring.offset + TO_FICS * wiring.stride,
            wiring.offset + (TO_FICS + 8) * wiring.stride,
            wiring.stride,
        )
        assert set(watched.touched) == {place // watched.cells.itemsize for place in meant}
        memory._cells = watched.cells
        memory.close()
        far.vanish()

    @given(data=st.data())
    def test_what_is_stored_is_loaded_and_all_else_stays(
        self, data: st.DataObject, tmp_path_factory: pytest.TempPathFactory
    ) -> None:
        far = DpramFarEnd(tmp_path_factory.mktemp("ram"), data.draw(st.sampled_from(WIRINGS)))
        memory = dpram._Memory(str(far.name), dpram.Place.read(Address.parse(far.address)))
        before = data.draw(st.binary(min_size=768, max_size=768))
        far.poke(0, before)
        start = data.draw(st.integers(0, 767))
        text = data.draw(st.binary(min_size=1, max_size=768 - start))
        memory.store(start, text)
        assert memory.load(start, len(text)) == text
        assert far.peek(0, 768) == before[:start] + text + before[start + len(text) :]
        memory.close()
        far.vanish()

    def test_the_bytes_beside_the_flag_of_fics_are_left_alone_while_it_may_be_writing_them(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        far = DpramFarEnd(tmp_path, Wiring(width=32))
        stored: list[int] = []
        store = dpram._Memory.store

        def watched(memory: dpram._Memory, start: int, data: bytes) -> None:
            stored.append(start)
            store(memory, start, data)

        monkeypatch.setattr(dpram._Memory, "store", watched)

        async def story() -> None:
            port = port_at(far)
            await port.open(Ear())
            assert FROM_FICS_FLAG not in stored
            await port.close()

        play(story())
        far.vanish()

    def test_the_host_mode_is_set_with_every_message(self, far: DpramFarEnd) -> None:
        async def story() -> None:
            port = port_at(far)
            await port.open(Ear())
            far.poke(HOST_MODE, b"\1")
            port.write(b"MOD 3\r")
            assert far.peek(HOST_MODE, 2) == b"\0\1"
            await port.close()

        play(story())


class TestPolling:
    def test_an_idle_port_looks_less_and_less_often_and_a_message_wakes_it(
        self, far: DpramFarEnd, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        looked_at: list[float] = []
        take = dpram._Session._take

        def counted(session: dpram._Session, now: float) -> bytes:
            looked_at.append(now)
            return take(session, now)

        monkeypatch.setattr(dpram._Session, "_take", counted)

        async def story() -> None:
            loop = asyncio.get_running_loop()
            port = port_at(far)
            await port.open(Ear())
            await asyncio.sleep(0.1)
            assert looked_at[-1] - looked_at[-2] == pytest.approx(dpram.LONGEST_PAUSE_S)
            port.write(b"ACD\r")
            written_at = loop.time()
            await asyncio.sleep(0.002)
            soon = [at - written_at for at in looked_at if at >= written_at]
            assert soon == pytest.approx([0.0, 0.0005, 0.0015])
            await port.close()

        play(story())

    def test_after_a_message_every_turn_of_the_loop_looks(
        self, far: DpramFarEnd, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setattr(dpram, "SPIN_S", 3600.0)

        async def story() -> None:
            port, ear = port_at(far), Ear()
            await port.open(ear)
            await looks()
            port.write(b"ACD\r")
            await asyncio.sleep(0)
            far.poke(FROM_FICS, b"ACD 0000\r")
            far.poke(FROM_FICS_FLAG, b"\1")
            await asyncio.sleep(0)
            assert ear.heard == b"ACD 0000\r"
            await port.close()

        play(story())


class TestGoing:
    """Real files, which are cut short, removed and replaced under an open port."""

    @pytest.mark.parametrize("length", [0, 100, 767])
    @pytest.mark.parametrize("busy", [False, True])
    def test_a_file_that_is_cut_short_is_a_loss_and_the_process_lives(
        self, far: DpramFarEnd, length: int, busy: bool
    ) -> None:
        async def story() -> None:
            port, ear = port_at(far, "0"), Ear()  # size=10240: several pages
            os.truncate(far.fd, 10240)
            await port.open(ear)
            await looks()
            os.truncate(far.fd, length)
            if busy:
                port.write(b"LMA 100\r")
            assert port.unsent() >= 0
            assert "was lost (" in str(await ear.loses())
            os.truncate(far.fd, 10240)
            await port.open(ear)
            await port.close()
            assert len(ear.losses) == 1

        play(story())

    def test_memory_that_has_gone_is_told_in_words(self, far: DpramFarEnd) -> None:
        async def story() -> None:
            port, ear = port_at(far), Ear()
            await port.open(ear)
            os.truncate(far.fd, 0)
            port.write(b"LMA 100\r")
            assert str(await ear.loses()) == (
                f"{far.address} was lost (it holds 0 bytes and should hold 1024). What was sent last may not "
                "have arrived; check the controller's power and its driver."
            )

        play(story())

    def test_a_port_that_fails_in_a_write_takes_no_more_and_once_closed_tells_nothing(
        self, far: DpramFarEnd
    ) -> None:
        async def story() -> None:
            port, ear = port_at(far), Ear()
            await port.open(ear)
            os.truncate(far.fd, 0)
            port.write(b"LMA 100\r")
            os.truncate(far.fd, 1024)
            with pytest.raises(TransportLost, match="nothing was sent"):
                port.write(b"AES\r")
            assert port.unsent() == 0
            await port.close()
            await looks()
            assert (ear.losses, far.peek(TO_FICS_FLAG)) == ([], b"\0")

        play(story())

    def test_a_file_that_is_removed_is_a_loss(self, far: DpramFarEnd) -> None:
        async def story() -> None:
            port, ear = port_at(far), Ear()
            await port.open(ear)
            far.name.rename(far.name.with_name("elsewhere"))
            assert "No such file" in str(await ear.loses())
            far.name.with_name("elsewhere").rename(far.name)

        play(story())

    def test_a_file_that_is_replaced_is_a_loss_and_the_new_one_opens(self, far: DpramFarEnd) -> None:
        async def story() -> None:
            port, ear = port_at(far), Ear()
            await port.open(ear)
            fresh = far.name.with_name("fresh")
            fresh.write_bytes(bytes(1024))
            fresh.replace(far.name)
            assert "another file or device has taken its name" in str(await ear.loses())
            await port.open(ear)
            port.write(b"MOD 3\r")
            assert far.name.read_bytes()[TO_FICS : TO_FICS + 6] == b"MOD 3\r"
            await port.close()

        play(story())


class TestOpening:
    def test_a_port_in_use_is_refused_and_left_as_it_is(self, far: DpramFarEnd) -> None:
        async def story() -> None:
            first, second = port_at(far), port_at(far)
            await first.open(Ear())
            first.write(b"ACD\r")
            far.poke(FROM_FICS_FLAG, b"\1")
            with pytest.raises(TransportUnavailable, match="another program is using it"):
                await second.open(Ear())
            assert (far.peek(TO_FICS_FLAG), far.peek(FROM_FICS_FLAG)) == (b"\1", b"\1")
            await first.close()
            await second.open(Ear())
            await second.close()

        play(story())

    @pytest.mark.parametrize(
        ("path", "reason"),
        [
            ("/dev/uio77", "there is no such file or device; load the board's driver"),
            ("/dev/null", "it is another device than a UIO device"),
            ("/dev/zero", "it is another device than a UIO device"),
            ("/proc", "directory"),
            ("/proc/self/mem", "was not opened"),
        ],
    )
    def test_what_is_no_ram_is_unavailable(self, path: str, reason: str) -> None:
        async def story() -> None:
            with pytest.raises(TransportUnavailable, match=reason) as refusal:
                await create(f"dpram://{path}").open(Ear())
            assert str(refusal.value).endswith("Nothing was sent.")

        play(story())

    def test_a_pipe_is_no_ram(self, tmp_path: Path) -> None:
        os.mkfifo(tmp_path / "pipe")

        async def story() -> None:
            with pytest.raises(TransportUnavailable, match="neither a file nor a device"):
                await create(f"dpram://{tmp_path}/pipe").open(Ear())

        play(story())

    def test_a_file_that_is_too_short_stays_as_it_is(self, tmp_path: Path) -> None:
        (tmp_path / "notes.txt").write_text("x" * 700)

        async def story() -> None:
            with pytest.raises(TransportUnavailable, match="it holds 700 bytes and should hold 768"):
                await create(f"dpram://{tmp_path}/notes.txt").open(Ear())
            assert (tmp_path / "notes.txt").read_text() == "x" * 700

        play(story())

    def test_openings_that_fail_leave_nothing_open(self, far: DpramFarEnd) -> None:
        async def story() -> None:
            port = port_at(far)
            for _ in range(3):
                await port.open(Ear())
                await port.close()
                with pytest.raises(TransportUnavailable):
                    await create("dpram:///dev/null").open(Ear())
                os.truncate(far.fd, 100)
                with pytest.raises(TransportUnavailable):
                    await port.open(Ear())
                os.truncate(far.fd, 1024)

        before = open_files()
        play(story())
        assert open_files() == before

    @pytest.mark.parametrize(
        ("address", "reason"),
        [
            ("dpram://uio0", "after three slashes"),
            ("dpram:///", "after three slashes"),
            (
                "dpram:///dev/uio0?baud=9600",
                "unknown option 'baud'; allowed: map, offset, stride, width, size, stuck_ms",
            ),
            ("dpram:///dev/uio0?size=767", "from 768 to 16777216"),
            ("dpram:///dev/uio0?size=4_00", "not '4_00'"),
            ("dpram:///dev/uio0?offset=0x400&size=1791", "size must be a whole number from 1792 to"),
            ("dpram:///dev/uio0?stride=4&width=16&size=3071", "size must be a whole number from 3072 to"),
            ("dpram:///dev/uio0?offset=400h", "offset must be a whole number from 0 to 16776448, not '400h'"),
            ("dpram:///dev/uio0?offset=0x1000000", "offset must be a whole number from 0 to"),
            ("dpram:///dev/uio0?map=5", "map must be a whole number from 0 to 4, not '5'"),
            ("dpram:///dev/uio0?stride=3", "stride must be one of 1, 2, 4, 8, not '3'"),
            ("dpram:///dev/uio0?width=64", "width must be one of 8, 16, 32, not '64'"),
            (
                "dpram:///dev/uio0?width=32&offset=2",
                "with a width of 32 and a stride of 1, offset must be a multiple of 4, not 2",
            ),
            ("dpram:///dev/uio0?stuck_ms=0", "from 1 to 60000"),
        ],
    )
    def test_an_address_that_is_not_understood_is_refused(self, address: str, reason: str) -> None:
        with pytest.raises(ValueError, match=r"^address ") as refusal:
            create(address)
        assert reason in str(refusal.value)

    @pytest.mark.parametrize(
        ("options", "stuck_s"), [("", 1.0), ("?stuck_ms=1", 0.001), ("?stuck_ms=60000", 60.0)]
    )
    def test_its_patience_is_that_of_its_address(self, options: str, stuck_s: float) -> None:
        port = create(f"dpram:///dev/uio0{options}")
        assert (port.stuck_s, Recorded(port, Recorder()).stuck_s) == (stuck_s, stuck_s)

    def test_a_pci_resource_is_named_by_its_path(self) -> None:
        port = create("dpram:///sys/bus/pci/devices/0000:03:00.0/resource0?size=4096")
        assert isinstance(port, dpram.DpramPort)
        assert port._path == "/sys/bus/pci/devices/0000:03:00.0/resource0"
        assert port.byte_time_s == 0.0
