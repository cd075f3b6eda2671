"""Edges of the status and the sensors of a robot's axes are told, by whatever question they were seen."""

import asyncio
import json
from typing import Any

from gateway.fics.watch import HEALTH_POLL_S
from protocols.fics.homing import HomeRobot
from tests.fics_plants import FicsRig, fics_rig
from tests.plants import in_virtual_time


def told(rig: FicsRig, kind: str) -> list[dict[str, Any]]:
    hub = rig.plant.events
    events = [hub.event(number) for number in range(hub.first, hub.last + 1)]
    return [json.loads(it.json)["data"] for it in events if it.type == kind]


@in_virtual_time
async def test_what_is_told_first_is_no_edge() -> None:
    async with fics_rig(units=2) as rig:
        for unit in (1, 2):
            await rig.robot.unit(unit).status()
            await rig.robot.unit(unit).sensors()
        assert told(rig, "robot.status.changed") == told(rig, "robot.sensor.changed") == []


@in_virtual_time
async def test_a_homing_tells_each_axis_that_has_found_its_origin() -> None:
    async with fics_rig() as rig:
        await rig.move(HomeRobot())
        homed = [it for it in told(rig, "robot.status.changed") if "origin_done" in it["status"]]
        assert {it["axis"] for it in homed} == set(rig.robot.unit(1).motor_axes)
        assert {it["unit"] for it in homed} == {1}


@in_virtual_time
async def test_an_axis_that_is_not_ready_is_told_once_though_nobody_asks() -> None:
    async with fics_rig() as rig:
        await rig.robot.unit(1).status()
        rig.fics.units[1].motors[0].driver_error = 0x41
        await asyncio.sleep(3 * HEALTH_POLL_S)
        [edge] = told(rig, "robot.status.changed")
        assert (edge["unit"], edge["axis"], edge["driver_error"]) == (1, "A", "41h")
        assert "alarm" in edge["status"]


@in_virtual_time
async def test_a_limit_that_an_axis_comes_to_is_told_with_its_name() -> None:
    async with fics_rig() as rig:
        await rig.robot.unit(1).sensors()
        rig.fics.units[1].motors[1].at = 1e6
        await asyncio.sleep(2 * HEALTH_POLL_S)
        assert {"unit": 1, "axis": "B", "sensor": "plus_limit", "on": True} in told(
            rig, "robot.sensor.changed"
        )
