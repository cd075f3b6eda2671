"""Stops of a robot: sent at once, repeated, and confirmed only by what it says itself of every unit."""

import asyncio

import pytest

from gateway.core.move_record import MoveStatus
from gateway.core.stops import CONFIRM_WITHIN_S, HURRY_S, StopMode
from gateway.fics.errors import RobotBusy
from protocols.fics.homing import HomeRobot
from protocols.fics.moves import MoveAbsolute, MoveRelative
from protocols.fics.speeds import SetDecelerationTimes, SetMaximumSpeeds, SetSpeedPercent
from simulator.fics.actions import Code
from simulator.fics.settings import RobotSettings
from tests.fics_plants import FicsRig, fics_rig
from tests.plants import in_virtual_time

SLOW = SetSpeedPercent(percents=[0.5, 0.5, 0.5])
LONG = MoveAbsolute(coordinates=[200.0, 60.0])


async def under_way(rig: FicsRig) -> str:
    """Home the robot, then start a move of many seconds with unit 1."""
    await rig.move(HomeRobot())
    await rig.robot.ask(SLOW, 1)
    return (await rig.start(LONG)).id


async def fast(rig: FicsRig) -> None:
    """Home the robot, and let it come up to a speed from which it brakes for long."""
    await rig.move(HomeRobot())
    await rig.robot.ask(SetDecelerationTimes(times_ms=[3000] * 3), 1)
    await rig.start(LONG)
    await asyncio.sleep(0.4)


@in_virtual_time
async def test_the_reason_of_a_refusal_outlasts_the_warning() -> None:
    async with fics_rig() as rig:
        await under_way(rig)
        rig.edit(True)
        report = await rig.robot.stop("immediate")
        await asyncio.sleep(CONFIRM_WITHIN_S)
        detail = str(report.detail)
        assert "refused the stop with E03" in detail
        assert "Unit 1 has not come to rest." in detail
        assert "use the hardware stop" in detail
        (warning,) = rig.events("robot.stop.unconfirmed")
        assert "refused the stop with E03" in warning.data["detail"]
        assert warning.data["units_unknown"] == [1]
        rig.edit(False)
        await asyncio.sleep(1)
        assert (report.state, report.detail, report.units_unknown) == ("confirmed", None, [])


@in_virtual_time
async def test_while_the_terminal_edits_a_stop_says_which_unit_nobody_knows_of() -> None:
    async with fics_rig(units=2) as rig:
        await rig.move(HomeRobot())
        await rig.robot.unit(2).status()
        await rig.robot.unit(1).status()
        rig.edit(True)
        report = await rig.robot.stop("immediate")
        assert report.state != "confirmed"
        assert report.units_unknown == [2]
        detail = str(report.detail)
        assert "Nobody knows whether unit 2 stands still: r1 refused UNT" in detail
        assert "It stood still when it was last asked." in detail
        assert "unit 1" not in detail
        rig.edit(False)
        assert (await rig.robot.stop("immediate")).state == "confirmed"


@in_virtual_time
async def test_of_a_unit_that_was_sent_on_its_way_nobody_says_that_it_stood_still() -> None:
    async with fics_rig(units=2) as rig:
        await rig.robot.unit(1).status()
        await rig.robot.unit(2).status()
        await rig.start(MoveRelative(coordinates=[None, None, -50.0]))
        assert [unit.stood_still for unit in rig.robot.units] == [False, True]


@in_virtual_time
async def test_in_mode_2_a_stop_that_is_refused_stays_refused_until_a_repetition_is_not() -> None:
    async with fics_rig(mode=2, units=2) as rig:
        await rig.move(HomeRobot())
        rig.edit(True)
        report = await rig.robot.stop("decelerate")
        for _ in range(50):
            assert report.state == "refused"
            await asyncio.sleep(0.017)
        rig.edit(False)
        await asyncio.sleep(1)
        assert report.state == "confirmed"


