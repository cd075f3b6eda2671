"""A robot's operation waits for the disk once, whatever has to be said before it begins."""

from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager

import pytest

from gateway.core.errors import PowerCycled
from gateway.core.journal.intents import Intents
from gateway.core.journal.journal import JournalUnavailable
from gateway.core.move_record import MoveStatus
from gateway.fics.errors import NotHomed
from protocols.fics.homing import HomeRobot
from protocols.fics.moves import MoveAbsolute, MoveRelative
from protocols.fics.row import FicsCommand
from protocols.fics.speeds import SetSpeedPercent
from protocols.table import Ack
from tests.fics_plants import FicsRig, fics_rig
from tests.model_book import ModelBook
from tests.plants import in_virtual_time

AWAY = MoveRelative(coordinates=[5.0])
SLOWER = SetSpeedPercent(percents=[50.0])
SECOND = 2
"""The unit that is not selected."""


@asynccontextmanager
async def kept_rig(mode: int = 3, disk_s: float = 0.005) -> AsyncIterator[tuple[FicsRig, ModelBook]]:
    """A robot of two units, and a disk that takes a moment for each commit."""
    async with fics_rig(units=2, mode=mode) as rig:
        book = ModelBook(disk_s)
        rig.robot.line.intents = Intents(book, rig.robot.line.address_of)
        yield rig, book


def intended(book: ModelBook) -> list[str]:
    return [str(intent["frame"]).rstrip("\r") for _, intent in book.intents()]


async def start(rig: FicsRig, command: FicsCommand[Ack], unit: int = 1) -> str:
    return (await rig.start(command, unit)).id


async def first_move(rig: FicsRig, book: ModelBook) -> None:
    move_id = await start(rig, AWAY, SECOND)
    assert {intent["move_id"] for _, intent in book.intents()} == {move_id}
    assert (await rig.plant.robot_moves.wait(move_id, 60.0)).status is MoveStatus.SUCCEEDED


async def setting(rig: FicsRig, _: ModelBook) -> None:
    await rig.robot.ask(SLOWER, SECOND)


async def upload(rig: FicsRig, _: ModelBook) -> None:
    await rig.robot.upload_positions([(1, [1.0]), (2, [1.0]), (20, [4.0])], SECOND)


@pytest.mark.parametrize("mode", [2, 3])
@pytest.mark.parametrize(
    ("operation", "said"),
    [
        (first_move, ["UNT 2", "LMI 5"]),
        (setting, ["UNT 2", "VAO 50"]),
        (upload, ["UNT 2", "POF 1,1", "POS 1", "POS 1", "POF 2", "POF 1,20", "POS 4", "POF 2"]),
    ],
)
def test_an_operation_waits_for_the_disk_once_though_its_unit_has_to_be_selected(
    mode: int, operation: Callable[[FicsRig, ModelBook], Awaitable[None]], said: list[str]
) -> None:
    @in_virtual_time
    async def story() -> None:
        async with kept_rig(mode) as (rig, book):
            await rig.move(HomeRobot())
            before, book.waits = len(rig.cable.written), 0
            book.durable.clear()
            await operation(rig, book)
            assert book.waits == 1
            assert intended(book) == said
            assert [frame for frame in rig.cable.frames(before) if frame in said] == said
            assert set(book.outcomes().values()) == {"answered"}

    story()


@in_virtual_time
async def test_speeds_that_are_set_again_after_a_loss_of_power_cost_no_wait_of_their_own() -> None:
    async with kept_rig() as (rig, book):
        for unit in (1, SECOND):
            await rig.robot.ask(SLOWER, unit)
        rig.power_cycle()
        with pytest.raises(PowerCycled):
            await rig.move(HomeRobot())
        rig.robot.known.power.acknowledge()
        book.waits, before = 0, len(rig.cable.written)
        await start(rig, HomeRobot())
        assert book.waits == 1
        assert [it for it in rig.cable.frames(before) if it in intended(book)][-1] == "ORG"
        again = "VAO 50,100,100"
        assert intended(book)[-5:] == [again, "UNT 2", again, "UNT 1", "ORG"]


@in_virtual_time
async def test_a_disk_that_is_slower_than_a_proof_holds_costs_a_second_proof_and_no_second_wait() -> None:
    async with kept_rig(disk_s=0.8) as (rig, book):
        await rig.move(HomeRobot())
        book.durable.clear()
        book.waits, proofs = 0, len(rig.heard("MOD"))
        await start(rig, AWAY)
        assert (book.waits, len(rig.heard("MOD")) - proofs) == (1, 2)
        assert intended(book) == rig.heard("LMI") == ["LMI 5"]


@in_virtual_time
async def test_a_move_that_is_refused_after_its_unit_was_selected_leaves_no_open_intent() -> None:
    async with kept_rig() as (rig, book):
        with pytest.raises(NotHomed):
            await start(rig, MoveAbsolute(coordinates=[5.0]), SECOND)
        assert intended(book) == ["UNT 2", "LMA 5"]
        assert list(book.outcomes().values()) == ["answered", "not_sent"]
        assert rig.heard("LMA") == []


@pytest.mark.parametrize("mode", [2, 3])
def test_without_a_disk_each_unit_is_asked_and_its_stop_proved_and_nothing_else_is_selected(
    mode: int,
) -> None:
    @in_virtual_time
    async def story() -> None:
        async with kept_rig(mode) as (rig, book):
            await rig.move(HomeRobot())
            book.trouble = "no space left"
            for unit in (SECOND, 1, SECOND):
                assert await rig.robot.unit(unit).position("user")
            report = await rig.robot.stop("decelerate")
            assert report.state == "confirmed", report
            before = len(rig.cable.written)
            for unit in (1, SECOND):
                with pytest.raises(JournalUnavailable, match="nothing was sent"):
                    await start(rig, AWAY, unit)
                with pytest.raises(JournalUnavailable, match="nothing was sent"):
                    await rig.robot.ask(SLOWER, unit)
            assert [it for it in rig.cable.frames(before) if it.startswith(("UNT ", "LMI", "VAO "))] == []

    story()
