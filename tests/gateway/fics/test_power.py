"""A robot that has lost its power: known by its mode, kept from moving, given its speeds back."""

import asyncio

import pytest

from gateway.core.errors import ControllerRefused, NoReply, NotSent, PowerCycled
from gateway.core.move_record import MoveStatus
from gateway.fics.errors import NotProved, RobotBusy, SpeedsNotRestored
from protocols.fics.homing import HomeRobot
from protocols.fics.motor_axes import GetMotorSpeedPercent, SetMotorSpeedPercent
from protocols.fics.moves import MoveRelative
from protocols.fics.speeds import GetSpeedPercent, SetSpeedPercent
from protocols.fics.status import MotionMode
from simulator.fics.alarms import system_error
from tests.fics_plants import FicsRig, fics_rig
from tests.plants import in_virtual_time

DOWN = MoveRelative(coordinates=[None, None, -5.0])
LIMIT_S = 12.0
"""Within this an idle robot has been looked at, set up and given its speeds."""


def percents(rig: FicsRig, unit: int = 1) -> list[float]:
    return [axis.percent for axis in rig.fics.units[unit].users]


async def cycle(rig: FicsRig) -> None:
    """Switch the robot off and on; let the gateway find out, and acknowledge it."""
    rig.power_cycle()
    with pytest.raises(PowerCycled):
        await rig.move(HomeRobot())
    rig.robot.known.power.acknowledge()


@pytest.mark.parametrize("units", [1, 2])
def test_h01_the_speeds_are_set_again_and_verified_before_the_first_move(units: int) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(units=units) as rig:
            for unit in range(1, units + 1):
                await rig.robot.ask(SetSpeedPercent(percents=[10.0 * unit, None, 30.0]), unit)
            await cycle(rig)
            sent = len(rig.cable.written)
            assert (await rig.move(HomeRobot())).status is MoveStatus.SUCCEEDED
            spoken = rig.cable.frames(sent)
            home = spoken.index("ORG")
            for unit in range(1, units + 1):
                assert percents(rig, unit) == [10.0 * unit, 100.0, 30.0]
                again = spoken.index(f"VAO {10 * unit},100,30")
                assert spoken[again + 1] == "VAO"
                assert again < home

    story()


@in_virtual_time
async def test_h01_speeds_that_were_only_read_are_set_again_and_the_others_are_told_to_be_gone() -> None:
    async with fics_rig(units=2) as rig:
        rig.fics.units[1].motors[0].motor_percent = 7.0
        await rig.robot.ask(GetMotorSpeedPercent(), 1)
        await rig.robot.ask(SetSpeedPercent(percents=[5.0]), 2)
        await cycle(rig)
        (lost,) = rig.events("robot.power_cycled")
        assert lost.data["speeds"] == {
            "1": {"motor": {"A": 7.0, "B": 100.0, "Z": 100.0}},
            "2": {"user": {"X": 5.0, "Y": 100.0, "Z": 100.0}},
        }
        assert lost.data["full_speed"] == {
            "1": {"user": ["X", "Y", "Z"], "motor": []},
            "2": {"user": [], "motor": ["X", "Y", "Z"]},
        }
        await rig.move(HomeRobot())
        assert rig.fics.units[1].motors[0].motor_percent == 7.0
        assert rig.types("robot.speeds") == ["robot.speeds.restored"]


@in_virtual_time
@pytest.mark.parametrize("mode", [2, 3])
async def test_h01_an_axis_that_is_user_and_motor_axis_keeps_its_two_percentages(mode: int) -> None:
    """C-HOST manual 2-15, 4-5."""
    async with fics_rig(mode=mode) as rig:
        await rig.robot.ask(SetSpeedPercent(percents=[None, None, 30.0]), 1)
        await rig.robot.ask(SetMotorSpeedPercent(percents=[None, None, 60.0]), 1)
        assert (await rig.move(HomeRobot())).status is MoveStatus.SUCCEEDED
        await cycle(rig)
        assert (await rig.move(HomeRobot())).status is MoveStatus.SUCCEEDED
        theta = rig.fics.units[1].motors[2]
        assert (theta.percent, theta.motor_percent) == (30.0, 60.0)