@in_virtual_time
async def test_in_mode_2_of_two_refused_stops_each_stays_refused_until_a_repetition_is_not() -> None:
    async with fics_rig(mode=2) as rig:
        await under_way(rig)
        rig.edit(True)
        reports = [await rig.robot.stop("decelerate"), await rig.robot.stop("immediate")]
        for _ in range(50):
            assert [report.state for report in reports] == ["refused", "refused"]
            await asyncio.sleep(0.017)
        rig.edit(False)
        await asyncio.sleep(1.0)
        assert [report.state for report in reports] == ["confirmed", "confirmed"]


@pytest.mark.parametrize("mode", [2, 3])
@pytest.mark.parametrize("elsewhere", [True, False], ids=["somebody else", "the gateway"])
def test_a_robot_that_brakes_already_has_not_refused_to(mode: int, elsewhere: bool) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(mode=mode) as rig:
            await fast(rig)
            if elsewhere:
                rig.touch(lambda fics, now: fics.brake(now))
            report = await rig.robot.stop("decelerate")
            assert report.state == "confirmed"
            assert rig.types("robot.stop.refused") == []

    story()


@pytest.mark.parametrize("mode", [2, 3])
def test_what_brakes_again_after_somebody_has_edited_is_not_refused_any_more(mode: int) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(mode=mode) as rig:
            await fast(rig)
            stopping = rig.robot.stop("decelerate")
            await asyncio.sleep(0.1)
            rig.edit(True)
            await asyncio.sleep(0.3)
            rig.edit(False)
            await stopping
            assert [event.data["error"] for event in rig.events("robot.stop.refused")] == ["E03"]

    story()


@pytest.mark.parametrize("error", [Code.NO_MACRO, Code.RANGE, Code.ALARM])
@in_virtual_time
async def test_in_mode_2_the_refusal_of_another_command_is_not_that_of_a_stop(error: Code) -> None:
    async with fics_rig(mode=2) as rig:
        await rig.move(HomeRobot())
        rig.touch(lambda fics, _: setattr(fics, "refusal", error))
        assert (await rig.robot.stop("decelerate")).state == "confirmed"
        assert rig.types("robot.stop") == ["robot.stop.requested", "robot.stop.confirmed"]


@in_virtual_time
async def test_in_mode_2_a_stop_hears_of_its_refusal_whoever_asks_for_the_error() -> None:
    async with fics_rig(mode=2) as rig:
        await under_way(rig)
        rig.edit(True)
        stopping = rig.robot.stop("immediate")
        await asyncio.gather(rig.robot.conversation.poll_error(), stopping)
        assert (await stopping).state == "refused"


@in_virtual_time
async def test_an_immediate_stop_that_was_acknowledged_is_not_refused_by_its_repetition() -> None:
    settings = RobotSettings(stop_while_braking="refused", emergency_stop="brakes")
    async with fics_rig(prepare=lambda machine: setattr(machine.robot, "settings", settings)) as rig:
        await fast(rig)
        immediate = rig.robot.stop("immediate")
        await asyncio.sleep(0.01)
        decelerate = rig.robot.stop("decelerate")
        assert (await immediate).state in ("acknowledged", "confirmed")
        await decelerate
        assert rig.types("robot.stop.refused") == []


@in_virtual_time
async def test_a_refused_stop_is_never_given_up_and_no_move_begins_before_it_has_worked() -> None:
    async with fics_rig() as rig:
        await rig.move(HomeRobot())
        await rig.robot.ask(SetMaximumSpeeds(speeds=[None, None, 0.5]), 1)
        down = MoveRelative(coordinates=[None, None, -90.0])
        move_id = (await rig.start(down)).id
        rig.edit(True)
        report = await rig.robot.stop("immediate")
        await asyncio.sleep(2 * HURRY_S)
        assert (report.state, rig.robot.known.motion.stopping) == ("refused", True)
        assert rig.types("robot.stop").count("robot.stop.unconfirmed") == 1
        with pytest.raises(RobotBusy, match="not confirmed yet"):
            await rig.move(MoveRelative(coordinates=[None, None, -1.0]))
        sent = len(rig.cable.written)
        await asyncio.sleep(10.0)
        assert 9 <= rig.cable.frames(sent).count("AES") <= 11
        rig.edit(False)
        await asyncio.sleep(2.0)
        assert (report.state, report.detail, rig.fics.job) == ("confirmed", None, None)
        assert not rig.robot.known.motion.stopping
        assert rig.plant.robot_moves.get(move_id).status is MoveStatus.STOPPED


