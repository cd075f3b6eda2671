"""Invariants while power, answers, units or the teaching terminal misbehave."""

import asyncio
from random import Random
from typing import Literal

import pytest

from gateway.core.errors import ControllerRefused, NoReply, NotSent, PowerCycled, StoppedFirst
from gateway.core.exchange import Lane
from gateway.core.move_record import MoveStatus
from gateway.fics.errors import NotHomed, UnitNotSelected, UploadBrokenOff
from protocols.fics.alarms import TakeCurrentError
from protocols.fics.homing import HomeRobot
from protocols.fics.inputs_outputs import SwitchOutput
from protocols.fics.jog import StepAxis, StopJog
from protocols.fics.motor_axes import MoveMotorsAbsolute, MoveMotorsRelative
from protocols.fics.moves import MoveAbsolute, MoveRelative, MoveToPosition
from protocols.fics.speeds import SetSpeedPercent
from protocols.fics.status import AxisStatus
from protocols.fics.variables import GetVariable, SetVariable, VariableValue
from simulator.faults import Direction, Fault
from simulator.fics.alarms import system_error
from simulator.fics.line import SimulatedFics
from simulator.fics.settings import RobotSettings
from tests.fics_plants import FicsRig, fics_rig
from tests.plants import in_virtual_time

LONG_MOVE = MoveAbsolute(coordinates=[200.0, 60.0])
SLOW = SetSpeedPercent(percents=[0.5, 0.5, 0.5])


async def under_way(rig: FicsRig) -> str:
    """Home the robot, then start a move of many seconds."""
    await rig.move(HomeRobot())
    await rig.robot.ask(SLOW, 1)
    move = await rig.start(LONG_MOVE)
    assert move.status is MoveStatus.MOVING
    return move.id


@in_virtual_time
async def test_h01_after_a_power_cycle_nothing_moves_until_somebody_knows_of_it() -> None:
    async with fics_rig() as rig:
        await rig.move(HomeRobot())
        rig.power_cycle()
        with pytest.raises(PowerCycled):
            await rig.move(LONG_MOVE)
        await asyncio.sleep(1)
        assert rig.robot.power_cycled
        assert rig.fics.mode == 3
        assert rig.types("robot.power_cycled") == ["robot.power_cycled"]
        with pytest.raises(PowerCycled):
            await rig.move(MoveRelative(coordinates=[None, None, 1.0]))
        assert rig.heard("LM") == []
        await rig.robot.ask(SLOW, 1)
        rig.robot.known.power.acknowledge()
        assert (await rig.move(HomeRobot())).status is MoveStatus.SUCCEEDED


@in_virtual_time
async def test_h01_a_power_cycle_is_noticed_even_when_nothing_is_asked() -> None:
    async with fics_rig() as rig:
        rig.power_cycle()
        await asyncio.sleep(6)
        assert rig.types("robot.power") == ["robot.power_cycled"]
        assert rig.fics.mode == 3


@pytest.mark.parametrize("mode", [2, 3])
def test_h01_a_move_that_lost_its_power_is_lost(mode: int) -> None:
    in_virtual_time(_lose_power_in_a_move)(mode)


async def _lose_power_in_a_move(mode: int) -> None:
    async with fics_rig(mode=mode) as rig:
        move_id = await under_way(rig)
        rig.power_cycle()
        move = await rig.plant.robot_moves.wait(move_id, 60)
        assert (move.status, move.end_cause) == (MoveStatus.LOST, "power_cycled")
        assert rig.robot.power_cycled
        assert rig.types("robot.power") == ["robot.power_cycled"]


@in_virtual_time
async def test_h02_without_a_verified_unit_nothing_moves() -> None:
    async with fics_rig(units=2) as rig:
        await rig.move(HomeRobot())
        rig.fail(Fault.LOST, Direction.REPLIES, 1000)
        with pytest.raises(NotSent):
            await rig.move(MoveRelative(coordinates=[1.0]), unit=2)
        assert rig.heard("LM") == []


@in_virtual_time
async def test_h02_a_unit_that_the_robot_did_not_hear_is_selected_again_or_nothing_moves() -> None:
    async with fics_rig(units=2) as rig:
        await rig.robot.unit(1).status()
        await rig.robot.unit(2).status()
        assert rig.fics.host_unit == 2
        rig.cable.lost_command = "UNT 1"
        with pytest.raises(UnitNotSelected):
            await rig.robot.unit(1).position()
        rig.cable.lost_command = ""
        assert (await rig.robot.unit(1).position()) == {"X": None, "Y": None, "Z": None}
        assert rig.fics.host_unit == 1


