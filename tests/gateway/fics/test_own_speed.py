"""A robot's move with a speed of its own: set before it, read back, and left so."""

import asyncio

import pytest

from gateway.core.errors import StoppedFirst
from gateway.core.origin import Origin
from gateway.core.targets import BegunMoves
from gateway.fics.amounts import Amount
from gateway.fics.errors import RobotBusy
from gateway.fics.move_requests import RobotRelativeMoveRequest
from protocols.fics.motor_axes import GetMotorSpeedPercent
from protocols.fics.speeds import GetSpeedPercent
from tests.fics_plants import FicsRig, fics_rig
from tests.plants import in_virtual_time
from tests.through_the_door import start

ME = Origin("test")
UNIT = "/robots/r1/units/1"


def up(percent: float | None, coordinates: str = "user") -> RobotRelativeMoveRequest:
    return RobotRelativeMoveRequest(
        kind="relative",
        coordinates=coordinates,  # type: ignore[arg-type]
        axes={"Z": Amount(value=-20, unit="mm")},
        speed_percent=percent,
    )


async def seconds_of(rig: FicsRig, request: RobotRelativeMoveRequest) -> float:
    """Seconds that a move takes."""
    loop = asyncio.get_running_loop()
    begun = await start(rig.plant, ME, UNIT, request)
    assert isinstance(begun, BegunMoves)
    began_at = loop.time()
    assert (await rig.plant.robot_moves.wait(begun.moves[0].id, 600)).status == "succeeded"
    return loop.time() - began_at


@in_virtual_time
async def test_a_move_with_a_percent_takes_longer_and_the_next_without_one_runs_as_it_is_set() -> None:
    async with fics_rig() as rig:
        full = await seconds_of(rig, up(None))
        slow = await seconds_of(rig, up(1))
        assert slow > 4 * full
        assert (await rig.robot.unit(1).read(GetSpeedPercent())).percents == [1.0, 1.0, 1.0]
        assert (await rig.robot.unit(1).read(GetMotorSpeedPercent())).percents == [100.0, 100.0, 100.0]
        assert await seconds_of(rig, up(None)) == pytest.approx(slow, rel=0.2)


@in_virtual_time
async def test_motor_axes_have_a_speed_of_their_own() -> None:
    async with fics_rig() as rig:
        await seconds_of(rig, up(2, "motor"))
        assert (await rig.robot.unit(1).read(GetMotorSpeedPercent())).percents == [2.0, 2.0, 2.0]
        assert (await rig.robot.unit(1).read(GetSpeedPercent())).percents == [100.0, 100.0, 100.0]


@in_virtual_time
async def test_while_it_moves_no_wish_changes_its_speed() -> None:
    async with fics_rig() as rig:
        await start(rig.plant, ME, UNIT, up(1))
        with pytest.raises(RobotBusy):
            await start(rig.plant, ME, UNIT, up(100))


@in_virtual_time
async def test_a_stop_while_the_speed_is_set_lets_nothing_begin() -> None:
    async with fics_rig() as rig:
        starting = asyncio.create_task(start(rig.plant, ME, UNIT, up(1)))
        await asyncio.sleep(0)
        await rig.robot.stop("decelerate")
        with pytest.raises((StoppedFirst, RobotBusy)):
            await starting
        assert rig.robot.unit(1).move is None