@in_virtual_time
async def test_the_dead_man_of_a_jog_outlasts_a_cable_that_is_out_for_minutes() -> None:
    async with fics_rig() as rig:
        await rig.move(HomeRobot())
        await rig.robot.ask(SetMaximumSpeeds(speeds=[None, None, 2.0]), 1)
        session = await rig.robot.jogs.start(1, "Z", "-")
        rig.cable.unplug()
        await asyncio.sleep(2 * HURRY_S)
        assert rig.fics.job is not None
        assert (session.state, session.ends_as, rig.robot.known.motion.stopping) == ("stopping", "lost", True)
        rig.cable.plugged_in = True
        await asyncio.sleep(10.0)
        assert rig.fics.job is None
        assert session.state == "lost"
        assert rig.types("robot.stop")[-1] == "robot.stop.confirmed"


@in_virtual_time
async def test_a_stop_is_repeated_while_the_robot_tells_nothing_at_all() -> None:
    async with fics_rig() as rig:
        await under_way(rig)
        rig.cable.lost_answer = "ACD"
        sent = len(rig.cable.written)
        await rig.robot.stop("immediate")
        assert rig.cable.frames(sent).count("AES") >= 5
        rig.cable.lost_answer = ""


@in_virtual_time
async def test_the_end_of_the_gateway_ends_the_repeating() -> None:
    async with fics_rig() as rig:
        await rig.robot.unit(1).status()
        rig.edit(True)
        await rig.robot.stop("immediate")
        await rig.robot.stops.close()
        sent = len(rig.cable.written)
        await asyncio.sleep(HURRY_S)
        assert "AES" not in rig.cable.frames(sent)
        assert not rig.robot.known.motion.stopping


@in_virtual_time
async def test_every_request_for_a_stop_sends_one() -> None:
    async with fics_rig() as rig:
        await rig.robot.unit(1).status()
        for count in range(1, 4):
            report = await rig.robot.stop("immediate")
            assert report.state == "confirmed"
            assert len(rig.heard("AES")) == count
        first, second = rig.robot.stop("decelerate"), rig.robot.stop("decelerate")
        assert rig.cable.frames()[-1] == "ASS"
        await asyncio.gather(first, second)
        assert len(rig.heard("ASS")) >= 2


@in_virtual_time
async def test_no_move_begins_before_standstill_is_confirmed() -> None:
    async with fics_rig() as rig:
        move_id = await under_way(rig)
        stop = rig.robot.stop("decelerate")
        with pytest.raises(RobotBusy):
            await rig.move(HomeRobot())
        assert (await stop).state == "confirmed"
        assert rig.plant.robot_moves.get(move_id).status is MoveStatus.STOPPED


@pytest.mark.parametrize("mode", [2, 3])
@pytest.mark.parametrize("lost", ["lost_command", "lost_answer"])
def test_h05_a_stop_works_even_if_the_end_of_the_upload_is_lost(mode: int, lost: str) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(mode=mode, baud=9600) as rig:
            positions = [(number, [float(number), 0.0, 0.0]) for number in range(1, 200)]
            upload = asyncio.create_task(rig.robot.upload_positions(positions))
            await asyncio.sleep(0.5)
            setattr(rig.cable, lost, "POF")
            stop = rig.robot.stop("immediate")
            await asyncio.sleep(1.5)
            assert (rig.fics.alarm is None) == (lost == "lost_command")
            setattr(rig.cable, lost, "")
            await asyncio.wait({upload, stop})
            assert upload.exception() is not None
            await asyncio.sleep(3)
            assert rig.types("robot.stop")[-1] == "robot.stop.confirmed"
            assert rig.fics.upload is None

    story()


@in_virtual_time
async def test_units_that_have_not_been_asked_yet_are_not_known() -> None:
    async with fics_rig(units=2) as rig:
        rig.robot.stop("immediate")
        (requested,) = rig.events("robot.stop.requested")
        assert requested.data["units_unknown"] == [1, 2]
        assert "Unit 2 has not been asked yet." in requested.data["detail"]
        rig.cable.lost_answer = "ACD"
        await asyncio.sleep(CONFIRM_WITHIN_S)
        (warning,) = rig.events("robot.stop.unconfirmed")
        assert warning.data["units_unknown"] == [1, 2]


