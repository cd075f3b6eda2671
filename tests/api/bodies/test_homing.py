"""Homing over HTTP: its set-up as one resource, its result, the stall dog, and who has found a stall."""

import asyncio
from typing import Any

from simulator.rorze.controller import Rc420, StallFinder
from tests.api.bodies.test_info import brown_out
from tests.api.bodies.test_speed_sets import set_by
from tests.api.stand import Stand, on_stand

PATH = "/bodies/01/homing"
STALL_ERROR = 1 << 6


def axis_of(stand: Stand, number: int = 0x3F) -> Rc420:
    axis = stand.port.machine.axes[number]
    assert isinstance(axis, Rc420)
    return axis


async def home(stand: Stand, body: str = "3F", method: str = "standard") -> dict[str, Any]:
    answer = await stand.post(f"/bodies/{body}/moves?wait=60", {"kind": "home", "method": method})
    assert answer.status_code == 200, answer.text
    return dict(answer.json())


@on_stand()
async def test_a_homing_tells_how_far_it_went(stand: Stand) -> None:
    await stand.teach_speeds("3F")
    before = axis_of(stand).motor.pulses(asyncio.get_running_loop().time())
    move = await home(stand)
    assert (move["status"], move["position"]) == ("succeeded", 0)
    after = axis_of(stand).motor.pulses(asyncio.get_running_loop().time())
    assert move["homing_distance"] == before - after != 0
    told = (await stand.get("/bodies/3F/homing")).json()["last"]
    assert told == {"homed": "yes", "distance": move["homing_distance"], "in_unit": None}


@on_stand()
async def test_the_centre_of_a_stall_dog_is_no_origin(stand: Stand) -> None:
    await asyncio.sleep(40)
    brown_out(stand)
    await asyncio.sleep(40)
    await stand.teach_speeds("3F")
    await stand.send("3F", "set-sensor-logic", bit=0, contact="normally_closed")
    move = await home(stand, method="centre_stall_dog")
    assert (move["status"], move["command"]) == ("succeeded", "0QM")
    assert move["homing_distance"] is not None
    seen = (await stand.get("/bodies/3F")).json()
    assert (seen["homed"], seen["power_cycled"]) == ("no", True)


@on_stand()
async def test_the_set_up_of_homing_is_one_resource(stand: Stand) -> None:
    seen = await stand.get(PATH)
    told = seen.json()
    assert told["settings"] == {
        "origin_offset": 10,
        "overrun_factor": 2,
        "homing_retries": 0,
        "stall_sensor_interval": 2_048,
        "stall_sensor_detection": False,
        "start_speed_pps": 50,
        "maximum_speed_pps": 50_000,
        "acceleration_pps_s": 100_000,
        "rising_percent": 50,
        "falling_percent": 50,
    }
    assert (told["overrun"], told["in_unit"]["origin_offset"]) == (20, {"value": 0.01, "unit": "mm"})
    tag = {"If-Match": seen.headers["etag"]}
    change = {"origin_offset": 20, "homing_retries": 0, "start_speed_pps": 500}
    answer = await stand.client.patch(PATH, json=change, headers=tag)
    assert answer.status_code == 200
    assert set_by(stand.frames()) == ["OLS500", "0SS20"]
    stale = await stand.client.patch(PATH, json={"homing_retries": 1}, headers=tag)
    assert stale.status_code == 412
    assert (await stand.client.patch(PATH, json={"autostart": True})).status_code == 422


@on_stand()
async def test_the_status_names_who_has_found_a_stall_and_the_route_that_clears_it(stand: Stand) -> None:
    axis = axis_of(stand)
    assert (await stand.get("/bodies/3F/status")).json()["stalls"] == []
    axis.stalls |= {StallFinder.ENCODER}
    axis.status |= STALL_ERROR
    (found,) = (await stand.get("/bodies/3F/status")).json()["stalls"]
    assert found["finder"] == "encoder"
    assert (await stand.post(found["reset"], {})).status_code == 200
    assert not axis.stalls
    axis.stalls |= set(StallFinder)
    axis.status |= STALL_ERROR
    stalls = (await stand.get("/bodies/3F/status")).json()["stalls"]
    assert [it["finder"] for it in stalls] == ["stall_sensor", "encoder"]
