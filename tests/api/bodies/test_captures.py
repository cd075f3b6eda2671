"""Captures over HTTP: armed, waited for, read."""

import asyncio
from collections.abc import Mapping

from simulator.rorze.controller import Rc420
from tests.api.bodies.test_moves import refused
from tests.api.stand import Bodies, Stand, on_stand

CAPTURE = "/bodies/3F/captures/8"
ONCE = {"edge": "rising", "position": 25}
FAR = {"kind": "relative", "direction": "cw", "distance": {"value": 90_000, "unit": "pulse"}}
NAMED: Mapping[str, Bodies] = {
    "arm": [
        {"id": "3F", "inputs": {"8": "index"}, "units": {"unit": "mm", "pulses_per_unit": 1000.0}},
        {"id": "01"},
    ]
}


def axis_of(stand: Stand) -> Rc420:
    return stand.port.machine.axes[0x3F]


def feed(stand: Stand, levels: int) -> None:
    axis_of(stand).world.inputs = levels
    axis_of(stand).sense(asyncio.get_running_loop().time())


@on_stand(NAMED)
async def test_an_edge_in_the_next_move_is_captured_once(stand: Stand) -> None:
    await stand.teach_speeds("3F")
    armed = (await stand.client.put(CAPTURE, json=ONCE)).json()
    nothing = {"kind": "position", "number": 25, "pulses": None, "value": None, "unit": None}
    assert armed == {
        "body_id": "arm.3F",
        "input": 8,
        "name": "index",
        "edge": "rising",
        "armed": True,
        "captured": False,
        "recorded": [nothing],
        "pulse": None,
        "between": None,
    }
    await stand.post("/bodies/3F/moves", FAR)
    waiting = asyncio.create_task(stand.get(f"{CAPTURE}?wait=20"))
    await asyncio.sleep(1.0)
    feed(stand, 0x100)
    here = axis_of(stand).position(asyncio.get_running_loop().time())
    told = (await waiting).json()
    assert (told["captured"], told["armed"]) == (True, False)
    assert told["recorded"] == [nothing | {"pulses": here, "value": here / 1000, "unit": "mm"}]


@on_stand(NAMED)
async def test_a_move_that_ends_without_an_edge_ends_the_waiting(stand: Stand) -> None:
    await stand.teach_speeds("3F")
    await stand.client.put(CAPTURE, json=ONCE)
    await stand.post("/bodies/3F/moves", FAR | {"distance": {"value": 500, "unit": "pulse"}})
    began = asyncio.get_running_loop().time()
    told = (await stand.get(f"{CAPTURE}?wait=30")).json()
    assert (told["captured"], told["armed"]) == (False, False)
    assert asyncio.get_running_loop().time() - began < 5
    late = await stand.get(f"{CAPTURE}?wait=5")
    assert late.json() == told


@on_stand(NAMED)
async def test_an_edge_at_position_zero_is_one(stand: Stand) -> None:
    await stand.teach_speeds("3F")
    await stand.post("/bodies/3F/moves?wait=30", FAR)
    await stand.client.put(CAPTURE, json=ONCE)
    axis_of(stand).positions[25] = 0
    assert (await stand.get(CAPTURE)).json()["captured"] is True


@on_stand(NAMED)
async def test_everything_can_be_recorded_and_an_output_pulsed(stand: Stand) -> None:
    wanted = {
        "edge": "falling",
        "position": 1,
        "encoder": 2,
        "encoder_in_pulses": 3,
        "pulse": {"output": 4, "on": True, "duration_ms": 100},
        "between": {"lower": {"value": -1.5, "unit": "mm"}, "upper": {"value": 70_000, "unit": "pulse"}},
    }
    sent = len(stand.frames())
    armed = (await stand.client.put("/bodies/3F/captures/9", json=wanted)).json()
    assert [frame for frame in stand.frames()[sent:] if frame[5:6] == "S"] == [
        "&3FCSS9,-1500,70000",
        "&3FCFS9,P:1",
        "&3FCFS9,E:2",
        "&3FCFS9,C:3",
        "&3FCFS9,O:4,1,100",
        "&3FCPS9,1",
        "&3F3PSP[1],-999999999",
        "&3F3PSP[2],-999999999",
        "&3F3PSP[3],-999999999",
    ]
    assert armed["pulse"] == wanted["pulse"]
    assert armed["between"] == {"lower": -1500, "upper": 70_000}
    assert [(it["kind"], it["number"]) for it in armed["recorded"]] == [
        ("position", 1),
        ("encoder", 2),
        ("encoder_in_pulses", 3),
    ]
    both = (await stand.get("/bodies/3F/captures")).json()["captures"]
    assert [it["input"] for it in both] == [8, 9]
    assert both[1] == armed
    again = (await stand.client.put("/bodies/3F/captures/9", json=ONCE)).json()
    assert (again["pulse"], again["between"], len(again["recorded"])) == (None, None, 1)


@on_stand(NAMED)
async def test_a_capture_is_disarmed(stand: Stand) -> None:
    await stand.client.put(CAPTURE, json=ONCE)
    disarmed = (await stand.client.delete(CAPTURE)).json()
    assert (disarmed["armed"], disarmed["edge"]) == (False, "off")
    assert (disarmed["captured"], disarmed["recorded"]) == (None, [])


@on_stand(NAMED)
async def test_two_inputs_do_not_capture_into_one_entry(stand: Stand) -> None:
    await stand.client.put(CAPTURE, json=ONCE)
    same = await stand.client.put("/bodies/3F/captures/9", json=ONCE)
    refused(same, 422)
    assert same.json()["detail"] == "Position 25 of arm.3F takes what input 8 captures; nothing was changed."
    await stand.client.delete(CAPTURE)
    assert (await stand.client.put("/bodies/3F/captures/9", json=ONCE)).status_code == 200


@on_stand(NAMED)
async def test_a_moving_motor_takes_none(stand: Stand) -> None:
    await stand.teach_speeds("3F")
    await stand.post("/bodies/3F/moves", FAR)
    refused(await stand.client.put(CAPTURE, json=ONCE), 409)


@on_stand(NAMED)
async def test_what_captures_nothing_is_not_sent(stand: Stand) -> None:
    refused(await stand.client.put(CAPTURE, json={"edge": "rising"}), 422)
    refused(await stand.client.put(CAPTURE, json=ONCE | {"encoder": 25}), 422)
    off = await stand.client.put(CAPTURE, json=ONCE | {"edge": "off"})
    refused(off, 422)
    assert off.json()["detail"] == "edge: off arms nothing; nothing was sent."
    empty = {"lower": {"value": 5, "unit": "pulse"}, "upper": {"value": 5, "unit": "pulse"}}
    refused(await stand.client.put(CAPTURE, json=ONCE | {"between": empty}), 422)
    refused(await stand.get("/bodies/3F/captures/7"), 422)
    assert [frame for frame in stand.frames() if frame[3:4] == "C" and frame[5:6] == "S"] == []
