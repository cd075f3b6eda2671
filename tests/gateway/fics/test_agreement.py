"""A command counts as done only when the robot confirms it: silence and E00 confirm nothing."""

import asyncio

import pytest

from gateway.core.errors import NoReply
from gateway.fics.agreement import query_of, same_number, tells
from gateway.fics.errors import NotDone, NotReadBack
from protocols.fics.alarms import ResetErrors
from protocols.fics.commands import ROWS, Row, of_the_robot, read
from protocols.fics.inputs_outputs import ChannelBits, SwitchOutput
from protocols.fics.jog import StopJog
from protocols.fics.moves import MoveRelative
from protocols.fics.positions import (
    BeginPositionUpload,
    ClearPositions,
    EndPositionUpload,
    StoredPosition,
    UploadPosition,
)
from protocols.fics.row import NAME_LENGTH, FicsCommand
from protocols.fics.soft_limits import SetUpperSoftLimits
from protocols.fics.speeds import GetSpeedPercent, SetSpeedPercent
from protocols.fics.stops import StopAllDecelerating, StopAllImmediately
from protocols.fics.system import SelectUnit, SetCommunicationMode
from protocols.fics.variables import GetVariable, SetVariable, VariableValue
from protocols.table import Ack
from simulator.fics.alarms import system_error
from tests.fics_plants import FicsRig, fics_rig
from tests.plants import in_virtual_time

DOWN = MoveRelative(coordinates=[None, None, -10.0])
HALF = SetSpeedPercent(percents=[50.0, None, 50.0])
DEEDS = [row for row in ROWS if not row.is_query() and not row.starts_motion]
PROVED_OTHERWISE = {
    BeginPositionUpload,
    UploadPosition,
    EndPositionUpload,
    ClearPositions,
    ResetErrors,
    StopJog,
    StopAllDecelerating,
    StopAllImmediately,
}
"""Commands that are proved by the table of positions, by the error that stands, or by standstill."""


def command_of(row: Row) -> FicsCommand[Ack]:
    """The longest example of a row."""
    text = max(row.example[::2], key=len)
    return read(text[:NAME_LENGTH], text[NAME_LENGTH:].lstrip())


def test_every_command_that_changes_something_is_read_back_or_proved_otherwise() -> None:
    assert {row for row in DEEDS if query_of(command_of(row)) is None} == PROVED_OTHERWISE
    for row in set(DEEDS) - PROVED_OTHERWISE:
        query = query_of(command_of(row))
        assert query is not None
        assert query.is_query()


SETTINGS = [row for row in DEEDS if row not in PROVED_OTHERWISE | {SetCommunicationMode}]


def unit_of(row: Row) -> int | None:
    return None if of_the_robot(row) else 1


def fitting(row: Row) -> FicsCommand[Ack]:
    """An example that a unit of three axes takes, and that changes something there."""
    text = {
        "VSO": "VSO 300,310,30",
        "SLP": "SLP 500,,100",
        "SLM": "SLM -500,,-200",
        "MSP": "MSP 170,,100",
        "MSM": "MSM -170,,-200",
        "UNT": "UNT 2",
    }.get(row.code)
    return read(text[:NAME_LENGTH], text[NAME_LENGTH:].lstrip()) if text else command_of(row)


@pytest.mark.parametrize("row", SETTINGS, ids=lambda row: row.name())
def test_in_mode_2_a_setting_whose_line_is_lost_is_not_called_done(row: Row) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(units=2, mode=2) as rig:
            await rig.robot.unit(1).status()
            command = fitting(row)
            before = rig.heard(command.text)
            rig.cable.lost_once = command.text
            with pytest.raises(NotDone, match="was sent to r1, and it tells") as lost:
                await rig.robot.ask(command, unit_of(row))
            assert lost.value.moved == "no"
            assert rig.heard(command.text) == before
            await rig.robot.ask(command, unit_of(row))
            assert rig.heard(command.text) == [*before, command.text]

    story()


@in_virtual_time
async def test_what_was_not_done_is_not_remembered_as_if_it_were() -> None:
    async with fics_rig(mode=2) as rig:
        rig.cable.lost_once = "VAO 50"
        with pytest.raises(NotDone):
            await rig.robot.ask(HALF, 1)
        proof = rig.robot.line.begin_proof()
        needs = rig.robot.known.power.kept(DOWN, rig.robot.unit(1), proof)
        async with rig.robot.line.sequence_lock.held():
            await rig.robot.conversation.prepare(needs)  # finds no loss of power in it
        assert not rig.robot.power_cycled


@in_virtual_time
async def test_in_mode_2_what_a_standing_error_hides_is_found_out_by_reading_back() -> None:
    async with fics_rig(mode=2) as rig:
        rig.touch(lambda fics, now: fics.raise_alarm(system_error(183, 12, 34), now))
        await rig.robot.ask(SetVariable(number=1, value=1.0))
        assert rig.fics.variables[1] == 1.0
        rig.cable.lost_once = "VAR V01=2"
        with pytest.raises(NotDone):
            await rig.robot.ask(SetVariable(number=1, value=2.0))