@pytest.mark.parametrize("mode", [2, 3])
def test_the_stop_of_a_robot_with_one_unit_is_confirmed_without_a_selection(mode: int) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(mode=mode) as rig:
            rig.cable.lost_command = "UNT"
            rig.robot.known.unit.forget()
            assert (await rig.robot.stop("immediate")).state == "confirmed"

    story()


@pytest.mark.parametrize("kind", ["decelerate", "immediate"])
def test_in_mode_2_what_a_fence_has_left_refuses_no_stop(kind: StopMode) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(mode=2) as rig:
            await rig.move(HomeRobot())
            await rig.robot.ask(SetSpeedPercent(percents=[0.5] * 3), 1)
            await rig.start(MoveAbsolute(coordinates=[200.0, 60.0]))
            sent = len(rig.cable.written)
            rig.lose_replies()
            await asyncio.sleep(2)
            assert "POF 2" in rig.cable.frames(sent)  # refused with E01, for the robot moves
            assert (await rig.robot.stop(kind)).state == "confirmed"
            assert rig.types("robot.stop") == ["robot.stop.requested", "robot.stop.confirmed"]

    story()


# a long ramp


async def on_a_long_ramp(rig: FicsRig) -> None:
    """Start a move from whose speed the robot brakes for seconds."""
    await rig.move(HomeRobot())
    await rig.robot.ask(SetMaximumSpeeds(speeds=[50.0] * 3), 1)
    await rig.robot.ask(SetDecelerationTimes(times_ms=[6000] * 3), 1)
    await rig.start(LONG)
    await asyncio.sleep(0.4)


@pytest.mark.parametrize("mode", [2, 3])
def test_a_robot_on_a_long_ramp_raises_no_alarm_and_says_how_long_it_may_take(mode: int) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(mode=mode) as rig:
            await on_a_long_ramp(rig)
            report = await rig.robot.stop("decelerate")
            assert report.state == "acknowledged"
            assert str(report.detail).endswith("settings it may take up to 12.0 s to come to rest.")
            await rig.robot.stops.confirmed()
            assert rig.types("robot.stop") == ["robot.stop.requested", "robot.stop.confirmed"]

    story()


@pytest.mark.parametrize("mode", [2, 3])
def test_a_robot_that_falls_silent_on_its_ramp_is_an_alarm_as_soon_as_that_is_known(mode: int) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(mode=mode) as rig:
            await on_a_long_ramp(rig)
            rig.robot.stop("decelerate")
            await asyncio.sleep(CONFIRM_WITHIN_S + 0.2)
            assert rig.types("robot.stop") == ["robot.stop.requested"]
            rig.cable.broken = True
            await asyncio.sleep(1.5)
            assert rig.types("robot.stop")[-1] == "robot.stop.unconfirmed"
            rig.cable.broken = False

    story()


@pytest.mark.parametrize("mode", [2, 3])
def test_a_robot_that_is_silent_from_the_stop_on_is_an_alarm_after_two_seconds(mode: int) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(mode=mode) as rig:
            await on_a_long_ramp(rig)
            rig.cable.broken = True
            rig.robot.stop("decelerate")
            await asyncio.sleep(CONFIRM_WITHIN_S + 0.05)
            assert rig.types("robot.stop")[-1] == "robot.stop.unconfirmed"
            rig.cable.broken = False

    story()


@in_virtual_time
async def test_a_robot_that_does_not_brake_at_once_is_an_alarm_after_two_seconds() -> None:
    async with fics_rig() as rig:
        await on_a_long_ramp(rig)
        rig.cable.lost_command = "AES"
        rig.robot.stop("immediate")
        await asyncio.sleep(CONFIRM_WITHIN_S + 0.05)
        assert rig.types("robot.stop")[-1] == "robot.stop.unconfirmed"
        rig.cable.lost_command = ""
        await rig.robot.stops.confirmed()