@in_virtual_time
async def test_h03_a_unit_changed_behind_our_back_is_noticed_before_the_move() -> None:
    async with fics_rig(units=2) as rig:
        await rig.move(HomeRobot())
        rig.fics.host_unit = 2
        move = await rig.move(MoveRelative(coordinates=[None, None, -1.0]), unit=1)
        assert move.status is MoveStatus.SUCCEEDED
        assert rig.types("robot.unit") == ["robot.unit.changed"]
        assert [fact.body for fact in rig.stops()][-1] == 1


@in_virtual_time
async def test_h04_an_upload_left_open_by_an_earlier_life_is_closed_first() -> None:
    def left_open(machine: SimulatedFics) -> None:
        machine.receive(b"MOD 3\rPOF 1\r", 0.0)
        machine.take_output(0.0)
        assert machine.robot.upload is not None

    async with fics_rig(prepare=left_open) as rig:
        assert rig.robot.line.state == "ready"
        assert rig.fics.upload is None
        assert (await rig.robot.stop("immediate")).state == "confirmed"


@pytest.mark.parametrize("mode", [2, 3])
def test_h04_an_upload_whose_end_was_refused_takes_neither_the_robot_nor_its_stops_away(mode: int) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(mode=mode) as rig:
            uploading = asyncio.create_task(
                rig.robot.upload_positions([(number, [float(number)]) for number in range(1, 9)])
            )
            await rig.cable.written_from("POS 3")
            rig.edit(True)
            with pytest.raises(UploadBrokenOff):
                await uploading
            assert rig.fics.upload is not None
            rig.edit(False)
            assert (await rig.robot.unit(1).position()) == {"X": None, "Y": None, "Z": None}
            assert rig.fics.upload is None
            assert (await rig.robot.stop("immediate")).state == "confirmed"
            assert rig.types("robot.o") == []

    story()


@pytest.mark.parametrize("mode", [2, 3])
def test_h04_a_stop_ends_an_upload_that_is_open_behind_our_back(mode: int) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(mode=mode) as rig:
            rig.touch(lambda fics, _: setattr(fics, "upload", 5))
            sent = len(rig.cable.written)
            await rig.robot.stop("immediate")
            await asyncio.sleep(5)
            assert rig.types("robot.stop")[-1] == "robot.stop.confirmed"
            assert rig.fics.upload is None
            assert "POF 2" in rig.cable.frames(sent)
            assert {event.data["error"] for event in rig.events("robot.stop.refused")} == {"E03"}
            assert (await rig.robot.stop("immediate")).state == "confirmed"
            assert rig.fics.alarm is not None  # this AES was taken

    story()


@pytest.mark.parametrize("mode", [2, 3])
def test_h05_a_stop_in_an_upload_closes_it_first(mode: int) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(mode=mode, baud=9600) as rig:
            positions = [(number, [float(number), 0.0, 0.0]) for number in range(1, 200)]
            upload = asyncio.create_task(rig.robot.upload_positions(positions))
            await asyncio.sleep(0.5)
            assert rig.fics.upload is not None
            before = len(rig.cable.written)
            stop = rig.robot.stop("immediate")
            with pytest.raises(UploadBrokenOff) as broken_off:
                await upload
            stored = len(rig.fics.unit.positions)
            told = {
                3: f"up to {stored} were sent",
                2: f"up to {stored - 1} were sent",
            }  # silence proves none
            assert told[mode] in broken_off.value.detail
            assert (await stop).state == "confirmed"
            assert rig.cable.frames(before)[:2] in (["POF 2", "AES"], ["AES"])
            frames = rig.cable.frames()
            assert frames[frames.index("AES") - 1] == "POF 2"
            assert not [text for text in rig.cable.frames(before) if text.startswith("POS")]
            assert rig.fics.upload is None
            assert rig.fics.alarm is not None

    story()


@pytest.mark.parametrize("units", [1, 2])
@pytest.mark.parametrize("mode", [2, 3])
def test_h06_a_stop_refused_by_the_teaching_terminal_is_never_called_confirmed(mode: int, units: int) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(mode=mode, units=units) as rig:
            await under_way(rig)
            rig.fics.editing = True
            report = await rig.robot.stop("immediate")
            assert report.state != "confirmed"
            assert "use the hardware stop" in str(report.detail)
            assert {"robot.stop.refused", "robot.stop.unconfirmed"} <= set(rig.types("robot.stop"))
            assert (await rig.robot.stop("immediate")).state != "confirmed"
            assert len(rig.heard("AES")) > 5
            rig.fics.editing = False
            assert (await rig.robot.stop("immediate")).state == "confirmed"

    story()