@in_virtual_time
async def test_h01_speeds_come_back_unasked_while_the_latch_stays() -> None:
    async with fics_rig() as rig:
        await rig.robot.ask(SetSpeedPercent(percents=[1.0, 2.0, 3.0]), 1)
        rig.power_cycle()
        await asyncio.sleep(LIMIT_S)
        assert percents(rig) == [1.0, 2.0, 3.0]
        assert rig.robot.power_cycled
        with pytest.raises(PowerCycled, match="switched off and on"):
            await rig.move(DOWN)


@in_virtual_time
async def test_h01_without_its_speeds_nothing_moves() -> None:
    async with fics_rig() as rig:
        await rig.robot.ask(SetSpeedPercent(percents=[1.0]), 1)
        await cycle(rig)
        rig.edit(True)
        with pytest.raises(ControllerRefused):
            await rig.move(DOWN)
        rig.edit(False)
        rig.cable.lost_command = "VAO"
        with pytest.raises(SpeedsNotRestored):
            await rig.move(DOWN)
        assert rig.heard("LMI") == []
        rig.cable.lost_command = ""
        assert (await rig.move(DOWN)).status is MoveStatus.SUCCEEDED
        assert percents(rig) == [1.0, 100.0, 100.0]


@in_virtual_time
async def test_a_speed_nobody_can_be_sure_of_is_not_set_again() -> None:
    async with fics_rig() as rig:
        await rig.robot.ask(SetSpeedPercent(percents=[10.0, 20.0]), 1)
        rig.cable.lost_answer = "VAO"
        with pytest.raises(NoReply):
            await rig.robot.ask(SetSpeedPercent(percents=[90.0]), 1)
        rig.cable.lost_answer = ""
        await cycle(rig)
        await rig.move(HomeRobot())
        assert percents(rig) == [100.0, 20.0, 100.0]


@in_virtual_time
async def test_what_somebody_sets_after_the_loss_is_what_holds() -> None:
    async with fics_rig() as rig:
        await rig.robot.ask(SetSpeedPercent(percents=[10.0]), 1)
        await cycle(rig)
        await rig.robot.ask(SetSpeedPercent(percents=[15.0]), 1)
        await rig.move(HomeRobot())
        assert percents(rig) == [15.0, 100.0, 100.0]


@in_virtual_time
async def test_in_mode_2_full_speed_where_there_was_less_counts_as_a_loss_of_power() -> None:
    async with fics_rig(mode=2) as rig:
        await rig.robot.ask(SetSpeedPercent(percents=[10.0, 10.0, 10.0]), 1)
        assert (await rig.move(DOWN)).status is MoveStatus.SUCCEEDED
        moves = len(rig.heard("LMI"))
        rig.power_cycle()
        with pytest.raises(PowerCycled):
            await rig.move(DOWN)
        assert len(rig.heard("LMI")) == moves
        assert rig.events("robot.power_cycled")[0].data["certain"] is False
        rig.robot.known.power.acknowledge()
        assert (await rig.move(DOWN)).status is MoveStatus.SUCCEEDED
        assert percents(rig) == [10.0, 10.0, 10.0]


@in_virtual_time
async def test_in_mode_2_a_robot_that_is_not_homed_any_more_has_probably_lost_its_power() -> None:
    async with fics_rig(mode=2) as rig:
        assert (await rig.move(HomeRobot())).status is MoveStatus.SUCCEEDED
        await asyncio.sleep(LIMIT_S)
        assert not rig.robot.power_cycled
        rig.power_cycle()
        await asyncio.sleep(LIMIT_S)
        assert [event.data["certain"] for event in rig.events("robot.power_cycled")] == [False]
        with pytest.raises(PowerCycled, match="seems to have been switched off and on"):
            await rig.move(DOWN)
        assert rig.heard("LMI") == []


@in_virtual_time
async def test_in_mode_2_the_origins_are_looked_at_before_a_motion() -> None:
    async with fics_rig(mode=2) as rig:
        await rig.move(HomeRobot())
        assert (await rig.move(DOWN)).status is MoveStatus.SUCCEEDED
        moves = len(rig.heard("LMI"))
        rig.power_cycle()
        with pytest.raises(PowerCycled):
            await rig.move(DOWN)
        assert len(rig.heard("LMI")) == moves
        rig.robot.known.power.acknowledge()
        assert (await rig.move(DOWN)).status is MoveStatus.SUCCEEDED


