"""Changes at a robot that the gateway did not cause are noticed and told."""

import asyncio

import pytest

from gateway.core.errors import ControllerRefused
from gateway.fics.watch import HEALTH_POLL_S
from protocols.fics.homing import HomeRobot
from protocols.fics.moves import MoveRelative
from protocols.fics.speeds import SetSpeedPercent
from protocols.fics.status import MotionMode
from simulator.fics.alarms import system_error
from tests.fics_plants import SET_UP_S, fics_rig
from tests.plants import in_virtual_time


@in_virtual_time
async def test_motion_nobody_here_asked_for_is_told() -> None:
    async with fics_rig() as rig:
        await rig.robot.unit(1).status()
        await asyncio.sleep(HEALTH_POLL_S - SET_UP_S - 0.5)
        rig.touch(lambda fics, now: fics.execute("ORG", "", now))
        await asyncio.sleep(1)
        assert rig.types("robot.motion") == ["robot.motion.foreign"]
        assert rig.robot.moving
        with pytest.raises(ControllerRefused) as refused:
            await rig.move(MoveRelative(coordinates=[None, None, 1.0]))
        assert refused.value.error_code == "E01"


@in_virtual_time
async def test_an_error_that_came_unasked_is_found() -> None:
    async with fics_rig() as rig:
        rig.fics.units[1].motors[0].driver_error = 0x41
        rig.touch(lambda fics, now: fics.raise_alarm(system_error(183, 1, 2), now))
        await asyncio.sleep(2 * HEALTH_POLL_S)
        assert rig.robot.latched_error is not None
        assert rig.types("robot.error") == ["robot.error"]


@in_virtual_time
async def test_what_cannot_be_read_is_told() -> None:
    async with fics_rig() as rig:
        rig.cable.lost_answer = "ACD"
        await asyncio.sleep(3 * HEALTH_POLL_S)
        assert "robot.unreadable" in rig.types("robot")


@in_virtual_time
async def test_the_robot_is_asked_for_its_error_in_every_round() -> None:
    async with fics_rig() as rig:
        asked = len(rig.heard("ERR"))
        await asyncio.sleep(3 * HEALTH_POLL_S)
        assert len(rig.heard("ERR")) == asked + 3


@in_virtual_time
async def test_a_move_of_ours_that_begins_meanwhile_makes_nothing_unreadable_or_foreign() -> None:
    async with fics_rig(units=2) as rig:
        await rig.cable.written_from("MOD")
        assert (await rig.move(HomeRobot())).status == "succeeded"
        assert {"robot.unreadable", "robot.motion.foreign"}.isdisjoint(rig.types())


@pytest.mark.parametrize("mode", [2, 3])
def test_looking_changes_neither_the_unit_nor_what_the_terminal_shows(mode: int) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(mode=mode, units=2) as rig:
            await rig.robot.unit(2).status()
            sent = len(rig.cable.written)
            await asyncio.sleep(3 * HEALTH_POLL_S)
            frames = rig.cable.frames(sent)
            assert frames.count("ACD") == 3
            assert not [text for text in frames if text.startswith("UNT ")]

    story()


@in_virtual_time
async def test_a_unit_that_nobody_has_selected_here_is_asked_for_and_looked_at() -> None:
    async with fics_rig(units=2, prepare=lambda machine: setattr(machine.robot, "host_unit", 2)) as rig:
        assert rig.robot.moving is False
        assert rig.robot.known.unit.number == rig.fics.host_unit == 2
        assert [text for text in rig.cable.frames() if text.startswith("UNT ")] == ["UNT 1", "UNT 2"]


@in_virtual_time
async def test_while_the_terminal_edits_nobody_is_called_unreadable() -> None:
    async with fics_rig(units=2) as rig:
        rig.edit(on=True)
        await asyncio.sleep(2 * HEALTH_POLL_S)
        assert rig.types("robot.unreadable") == []


@in_virtual_time
async def test_in_mode_2_motion_run_from_the_terminal_is_told_though_no_unit_can_be_selected() -> None:
    async with fics_rig(mode=2, units=2) as rig:
        await asyncio.sleep(HEALTH_POLL_S - SET_UP_S - 0.5)
        rig.touch(lambda fics, _: setattr(fics, "terminal", MotionMode.MACRO))
        await asyncio.sleep(4 * HEALTH_POLL_S)
        assert rig.types("robot.motion") == ["robot.motion.foreign"]
        assert rig.types("robot.unreadable") == []


@in_virtual_time
async def test_speeds_that_the_terminal_forbids_to_restore_hide_no_motion() -> None:
    async with fics_rig() as rig:
        await rig.robot.ask(SetSpeedPercent(percents=[1.0] * 3), 1)
        rig.power_cycle()
        rig.touch(lambda fics, _: setattr(fics, "terminal", MotionMode.MACRO))
        await asyncio.sleep(3 * HEALTH_POLL_S)
        assert rig.robot.moving
        rig.touch(lambda fics, _: setattr(fics, "terminal", None))
        await asyncio.sleep(2 * HEALTH_POLL_S)
        assert rig.robot.moving is False
        assert [axis.percent for axis in rig.fics.units[1].users] == [1.0] * 3
        assert rig.types("robot.unreadable") == []


@in_virtual_time
async def test_a_robot_that_acts_on_a_unit_nobody_has_configured_is_looked_at() -> None:
    async with fics_rig(units=2, prepare=lambda machine: setattr(machine.robot, "host_unit", 3)) as rig:
        assert rig.robot.moving is False
        await asyncio.sleep(2 * HEALTH_POLL_S)
        assert rig.types("robot.unreadable") == []


@in_virtual_time
async def test_a_robot_that_takes_our_move_and_stands_still_after_it_moves_no_more_unasked() -> None:
    async with fics_rig() as rig:
        await asyncio.sleep(HEALTH_POLL_S - SET_UP_S - 0.5)
        rig.touch(lambda fics, _: setattr(fics, "terminal", MotionMode.JOG))
        await asyncio.sleep(1)
        assert rig.robot.moving
        rig.touch(lambda fics, _: setattr(fics, "terminal", None))
        assert (await rig.move(MoveRelative(coordinates=[None, None, -1.0]))).status == "succeeded"
        assert rig.robot.moving is False