@in_virtual_time
async def test_h06_in_mode_2_the_refusal_of_a_stop_is_heard_before_units_are_selected() -> None:
    async with fics_rig(mode=2, units=2) as rig:
        await rig.robot.unit(1).status()
        rig.edit(True)
        sent = len(rig.cable.written)
        rig.robot.stop("immediate")
        await asyncio.sleep(0.3)
        (refused,) = rig.events("robot.stop.refused")
        assert refused.data["error"] == "E03"
        said = [frame for frame in rig.cable.frames(sent) if not frame.startswith("VAR")]
        assert said[:2] == ["AES", "ERR"]


@in_virtual_time
@pytest.mark.parametrize("aes", ["overtakes", "refused"])
async def test_h07_an_immediate_stop_while_axes_brake_is_confirmed_refused_or_not(
    aes: Literal["overtakes", "refused"],
) -> None:
    async with fics_rig() as rig:
        rig.fics.settings = RobotSettings(stop_while_braking=aes)
        await rig.move(HomeRobot())
        await rig.robot.ask(SetSpeedPercent(percents=[20, 20]), 1)
        move_id = (await rig.start(LONG_MOVE)).id
        await asyncio.sleep(0.3)
        first = rig.robot.stop("decelerate")
        second = rig.robot.stop("immediate")
        assert (await second).state == "confirmed"
        assert (await first).state == "confirmed"
        refused = any(fact.facts["answers"] == ["AES E04"] for fact in rig.machine.truth.of("command"))
        assert refused is (aes == "refused")
        assert rig.types("robot.stop.refused") == ["robot.stop.refused"] * refused
        assert rig.plant.robot_moves.get(move_id).status is MoveStatus.STOPPED


@in_virtual_time
async def test_h08_the_answer_to_the_stop_comes_before_that_of_the_move() -> None:
    async with fics_rig() as rig:
        move_id = await under_way(rig)
        await rig.robot.stop("immediate")
        move = await rig.plant.robot_moves.wait(move_id, 5)
        assert (move.status, move.end_cause, move.completion) == (
            MoveStatus.STOPPED,
            "stop_command",
            "reply",
        )
        assert rig.robot.latched_error is not None
        assert rig.types("robot.error") == ["robot.error"]


@in_virtual_time
async def test_h09_in_mode_2_silence_is_no_error_and_the_end_is_inferred() -> None:
    async with fics_rig(mode=2) as rig:
        move_id = await under_way(rig)
        move = await rig.plant.robot_moves.wait(move_id, 600)
        assert (move.status, move.completion) == (MoveStatus.SUCCEEDED, "inferred")
        assert rig.robot.line.counters["timeouts"] == 0


@in_virtual_time
async def test_h10_a_lost_error_is_never_asked_for_again_but_found_in_the_details() -> None:
    async with fics_rig() as rig:
        rig.touch(lambda fics, now: fics.raise_alarm(system_error(183, 1, 2), now))
        asked = len(rig.heard("ERR"))
        rig.lose_replies()
        await rig.robot.conversation.poll_error()
        assert len(rig.heard("ERR")) == asked + 1
        assert rig.robot.latched_error is not None
        assert rig.robot.latched_error.code == "183"


@in_virtual_time
async def test_h10_all_who_ask_hear_that_the_error_is_gone() -> None:
    async with fics_rig() as rig:
        rig.cable.lost_answer = "ERR"
        with pytest.raises(NoReply) as lost:
            await rig.robot.ask(TakeCurrentError())
        assert "ERD" in lost.value.remedy


@in_virtual_time
async def test_h11_an_unhomed_axis_has_no_position_and_takes_no_absolute_move() -> None:
    async with fics_rig() as rig:
        assert await rig.robot.unit(1).position() == {"X": None, "Y": None, "Z": None}
        assert await rig.robot.unit(1).why_unknown(await rig.robot.unit(1).position()) == dict.fromkeys(
            "XYZ", "not_homed"
        )
        for command in (LONG_MOVE, MoveToPosition(position=1), MoveMotorsAbsolute(coordinates=[None, 5.0])):
            with pytest.raises(NotHomed, match="is not known, for it is not homed"):
                await rig.move(command)
        with pytest.raises(NotHomed):
            await rig.move(StepAxis(axis="X", steps=1))  # converted: C-HOST manual 2-3
        assert [rig.heard(name) for name in ("LMA", "POM", "MMA", "JTE")] == [[], [], [], []]


