"""Errors of the system: read by the gateway alone, kept, published and reset."""

import asyncio

import pytest

from gateway.core.errors import ControllerRefused
from gateway.fics.errors import ErrorRemains, ErrorStands, NotReadBack
from gateway.fics.watch import HEALTH_POLL_S
from protocols.fics.moves import MoveRelative
from protocols.fics.variables import SetVariable
from simulator.fics.alarms import connection_lost, system_error
from simulator.fics.robot import Robot as SimulatedRobot
from tests.fics_plants import FicsRig, fics_rig
from tests.plants import in_virtual_time

BOTH_MODES = pytest.mark.parametrize("mode", [2, 3])
DOWN = MoveRelative(coordinates=[None, None, -5.0])


def fall_ill(rig: FicsRig) -> None:
    """Let an error of the system arise."""
    rig.touch(lambda fics, now: fics.raise_alarm(system_error(183, 12, 34), now))


@BOTH_MODES
def test_an_error_of_the_system_is_kept_published_and_reset(mode: int) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(mode=mode) as rig:
            fall_ill(rig)
            await rig.robot.conversation.poll_error()
            record = rig.robot.latched_error
            assert record is not None
            assert (record.code, record.kind) == ("183", "fics")
            assert rig.types("robot.error") == ["robot.error"]
            with pytest.raises(ErrorStands):
                await rig.move(DOWN)
            await rig.robot.conversation.reset_errors()
            assert rig.robot.latched_error is None
            assert (await rig.move(DOWN)).status == "succeeded"

    story()


def silence_motor_a(fics: SimulatedRobot, now: float) -> None:
    """The driver of motor A of unit 1 stops answering."""
    motor = fics.units[1].motors[0]
    motor.silent = True
    fics.raise_alarm(connection_lost(1, motor.name), now)


@in_virtual_time
async def test_an_error_whose_cause_is_there_stands_after_a_reset() -> None:
    async with fics_rig() as rig:
        rig.fics.stop_input = True
        await rig.robot.stop("immediate")
        with pytest.raises(ErrorRemains) as remains:
            await rig.robot.conversation.reset_errors()
        assert remains.value.moved == "no"
        assert remains.value.detail == (
            "DRT of r1 ended with error 001: The robot is in the state EMERGENCY: its stop input is on, or "
            "AES was received."
        )
        assert remains.value.detail_ja == "DRT: 非常停止状態です。"
        assert remains.value.remedy == "Release the stop input, then reset the error with DRT."
        assert rig.robot.latched_error is not None


@in_virtual_time
async def test_a_driver_that_is_silent_after_a_reset_is_named() -> None:
    async with fics_rig(units=2) as rig:
        rig.touch(silence_motor_a)
        with pytest.raises(ErrorRemains, match="The driver of axis A of unit 1 does not answer"):
            await rig.robot.conversation.reset_errors()


@in_virtual_time
async def test_a_reset_after_which_the_errors_are_not_told_does_not_say_that_nothing_was_sent() -> None:
    async with fics_rig() as rig:
        rig.cable.lost_answer = "ERR"
        with pytest.raises(NotReadBack, match="errors of r1 were reset, but could not be read back"):
            await rig.robot.conversation.reset_errors()
        assert rig.heard("DRT") == ["DRT"]


@BOTH_MODES
@pytest.mark.parametrize("units", [1, 2])
def test_an_error_that_arises_while_nothing_is_done_is_found_and_told_once(mode: int, units: int) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(mode=mode, units=units) as rig:
            fall_ill(rig)
            await asyncio.sleep(2 * HEALTH_POLL_S + 1)
            assert rig.robot.latched_error is not None
            assert rig.robot.latched_error.code == "183"
            assert rig.types("robot.error") == ["robot.error"]

    story()


@in_virtual_time
async def test_in_mode_2_an_error_that_stands_is_not_the_outcome_of_an_innocent_command() -> None:
    async with fics_rig(mode=2, units=2) as rig:
        await rig.robot.unit(1).position()
        fall_ill(rig)
        await rig.robot.ask(SetVariable(number=1, value=1.0))
        assert rig.fics.variables[1] == 1.0
        (told,) = rig.events("robot.error")
        assert (told.data["code"], told.data["kind"]) == ("183", "fics")


@in_virtual_time
async def test_in_mode_2_units_are_selected_and_read_while_an_error_nobody_knew_of_stands() -> None:
    async with fics_rig(mode=2, units=2) as rig:
        await rig.robot.unit(1).position()
        fall_ill(rig)
        await rig.robot.unit(2).position()
        assert rig.robot.known.unit.number == rig.fics.host_unit == 2
        assert rig.types("robot.error") == ["robot.error"]


