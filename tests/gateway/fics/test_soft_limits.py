"""Soft limits: changed in an order in which they never cross on the way, nor in the end."""

from typing import Any

import pytest

from gateway.core.errors import InvalidRequest
from gateway.fics.settings import uncrossed
from protocols.fics.motor_axes import SetMotorLowerSoftLimits, SetMotorUpperSoftLimits
from protocols.fics.row import FicsCommand
from protocols.fics.soft_limits import SetLowerSoftLimits, SetUpperSoftLimits
from protocols.fics.speeds import SetSpeedPercent
from tests.fics_plants import FicsRig, fics_rig
from tests.plants import in_virtual_time

Limits = list[float | None]


async def order(rig: FicsRig, lower: Limits, upper: Limits, *others: FicsCommand[Any]) -> list[str]:
    """In which order changes of both limits of unit 1, whose X and Y go from -300 to 300, are to be sent."""
    changes = {"lower": SetLowerSoftLimits(coordinates=lower), "upper": SetUpperSoftLimits(coordinates=upper)}
    named = {str(place): other for place, other in enumerate(others)}
    return [change.text for change in await uncrossed(rig.robot.unit(1), named | changes)]


@in_virtual_time
async def test_limits_that_go_up_raise_the_upper_one_first() -> None:
    async with fics_rig() as rig:
        assert await order(rig, [400.0], [500.0]) == ["SLP 500", "SLM 400"]


@in_virtual_time
async def test_limits_that_go_down_lower_the_lower_one_first() -> None:
    async with fics_rig() as rig:
        assert await order(rig, [-500.0], [-400.0]) == ["SLM -500", "SLP -400"]


@in_virtual_time
async def test_limits_of_two_axes_may_go_either_way_at_once() -> None:
    async with fics_rig() as rig:
        assert await order(rig, [400.0, -500.0], [500.0, -400.0]) == ["SLP 500", "SLM 400,-500", "SLP ,-400"]


@in_virtual_time
async def test_what_is_no_limit_keeps_its_place_before_them() -> None:
    async with fics_rig() as rig:
        slowly = SetSpeedPercent(percents=[5.0])
        assert await order(rig, [-10.0], [10.0], slowly) == ["VAO 5", "SLP 10", "SLM -10"]
        assert await uncrossed(rig.robot.unit(1), {"speed": slowly}) == [slowly]


@in_virtual_time
async def test_motor_limits_have_an_order_of_their_own() -> None:
    async with fics_rig() as rig:
        changes = {
            "lower": SetMotorLowerSoftLimits(coordinates=[-200.0]),
            "upper": SetMotorUpperSoftLimits(coordinates=[-190.0]),
        }
        ordered = await uncrossed(rig.robot.unit(1), changes)
        assert [change.text for change in ordered] == ["MSM -200", "MSP -190"]


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (SetUpperSoftLimits(coordinates=[-301.0]), "limit: axis X of r1/units/1 would have soft limits"),
        (SetLowerSoftLimits(coordinates=[None, 301.0]), "limit: axis Y of r1/units/1 .* from 301 to 300"),
        (SetMotorUpperSoftLimits(coordinates=[-9999.0]), "limit: axis A of r1/units/1"),
    ],
)
def test_limits_that_would_cross_are_refused_with_both(change: FicsCommand[Any], says: str) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig() as rig:
            with pytest.raises(InvalidRequest, match=says):
                await uncrossed(rig.robot.unit(1), {"limit": change})

    story()