async def _lose_the_answer_to(rig: FicsRig, name: str) -> NoReply:
    rig.cable.lost_answer = name
    with pytest.raises(NoReply) as unread:
        await rig.robot.ask(HALF, 1)
    rig.cable.lost_answer = ""
    return unread.value


@in_virtual_time
async def test_what_cannot_be_read_back_was_sent_and_nobody_says_more() -> None:
    async with fics_rig(mode=2) as rig:
        error = await _lose_the_answer_to(rig, "VAO")
        assert isinstance(error, NotReadBack)
        assert error.detail.startswith("VAO 50,,50 was sent to r1, but could not be read back: ")
        assert (error.moved, error.retryable) == ("no", False)


@in_virtual_time
async def test_after_a_stop_nothing_is_read_back_whose_end_the_stop_would_wait_for() -> None:
    async with fics_rig(mode=2, baud=4800) as rig:
        setting = asyncio.create_task(rig.robot.ask(HALF, 1))
        await rig.cable.written_from("VAO 50")
        stop = rig.robot.stop("immediate")
        with pytest.raises(NoReply):
            await setting
        assert (await stop).state == "confirmed"
        assert "VAO" not in rig.heard("VAO")[1:]


@pytest.mark.parametrize("mode", [2, 3])
def test_a_change_gives_what_the_robot_tells_then(mode: int) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(mode=mode) as rig:
            assert (await rig.robot.change(HALF, 1)).percents == [50.0, 100.0, 50.0]
            rig.cable.lost_once = "VAR V05="
            with pytest.raises(NotDone, match=r"VAR V05=2 was sent to r1, and it tells VAR V05=\+0"):
                await rig.robot.change(SetVariable(number=5, value=2.0))

    story()


@in_virtual_time
async def test_in_mode_3_a_copy_of_an_answer_proves_no_change_that_is_read_back() -> None:
    async with fics_rig() as rig:
        rig.cable.lost_once = "IOT"
        switching = asyncio.create_task(rig.robot.change(SwitchOutput(channel=1, bit=7, on=True)))
        await rig.cable.written_from("IOT")
        rig.cable._deliver(b"IOT\r")  # of an earlier one, for all the gateway knows
        with pytest.raises(NotDone):
            await switching
        assert rig.fics.outputs[0] == 0


def test_a_reply_tells_a_setting_where_every_axis_agrees_that_was_named() -> None:
    told = GetSpeedPercent().read_reply("50.0,100.0,50.0")
    assert tells(HALF, told)
    assert not tells(SetSpeedPercent(percents=[50.0, 50.0]), told)
    assert not tells(SetSpeedPercent(percents=[50.0, None, None, 50.0]), told)
    assert not tells(SetSpeedPercent(percents=[50.01]), told)
    assert tells(SwitchOutput(channel=1, bit=7, on=True), ChannelBits(bits=0x80))
    assert not tells(SwitchOutput(channel=1, bit=7, on=False), ChannelBits(bits=0x80))
    assert tells(SetVariable(number=1, value=0.1), VariableValue(number=1, value=0.1))
    assert not tells(SelectUnit(unit=2), GetVariable(number=1).read_reply("V01=+2"))


@pytest.mark.parametrize(
    ("sent", "found", "same"),
    [(1.005, 1.0, True), (1.005, 1.01, True), (1.0, 1.01, False), (1.0, 0.99, False), (-1.005, -1.01, True)],
)
def test_coordinates_agree_where_they_differ_by_less_than_is_displayed(
    sent: float, found: float, same: bool
) -> None:
    assert same_number(sent, found, 0.01) is same
    limit = SetUpperSoftLimits(coordinates=[sent])
    assert tells(limit, StoredPosition(coordinates=[found])) is same


def test_numbers_of_32_bits_are_not_told_from_their_neighbours() -> None:
    assert same_number(99_999_999.0, 100_000_000.0)
    assert not same_number(100.0, 100.1)


@in_virtual_time
async def test_in_mode_3_a_command_that_was_garbled_on_its_way_is_not_called_done() -> None:
    """Its answer repeats the name alone (C-HOST manual 1-1-1)."""
    async with fics_rig() as rig:
        rig.cable.damaged = {"VAO 50,,50": "VAO 70,,50"}
        with pytest.raises(NotDone, match=r"it tells VAO 70\.0,100\.0,50\.0"):
            await rig.robot.ask(HALF, 1)


@pytest.mark.parametrize("mode", [2, 3])
def test_a_setting_whose_reading_alone_is_garbled_is_done(mode: int) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(mode=mode) as rig:
            rig.cable.misread = {"VAO 50.0,100.0,50.0": "VAO 70.0,100.0,50.0"}
            await rig.robot.ask(HALF, 1)
            assert rig.cable.misread == {}
            assert len(rig.heard("VAO 50,,50")) == 1

    story()
