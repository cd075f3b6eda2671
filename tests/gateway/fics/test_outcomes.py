"""The outcome of a command: told in Ver.3, found out in Ver.2, never guessed."""

import asyncio

import pytest

from gateway.core.errors import CommandGarbled, ControllerRefused, NoReply, NotSent
from gateway.core.exchange import Lane
from gateway.core.line_state import LineState
from gateway.core.move_record import MoveStatus
from gateway.fics.errors import NotDone
from protocols.fics.homing import HomeRobot
from protocols.fics.inputs_outputs import SwitchOutput
from protocols.fics.jog import StopJog
from protocols.fics.moves import MoveRelative
from protocols.fics.speeds import SetSpeedPercent
from protocols.fics.variables import GetVariable, SetVariable
from simulator.faults import Direction, Fault
from tests.fics_plants import fics_rig
from tests.plants import in_virtual_time

DOWN = MoveRelative(coordinates=[None, None, -5.0])
SWITCH = SwitchOutput(channel=1, bit=0, on=True)


@in_virtual_time
async def test_in_mode_2_the_error_of_a_garbled_question_is_not_that_of_the_next_command() -> None:
    async with fics_rig(mode=2) as rig:
        rig.cable._arrive(b"XYZ 1\r")  # what garbling has made of a question
        rig.cable.lost_command = "VAR V01"
        with pytest.raises(NoReply):
            await rig.robot.ask(GetVariable(number=1))
        rig.cable.lost_command = ""
        await rig.robot.ask(SetVariable(number=1, value=1.0))
        assert (await rig.move(DOWN)).status == "succeeded"


@in_virtual_time
async def test_in_mode_2_nothing_is_sent_whose_refusal_nobody_could_tell() -> None:
    async with fics_rig(mode=2) as rig:
        await rig.robot.ask(SetVariable(number=1, value=1.0))
        rig.cable.lost_answer = "ERR"
        await rig.robot.ask(SetVariable(number=1, value=2.0))  # done, as is read back
        with pytest.raises(NotSent, match="did not tell its last error"):
            await rig.robot.ask(SetVariable(number=1, value=3.0))
        with pytest.raises(NotSent):
            await rig.move(DOWN)
        assert rig.fics.variables[1] == 2.0
        assert rig.heard("LMI") == []


@in_virtual_time
async def test_an_error_the_manual_does_not_name_is_no_refusal_in_mode_2() -> None:
    async with fics_rig(mode=2) as rig:
        rig.fics.refusal = 40  # type: ignore[assignment]  # as if a bit of E00 had been flipped
        await rig.robot.ask(SWITCH)
        rig.fics.refusal = 40  # type: ignore[assignment]
        rig.cable.lost_once = "IOT"
        with pytest.raises(NotDone):
            await rig.robot.ask(SwitchOutput(channel=1, bit=0, on=False))
        assert rig.fics.outputs[0] == 1


@in_virtual_time
async def test_in_mode_2_what_a_fence_has_left_refuses_no_motion() -> None:
    async with fics_rig(mode=2, baud=9600) as rig:
        await rig.move(HomeRobot())
        sent = len(rig.cable.written)
        moving = asyncio.create_task(rig.move(DOWN))
        await rig.cable.written_from("ERR")
        rig.fail(Fault.LATE, Direction.REPLIES, delay_s=0.7)
        rig.cable.lost_command = "VAR"
        await asyncio.sleep(1)
        rig.cable.lost_command = ""
        move = await moving
        frames = rig.cable.frames(sent)
        asked, said = frames.index("ERR"), frames.index("LMI ,,-5")
        assert "POF 2" in frames[asked:said]  # refused with E08, for no upload is open
        assert (move.status, move.end_cause) == (MoveStatus.SUCCEEDED, "normal")
        assert rig.fics.units[1].at_rest()[2] == pytest.approx(-5.0)


@in_virtual_time
async def test_a_refusal_that_is_doubled_refuses_nothing_else() -> None:
    async with fics_rig() as rig:
        rig.fail(Fault.DOUBLED, Direction.REPLIES, delay_s=0.0)
        with pytest.raises(ControllerRefused):
            await rig.robot.ask(SwitchOutput(channel=99, bit=0, on=True))
        await rig.robot.ask(SWITCH)
        assert rig.fics.outputs[0] == 1


@pytest.mark.parametrize(
    ("mode", "arrives"), [(2, "VAO 1p"), (2, "VQO 10"), (2, "VAO 910"), (3, "VAO 1p"), (3, "VAO 910")]
)
def test_a_command_that_the_line_has_damaged_is_not_the_mistake_of_who_sent_it(
    mode: int, arrives: str
) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(mode=mode) as rig:
            rig.cable.damaged["VAO 10"] = arrives
            with pytest.raises(CommandGarbled, match="The line has damaged it") as garbled:
                await rig.robot.ask(SetSpeedPercent(percents=[10.0]), 1)
            assert (garbled.value.moved, garbled.value.retryable) == ("no", True)
            assert [axis.percent for axis in rig.fics.units[1].users] == [100.0] * 3

    story()


@pytest.mark.parametrize("mode", [2, 3])
def test_a_move_that_the_line_has_damaged_is_rejected_as_such(mode: int) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(mode=mode) as rig:
            rig.cable.damaged["LMI ,,-5"] = "LMI ,,-u"
            with pytest.raises(CommandGarbled):
                await rig.move(DOWN)
            (move,) = rig.plant.robot_moves.log.of(rig.robot.unit(1).address)
            assert move.status is MoveStatus.REJECTED
            assert (move.error and move.error.controller_error) == "E06"
            assert rig.machine.truth.of("motion_start") == []

    story()


@in_virtual_time
async def test_who_goes_away_before_a_command_is_written_takes_it_along() -> None:
    async with fics_rig(baud=9600) as rig:
        line = rig.robot.line
        line.submit(line.exchange(StopJog(axis="Z"), Lane.STOP))  # the port is busy with it
        forsaken = asyncio.create_task(rig.robot.ask(SetVariable(number=1, value=1.0)))
        await asyncio.sleep(0.001)
        assert [lane for lane, waiting in line.waiting().items() if waiting] == ["command"]
        forsaken.cancel()
        await asyncio.wait({forsaken})
        assert not any(line.waiting().values())
        await asyncio.sleep(1)
        assert rig.heard("VAR V01=") == []


@in_virtual_time
async def test_an_error_nobody_waits_for_any_more_is_not_asked_for() -> None:
    async with fics_rig() as rig:
        rig.cable.lost_answer = "VAR"
        setting = asyncio.create_task(rig.robot.ask(SetVariable(number=1, value=1.0)))
        await asyncio.sleep(0.6)
        setting.cancel()  # the floor is free, and the line still fenced
        asked = len(rig.heard("ERR"))
        asking = asyncio.create_task(rig.robot.conversation.take_error())
        await asyncio.sleep(0.01)
        asking.cancel()
        rig.cable.lost_answer = ""
        await asyncio.sleep(2)
        assert rig.robot.line.state is LineState.READY
        assert len(rig.heard("ERR")) == asked