@in_virtual_time
async def test_in_mode_2_no_origins_no_motion_where_the_robot_does_not_tell_them() -> None:
    async with fics_rig(mode=2) as rig:
        await rig.move(HomeRobot())
        rig.cable.lost_answer = "MPS"
        with pytest.raises(NotSent, match="did not answer MPS"):
            await rig.move(DOWN)
        assert rig.heard("LMI") == []


@pytest.mark.parametrize("stopped", [False, True])
def test_in_mode_2_homing_takes_origins_away_unasked(stopped: bool) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(mode=2) as rig:
            await rig.move(HomeRobot())
            again = await rig.start(HomeRobot())
            if stopped:
                assert (await rig.robot.stop("immediate")).state == "confirmed"
                await rig.robot.conversation.reset_errors()
            await rig.plant.robot_moves.wait(again.id, 600)
            await asyncio.sleep(LIMIT_S)
            assert all(motor.homed for motor in rig.fics.units[1].motors) is not stopped
            assert not rig.robot.power_cycled
            assert (await rig.move(DOWN)).status is MoveStatus.SUCCEEDED

    story()


@in_virtual_time
async def test_in_mode_2_homing_that_failed_before_anybody_looked_is_no_loss_of_power() -> None:
    async with fics_rig(mode=2, baud=9600) as rig:
        await rig.move(HomeRobot())
        homing = asyncio.create_task(rig.move(HomeRobot()))
        await rig.cable.written_from("ORG")
        rig.cable.lost_answer = "ACD"
        await asyncio.sleep(1)
        rig.touch(lambda fics, now: fics.raise_alarm(system_error(183, 1, 2), now))
        rig.cable.lost_answer = ""
        await homing
        assert not all(motor.homed for motor in rig.fics.units[1].motors)
        assert not rig.robot.power_cycled


@in_virtual_time
async def test_in_mode_2_homing_at_the_teaching_terminal_is_no_loss_of_power() -> None:
    async with fics_rig(mode=2) as rig:
        await rig.move(HomeRobot())
        rig.touch(lambda fics, _: setattr(fics, "terminal", MotionMode.HOMING))
        await asyncio.sleep(LIMIT_S)
        rig.touch(lambda fics, _: fics.unit.lose_power())
        rig.touch(lambda fics, _: setattr(fics, "terminal", None))
        await asyncio.sleep(LIMIT_S)
        assert not rig.robot.power_cycled


@in_virtual_time
async def test_h01_what_tells_of_a_loss_of_power_is_asked_last() -> None:
    async with fics_rig(units=2) as rig:
        sent = len(rig.cable.written)
        assert (await rig.move(DOWN, unit=2)).status is MoveStatus.SUCCEEDED
        frames = rig.cable.frames(sent)
        motion = frames.index("LMI ,,-5")
        assert frames[motion - 2 : motion] == ["UNT", "MOD"]


@in_virtual_time
async def test_h01_after_a_silence_between_the_questions_all_are_asked_again() -> None:
    async with fics_rig(units=2, baud=9600) as rig:
        await rig.robot.unit(2).position()
        sent = len(rig.cable.written)
        starting = asyncio.create_task(rig.robot.jogs.start(2, "Z", "-"))
        await rig.cable.written_from("UNT")
        rig.lose_replies()
        await starting
        spoken = [text for text in rig.cable.frames(sent) if not text.startswith("VAR")]
        assert spoken == ["UNT", "UNT", "MOD", "UNT", "MOD", "JOG Z-"]


@in_virtual_time
async def test_h01_on_a_line_that_is_never_quiet_nothing_moves() -> None:
    async with fics_rig(baud=9600) as rig:

        async def disturb() -> None:
            while True:
                await rig.cable.written_from("UNT")
                rig.cable.copies.append(b"VER\r")

        disturbing = asyncio.create_task(disturb())
        with pytest.raises(NotProved, match="nothing was sent"):
            await rig.move(DOWN)
        disturbing.cancel()
        await asyncio.wait({disturbing})
        assert rig.heard("LMI") == []


@in_virtual_time
async def test_h01_a_copy_of_an_answer_from_before_the_loss_proves_nothing() -> None:
    async with fics_rig() as rig:
        await rig.robot.conversation.see_power()
        rig.cable.copies.append(b"MOD 3\r")  # on its way, and nothing asked later is answered before it
        rig.power_cycle()
        with pytest.raises(PowerCycled):
            await rig.robot.jogs.start(1, "Z", "-")
        assert rig.machine.truth.of("motion_start") == []