@in_virtual_time
async def test_h11_what_needs_no_position_moves_unhomed() -> None:
    async with fics_rig() as rig:
        for command in (
            MoveMotorsRelative(coordinates=[1.0, 1.0]),
            MoveRelative(coordinates=[None, None, -1.0]),
            StepAxis(axis="Z", steps=-5),
            HomeRobot(),
        ):
            assert (await rig.move(command)).status is MoveStatus.SUCCEEDED, command


@in_virtual_time
async def test_h12_a_move_of_minutes_is_followed_to_its_end() -> None:
    async with fics_rig() as rig:
        move_id = await under_way(rig)
        began = asyncio.get_running_loop().time()
        move = await rig.plant.robot_moves.wait(move_id, 600)
        assert asyncio.get_running_loop().time() - began > 30
        assert (move.status, move.completion, move.position) == (
            MoveStatus.SUCCEEDED,
            "reply",
            {"X": 200.0, "Y": 60.0, "Z": 0.0},
        )


@in_virtual_time
async def test_h14_a_port_that_takes_nothing_is_told_and_a_stop_through_it_is_not_called_sent() -> None:
    async with fics_rig() as rig:
        rig.cable.stuck = True
        sent = len(rig.cable.written)
        report = await rig.robot.stop("immediate")
        assert report.state == "not_sent"
        assert "AES" not in rig.cable.frames(sent)
        assert "line.down" in rig.types("line")
        rig.cable.stuck = False
        await asyncio.sleep(10)
        assert rig.robot.line.state == "ready"
        assert rig.types("robot.stop")[-1] == "robot.stop.confirmed"


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("mode", [2, 3])
def test_on_a_bad_line_every_answer_given_is_true(mode: int, seed: int) -> None:
    in_virtual_time(_read_on_a_bad_line)(mode, seed)


async def _read_on_a_bad_line(mode: int, seed: int) -> None:
    """Variables hold their own numbers; whatever is read while frames are hit must be one of them."""
    dice = Random(seed)
    async with fics_rig(mode=mode, options="late_reply_s = 1.0", seed=seed) as rig:
        rig.fics.variables = [float(number) for number in range(100)]
        rig.spoil(0.03)
        told = 0
        for _ in range(60):
            number = dice.randrange(100)
            try:
                reply = await rig.robot.ask(GetVariable(number=number))
            except (NoReply, NotSent, ControllerRefused):
                await asyncio.sleep(1)
                continue
            assert reply == VariableValue(number=number, value=float(number))
            told += 1
        rig.machine.faults.clear()
        await asyncio.sleep(20)
        assert told > 30
        assert rig.robot.line.state == "ready"
        assert rig.fics.mode == mode


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("mode", [2, 3])
def test_on_a_bad_line_no_move_is_called_what_it_is_not(mode: int, seed: int) -> None:
    in_virtual_time(_move_on_a_bad_line)(mode, seed)


async def _move_on_a_bad_line(mode: int, seed: int) -> None:
    async with fics_rig(mode=mode, seed=seed) as rig:
        await rig.move(HomeRobot())
        rig.spoil(0.02)
        moved = 0
        for number in range(12):
            depth = -float(number % 5 + 1)
            sent = len(rig.cable.written)
            try:
                move = await rig.move(MoveAbsolute(coordinates=[None, None, depth]))
            except (NotSent, ControllerRefused):
                await asyncio.sleep(2)
                continue
            place = rig.fics.units[1].at_rest()[2] if rig.fics.job is None else None
            if move.status is MoveStatus.SUCCEEDED:
                assert place == pytest.approx(depth)
                moved += 1
            assert rig.cable.frames(sent).count(f"LMA ,,{depth:g}") == 1
        assert moved > 4


@in_virtual_time
async def test_an_answer_that_stays_away_does_not_keep_a_move_open() -> None:
    async with fics_rig() as rig:
        await rig.move(HomeRobot())
        move = await rig.start(MoveRelative(coordinates=[None, None, -5.0]))
        rig.cable.lost_answer = "LMI"
        move = await rig.plant.robot_moves.wait(move.id, 60)
        assert (move.status, move.completion) == (MoveStatus.SUCCEEDED, "inferred")
        assert rig.robot.line.state in ("ready", "out_of_step")
        assert isinstance((await rig.robot.unit(1).status())["Z"], AxisStatus)


