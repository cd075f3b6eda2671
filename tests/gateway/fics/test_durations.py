"""The longest time of a move follows from its distance and speed."""

import asyncio

import pytest

from gateway.core.move_record import MoveStatus
from gateway.fics.axes import AxisDuration
from gateway.fics.plans import longest_s
from protocols.fics.homing import HomeRobot
from protocols.fics.moves import MoveAbsolute, MoveRelative
from protocols.fics.speeds import SetSpeedPercent
from tests.fics_plants import fics_rig
from tests.plants import in_virtual_time

DURATIONS = {"X": AxisDuration(10.0, 1.0), "Y": AxisDuration(100.0, 0.5)}
AT_ZERO = {"X": 0.0, "Y": 0.0}


def test_the_slowest_axis_counts_and_one_that_stays_does_not() -> None:
    assert longest_s(AT_ZERO, {"X": 50.0, "Y": -100.0}, DURATIONS) == 6.0
    assert longest_s(AT_ZERO, {"X": 0.0, "Y": 100.0}, DURATIONS) == 1.5


def test_what_is_not_known_is_not_guessed() -> None:
    assert longest_s(AT_ZERO, None, DURATIONS) is None
    assert longest_s({"X": None}, {"X": 50.0}, DURATIONS) is None
    assert longest_s(AT_ZERO, {"X": None}, DURATIONS) is None
    assert longest_s(AT_ZERO, {"X": 50.0}, {}) is None


@pytest.mark.parametrize("percent", [0.2, 1.0, 50.0])
def test_h12_the_reckoning_follows_distance_and_speed_and_is_kept(percent: float) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(units=2) as rig:
            loop = asyncio.get_running_loop()
            await rig.move(HomeRobot())
            await rig.robot.ask(SetSpeedPercent(percents=[percent] * 3), 2)
            began = loop.time()
            move = await rig.move(MoveAbsolute(coordinates=[100.0, 50.0]), unit=2)
            took = loop.time() - began
            assert move.status is MoveStatus.SUCCEEDED
            assert move.longest_s is not None
            assert took / 2 < move.longest_s + 1
            assert move.longest_s > 100.0 / (500.0 * percent / 100)
            assert rig.types("robot.move.overdue") == []

    story()


@in_virtual_time
async def test_h12_a_move_that_takes_longer_is_told_and_followed_to_its_end() -> None:
    async with fics_rig(units=2) as rig:
        await rig.move(HomeRobot())
        down = MoveRelative(coordinates=[None, None, -5.0])
        await rig.move(down, unit=2)
        for axis in rig.fics.units[2].users:
            axis.percent = 0.1  # behind our back
        move = await rig.move(down, unit=2)
        assert (move.status, move.completion) == (MoveStatus.SUCCEEDED, "reply")
        (overdue,) = rig.events("robot.move.overdue")
        assert overdue.data == {"move_id": move.id, "longest_s": move.longest_s, "request_id": None}
        assert "It takes longer than its distance and speed account for." in move.evidence


@in_virtual_time
async def test_speeds_are_read_once_and_again_after_a_change() -> None:
    async with fics_rig() as rig:
        await rig.move(HomeRobot())
        down = MoveRelative(coordinates=[None, None, -5.0])
        await rig.move(down)
        await rig.move(down)
        assert len(rig.heard("VSO")) == 1
        await rig.robot.ask(SetSpeedPercent(percents=[50.0]), 1)
        await rig.move(down)
        assert len(rig.heard("VSO")) == 2