@in_virtual_time
async def test_in_mode_2_no_motion_is_sent_into_an_error_nobody_knew_of() -> None:
    async with fics_rig(mode=2) as rig:
        fall_ill(rig)
        with pytest.raises(ErrorStands, match="LMI was not sent"):
            await rig.move(DOWN)
        assert rig.heard("LMI") == []
        assert rig.types("robot.error") == ["robot.error"]


@in_virtual_time
async def test_a_motion_that_is_refused_because_of_an_alarm_leads_to_its_error() -> None:
    async with fics_rig() as rig:
        fall_ill(rig)
        with pytest.raises(ControllerRefused) as refused:
            await rig.move(DOWN)
        assert refused.value.error_code == "E02"
        await asyncio.sleep(0.5)
        assert rig.robot.latched_error is not None
        assert rig.types("robot.error") == ["robot.error"]


@in_virtual_time
async def test_an_error_reset_at_the_robot_no_longer_stands() -> None:
    async with fics_rig() as rig:
        fall_ill(rig)
        await asyncio.sleep(HEALTH_POLL_S)
        rig.touch(lambda fics, _: fics.reset())
        await asyncio.sleep(HEALTH_POLL_S)
        assert rig.robot.latched_error is None
        (reset,) = rig.events("robot.errors.reset")
        assert reset.data == {"by": "elsewhere"}


@in_virtual_time
async def test_an_error_is_not_told_again_where_the_answer_that_names_it_is_lost() -> None:
    async with fics_rig() as rig:
        fall_ill(rig)
        await rig.robot.conversation.poll_error()
        rig.lose_replies()
        await rig.robot.conversation.poll_error()
        assert rig.types("robot.error") == ["robot.error"]


@in_virtual_time
async def test_in_mode_2_an_error_in_the_middle_of_an_upload_is_kept_and_nothing_else_is_asked() -> None:
    async with fics_rig(mode=2, baud=9600) as rig:
        sent = len(rig.cable.written)
        positions = [(number, [float(number), 0.0, 0.0]) for number in range(1, 50)]
        upload = asyncio.create_task(rig.robot.upload_positions(positions))
        await rig.cable.written_from("POS")
        fall_ill(rig)
        await asyncio.wait({upload})
        assert upload.exception() is not None
        assert rig.types("robot.error") == ["robot.error"]
        frames = rig.cable.frames(sent)
        opened = frames[: frames.index("POF 2")]
        assert "ERD" not in opened
        assert rig.fics.upload is None


@in_virtual_time
async def test_in_mode_2_a_refusal_that_the_error_has_hidden_is_not_that_of_its_reset() -> None:
    async with fics_rig(mode=2) as rig:
        fall_ill(rig)
        rig.cable._arrive(b"POF 2\r")  # as a fence leaves it: refused with E08, which the error hides
        await rig.robot.conversation.poll_error()
        await rig.robot.conversation.reset_errors()
        assert rig.robot.latched_error is None
        assert [event.data for event in rig.events("robot.errors.reset")] == [{"by": "gateway"}]
        assert (await rig.move(DOWN)).status == "succeeded"


@in_virtual_time
async def test_in_mode_2_a_reset_that_was_lost_on_its_way_leaves_the_error() -> None:
    async with fics_rig(mode=2) as rig:
        fall_ill(rig)
        await rig.robot.conversation.poll_error()
        rig.cable.lost_once = "DRT"
        with pytest.raises(ErrorRemains):
            await rig.robot.conversation.reset_errors()
        assert rig.robot.latched_error is not None


@BOTH_MODES
def test_an_error_is_not_said_to_be_reset_before_the_robot_says_so(mode: int) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(mode=mode) as rig:
            fall_ill(rig)
            await rig.robot.conversation.poll_error()
            rig.cable.lost_once = "DRT"
            resetting = asyncio.create_task(rig.robot.conversation.reset_errors())
            await rig.cable.written_from("DRT")
            if mode == 3:
                rig.cable._deliver(b"DRT\r")  # a copy of an earlier answer
            with pytest.raises(ErrorRemains):
                await resetting
            assert rig.types("robot.error") == ["robot.error"]
            assert rig.robot.latched_error is not None

    story()


@in_virtual_time
async def test_in_mode_2_a_refusal_that_an_error_has_hidden_is_not_that_of_the_next_command() -> None:
    async with fics_rig(mode=2) as rig:
        fall_ill(rig)
        rig.cable._arrive(b"POF 2\r")
        await rig.robot.conversation.poll_error()
        setting = asyncio.create_task(rig.robot.ask(SetVariable(number=1, value=1.0)))
        await rig.cable.written_from("VAR")
        rig.touch(lambda fics, _: fics.reset())  # at the teaching terminal
        await setting
        assert rig.fics.variables[1] == 1.0