@in_virtual_time
async def test_a_lost_command_is_found_out_by_axes_that_have_not_moved() -> None:
    async with fics_rig() as rig:
        await rig.move(HomeRobot())
        rig.cable.lost_command = "LMA"
        move = await rig.move(MoveAbsolute(coordinates=[150.0, 140.0]))
        assert (move.status, move.end_cause) == (MoveStatus.FAILED, "not_executed")
        assert move.error is not None
        assert move.error.moved == "no"


@in_virtual_time
async def test_a_robot_that_falls_silent_is_told_once_and_comes_back() -> None:
    async with fics_rig() as rig:
        rig.machine.power_off(asyncio.get_running_loop().time())
        await asyncio.sleep(20)
        assert not rig.robot.online
        rig.machine.power_on(asyncio.get_running_loop().time())
        await asyncio.sleep(10)
        assert rig.robot.online
        assert rig.robot.power_cycled
        assert rig.types("robot.o") == ["robot.offline", "robot.online"]


@in_virtual_time
async def test_a_move_is_followed_on_after_its_line_was_gone() -> None:
    async with fics_rig() as rig:
        move_id = await under_way(rig)
        await asyncio.sleep(1)
        rig.cable.unplug()
        await asyncio.sleep(3)
        assert rig.plant.robot_moves.get(move_id).status is MoveStatus.MOVING
        rig.cable.plugged_in = True
        move = await rig.plant.robot_moves.wait(move_id, 600)
        assert (move.status, move.completion) == (MoveStatus.SUCCEEDED, "inferred")
        assert "The axes stand at the target." in move.evidence


@in_virtual_time
async def test_what_was_sent_before_a_stop_and_not_written_is_never_written() -> None:
    async with fics_rig(baud=9600) as rig:
        await rig.move(HomeRobot())
        move = asyncio.create_task(rig.move(MoveRelative(coordinates=[None, None, -5.0])))
        await asyncio.sleep(0.001)
        report = await rig.robot.stop("immediate")
        with pytest.raises(StoppedFirst):
            await move
        assert report.state == "confirmed"
        assert rig.heard("LMI") == []


@in_virtual_time
async def test_a_garbled_answer_is_asked_for_again_after_a_fence() -> None:
    async with fics_rig() as rig:
        await rig.robot.unit(1).position()
        sent = len(rig.cable.written)
        rig.fail(Fault.NOISE, Direction.REPLIES)
        assert await rig.robot.unit(1).position("motor") == {"A": None, "B": None, "Z": None}
        spoken = [text[:3] for text in rig.cable.frames(sent)]
        assert spoken in (["MPS", "VAR", "MPS"], ["MPS"])
        assert spoken == ["MPS", "VAR", "MPS"]


@in_virtual_time
async def test_a_late_answer_is_not_taken_for_that_of_the_next_query() -> None:
    async with fics_rig() as rig:
        await rig.robot.ask(SetVariable(number=1, value=1.0))
        rig.fail(Fault.LATE, Direction.REPLIES, delay_s=0.7)
        assert await rig.robot.ask(GetVariable(number=1)) == VariableValue(number=1, value=1.0)
        await asyncio.sleep(5)
        assert rig.robot.line.state == "ready"


@in_virtual_time
async def test_a_setting_whose_answer_is_lost_is_read_back_and_not_sent_again() -> None:
    async with fics_rig() as rig:
        rig.cable.lost_answer = "IOT"
        await rig.robot.ask(SwitchOutput(channel=1, bit=0, on=True))
        assert rig.fics.outputs[0] == 1
        assert len(rig.heard("IOT")) == 1


@in_virtual_time
async def test_in_mode_2_the_refusal_of_a_forsaken_command_is_not_taken_for_that_of_the_next() -> None:
    async with fics_rig(mode=2, baud=9600) as rig:
        await rig.robot.unit(1).position()
        line = rig.robot.line
        line.submit(line.exchange(StopJog(axis="Z"), Lane.STOP))  # the port is busy with it
        forsaken = asyncio.create_task(rig.robot.ask(SetSpeedPercent(percents=[1, 1, 1, 1]), 1))
        await rig.cable.written_from("VAO")
        forsaken.cancel()
        await asyncio.sleep(0.1)
        await rig.robot.ask(SetVariable(number=1, value=1.0))
        assert rig.fics.variables[1] == 1.0
        assert len(rig.heard("VAO")) == 1
