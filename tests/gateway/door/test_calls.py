"""Operations carried out for their callers: rights and leases first, then what the path leads to."""

import pytest

from gateway.access.errors import NotPermitted
from gateway.access.principal import Principal, asking
from gateway.access.roles import Role
from gateway.core.errors import NotFound
from gateway.core.leases import Holder, LeaseRefused
from gateway.core.operation import Rows
from gateway.core.origin import Origin, acting, current
from gateway.core.rights import Right
from gateway.core.targets import Target
from gateway.door.calls import carry_out
from gateway.door.configuration import ReloadRequest
from gateway.fics.robot import Robot
from gateway.fics.units import RobotUnit
from gateway.plant import Plant
from gateway.rorze.bodies import Body, Group
from gateway.rorze.family import Rorze
from tests.fics_plants import fics_rig
from tests.plants import in_virtual_time, rig

ME = Origin("test", "r-1")
ROWS = Rows("test")


@ROWS.get("/bodies/{body_id}/x/{n}")
async def of_a_body(plant: Plant, rorze: Rorze, body: Body, target: Target, n: int) -> list[object]:
    """Tell what it was provided with."""
    return [plant, rorze, body.address, target.address, n, current()]


@ROWS.get("/groups/{group_id}/x")
async def of_a_group(group: Group) -> list[object]:
    """Tell what it was provided with."""
    return [group.address]


@ROWS.get("/robots/{robot_id}/units/{unit}/x")
async def of_a_unit(axes: RobotUnit) -> list[object]:
    """Tell what it was provided with."""
    return [axes.robot_id, axes.number]


@ROWS.get("/robots/{robot_id}/x/{n}")
async def of_a_robot(robot: Robot, n: int) -> list[object]:
    """Tell what it was provided with."""
    return [robot.id, n]


@ROWS.put("/bodies/{body_id}/x", Right.SETUP)
async def sets(body: Body, wanted: ReloadRequest) -> list[object]:
    """Set, or only ask."""
    return [body.address, wanted.dry_run]


@ROWS.get("/bodies/{body_id}/y")
async def of_nothing_known(body: Origin) -> list[object]:
    """Ask for a value that no function provides."""
    return [body]


BODY, GROUP, UNIT, ROBOT, SETS, UNKNOWN = ROWS


@in_virtual_time
async def test_a_body_is_found_in_the_name_of_its_caller() -> None:
    async with rig() as it:
        with acting(ME):
            found = await carry_out(it.plant, BODY, {"body_id": "3f", "n": 7})
            assert found == [it.plant, it.plant.rorze, "line1.3F", "line1.3F", 7, ME]
        assert await carry_out(it.plant, GROUP, {"group_id": "80"}) == ["line1.80"]
        assert current() != ME


@in_virtual_time
async def test_a_robot_and_its_units_are_found() -> None:
    async with fics_rig() as it:
        assert await carry_out(it.plant, UNIT, {"robot_id": "r1", "unit": 1}) == ["r1", 1]
        assert await carry_out(it.plant, ROBOT, {"robot_id": "r1", "n": 3}) == ["r1", 3]
        with pytest.raises(NotFound):
            await carry_out(it.plant, ROBOT, {"robot_id": "r9", "n": 3})


@in_virtual_time
async def test_what_is_not_there_and_callers_without_the_right_are_refused() -> None:
    async with rig() as it:
        with pytest.raises(NotFound):
            await carry_out(it.plant, BODY, {"body_id": "55", "n": 7})
        with asking(Principal("somebody", Role.OPERATOR, None, "s1")), pytest.raises(NotPermitted):
            await carry_out(it.plant, SETS, {"body_id": "3F", "wanted": ReloadRequest()})
        with (
            asking(Principal("somebody", Role.ADMIN, frozenset({"line1.00"}), "s1")),
            pytest.raises(NotPermitted),
        ):
            await carry_out(it.plant, BODY, {"body_id": "3F", "n": 7})


@in_virtual_time
async def test_a_lease_of_somebody_else_keeps_from_setting_and_not_from_asking() -> None:
    async with rig() as it:
        parts = it.plant.access.territory.parts("3F")
        await it.plant.access.leases.take(
            "3F", "/bodies/line1.3F", parts, Holder("bert", "b"), 10.0, over=False
        )
        with pytest.raises(LeaseRefused):
            await carry_out(it.plant, SETS, {"body_id": "3F", "wanted": ReloadRequest()})
        asked = {"body_id": "3F", "wanted": ReloadRequest(dry_run=True)}
        assert await carry_out(it.plant, SETS, asked) == ["line1.3F", True]


@in_virtual_time
async def test_what_nobody_finds_is_a_fault_of_the_row() -> None:
    async with rig() as it:
        with pytest.raises(TypeError, match="Nobody finds a Origin"):
            await carry_out(it.plant, UNKNOWN, {"body_id": "3F"})
