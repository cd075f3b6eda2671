"""Knowledge of the positions in flash memory, story by story."""

import asyncio

import pytest

from gateway.rorze.knowledge import FlashPositions
from gateway.rorze.positions import WantedPosition, read_one, store
from protocols.rorze.flash import EraseFlash, LoadPositions, SavePositions
from protocols.rorze.inputs_outputs import SetInterruptAction
from protocols.rorze.notation import PositionReference
from protocols.rorze.position_table import (
    AddToPositionEntry,
    ClearPositionEntries,
    GetNumberedPositionEntry,
    NumberedPositionEntry,
    SetPositionEntry,
)
from protocols.rorze.programs import RunProgram
from protocols.rorze.row import RorzeCommand
from protocols.rorze.stops import StopImmediately
from protocols.table import Ack
from tests.plants import in_virtual_time, rig

SEVEN = PositionReference(position=7)


def entry(number: int, pulses: int) -> NumberedPositionEntry:
    return NumberedPositionEntry(position=number, pulses=pulses)


def saved() -> FlashPositions:
    """A body whose positions were just saved, and one of them read."""
    flash = FlashPositions()
    flash.done(SavePositions(), certain=True)
    flash.replied(GetNumberedPositionEntry(entry=SEVEN), entry(7, 100), 0.0)
    return flash


def test_nothing_is_known_before_positions_were_seen_saved_or_loaded() -> None:
    flash = FlashPositions()
    flash.replied(GetNumberedPositionEntry(entry=SEVEN), entry(7, 100), 0.0)
    assert flash.held(7) is None


def test_what_was_read_before_it_was_set_is_what_flash_memory_holds() -> None:
    flash = saved()
    flash.sent(SetPositionEntry(entry=SEVEN, pulses=500), is_known=True)
    flash.replied(GetNumberedPositionEntry(entry=SEVEN), entry(7, 500), 0.0)
    flash.replied(GetNumberedPositionEntry(entry=SEVEN), entry(8, 3), 0.0)
    assert (flash.held(7), flash.held(8)) == (100, 3)


def test_a_loss_of_power_leaves_flash_memory_as_it_was() -> None:
    flash = saved()
    flash.powered_on(certain=True)
    flash.replied(GetNumberedPositionEntry(entry=SEVEN), entry(8, 3), 0.0)
    assert (flash.held(7), flash.held(8)) == (100, None)


def test_what_is_loaded_is_the_same_in_both() -> None:
    flash = saved()
    flash.sent(SetPositionEntry(entry=PositionReference(position=8), pulses=5), is_known=True)
    flash.done(LoadPositions(), certain=True)
    flash.replied(GetNumberedPositionEntry(entry=SEVEN), entry(8, 3), 0.0)
    assert (flash.held(7), flash.held(8)) == (100, 3)


@pytest.mark.parametrize(
    "command",
    [
        RunProgram(),
        ClearPositionEntries(),
        AddToPositionEntry(entry=SEVEN, amount=1),
        SetPositionEntry(entry=PositionReference(position="next"), pulses=1),
        SetInterruptAction(port=8, recorded="position", number=8),
    ],
)
def test_what_may_change_a_position_unseen_teaches_nothing_more(command: RorzeCommand[Ack]) -> None:
    flash = saved()
    flash.sent(command, is_known=True)
    flash.replied(GetNumberedPositionEntry(entry=SEVEN), entry(8, 3), 0.0)
    assert (flash.held(7), flash.held(8)) == (100, None)


def test_other_commands_change_nothing() -> None:
    flash = saved()
    flash.sent(StopImmediately(), is_known=True)
    flash.replied(GetNumberedPositionEntry(entry=SEVEN), entry(8, 3), 0.0)
    assert flash.held(8) == 3


def test_what_may_change_flash_memory_itself_ends_all_knowledge() -> None:
    unknown, erased, unsure = saved(), saved(), saved()
    unknown.sent(StopImmediately(), is_known=False)
    erased.sent(EraseFlash(store="positions"), is_known=True)
    unsure.done(SavePositions(), certain=False)
    assert [flash.held(7) for flash in (unknown, erased, unsure)] == [None] * 3


@in_virtual_time
async def test_what_flash_memory_holds_comes_back_with_the_power() -> None:
    async with rig() as it:
        body = it.body()
        await store(body, [WantedPosition(7, 100)], flash=True)
        await read_one(body, 7)
        await store(body, [WantedPosition(7, 500)])
        assert ((await read_one(body, 7)).pulses, body.flash.positions.held(7)) == (500, 100)
        it.machine.brown_out(0x3F, 0.5, asyncio.get_running_loop().time())
        it.wire.turn()
        await asyncio.sleep(10.0)
        assert (await read_one(body, 7)).pulses == 100