@in_virtual_time
async def test_h01_no_axis_joins_a_jog_that_the_robot_does_not_tell_of() -> None:
    async with fics_rig(units=2) as rig:
        await rig.robot.jogs.start(2, "Z", "-")
        rig.touch(lambda fics, _: setattr(fics.job, "mode", MotionMode.MOVE))  # an assumption, flipped
        with pytest.raises(RobotBusy, match="no axis was seen to jog"):
            await rig.robot.jogs.start(2, "X", "+")
        assert rig.heard("JOG X") == []


@in_virtual_time
async def test_h01_in_mode_2_positions_that_are_gone_tell_of_a_loss_of_power_too() -> None:
    async with fics_rig(mode=2) as rig:
        await rig.move(HomeRobot())
        rig.power_cycle()
        with pytest.raises(PowerCycled):
            await rig.robot.jogs.start(1, "Z", "-")
        assert rig.heard("JOG") == []


@in_virtual_time
async def test_h01_in_mode_2_a_robot_that_was_switched_off_and_on_without_any_sign_moves_on() -> None:
    """A loss that no question can find: nothing was homed, and all speeds were those of power-on."""
    async with fics_rig(mode=2) as rig:
        rig.power_cycle()
        assert (await rig.move(DOWN)).status is MoveStatus.SUCCEEDED
        assert not rig.robot.power_cycled


@pytest.mark.parametrize("mode", [2, 3])
@pytest.mark.parametrize("read_meanwhile", [False, True])
def test_a_read_after_a_loss_of_power_does_not_count_as_the_speed_that_was_set(
    mode: int, read_meanwhile: bool
) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(mode=mode) as rig:
            await rig.move(HomeRobot())
            await rig.robot.ask(SetSpeedPercent(percents=[1.0, 1.0, 1.0]), 1)
            rig.power_cycle()
            if read_meanwhile:
                await rig.robot.ask(GetSpeedPercent(), 1)
            with pytest.raises(PowerCycled):
                await rig.move(DOWN)
            await asyncio.sleep(LIMIT_S)
            rig.robot.known.power.acknowledge()
            await rig.move(HomeRobot())
            assert percents(rig) == [1.0, 1.0, 1.0]

    story()


@pytest.mark.parametrize("away_s", [0.0, 20.0])
def test_in_mode_2_a_loss_of_power_is_told_once_for_all_units(away_s: float) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(mode=2, units=2) as rig:
            await rig.move(HomeRobot())
            for unit in (2, 1):
                await rig.robot.unit(unit).status()
            rig.machine.power_off(asyncio.get_running_loop().time())
            await asyncio.sleep(away_s)
            rig.machine.power_on(asyncio.get_running_loop().time())
            await asyncio.sleep(LIMIT_S)
            assert rig.robot.power_cycled
            rig.robot.known.power.acknowledge()
            await rig.robot.unit(2).status()
            assert not rig.robot.power_cycled
            assert rig.types("robot.power_cycled") == ["robot.power_cycled"]

    story()


@pytest.mark.parametrize("asked_of_2", [False, True])
def test_in_ver_2_a_loss_is_seen_though_the_gateway_has_left_another_unit_selected(asked_of_2: bool) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(mode=2, units=2) as rig:
            await rig.move(HomeRobot())
            assert (await rig.robot.stop("decelerate")).state == "confirmed"  # it asks unit 2 last
            if asked_of_2:
                await asyncio.sleep(LIMIT_S)
            rig.power_cycle()
            await asyncio.sleep(LIMIT_S)
            assert rig.robot.power_cycled

    story()


@in_virtual_time
async def test_in_ver_2_what_hides_all_places_is_no_loss_of_power_of_a_unit_that_is_not_selected() -> None:
    async with fics_rig(mode=2, units=2) as rig:
        await rig.move(HomeRobot())
        await rig.robot.unit(2).status()
        rig.touch(lambda fics, _: setattr(fics, "terminal", MotionMode.MACRO))
        await asyncio.sleep(LIMIT_S)
        rig.touch(lambda fics, _: setattr(fics, "terminal", None))
        await asyncio.sleep(LIMIT_S)
        assert not rig.robot.power_cycled
