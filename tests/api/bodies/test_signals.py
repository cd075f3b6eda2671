"""Inputs, outputs, sensors and error outputs of a body over HTTP."""

import asyncio

from simulator.rorze.world import CW_LIMIT
from tests.api.bodies.test_moves import refused
from tests.api.stand import Stand, on_stand

NAMED = {
    "arm": [
        {"id": "3F", "inputs": {"0": "door closed", "9": "index"}, "outputs": {"3": "brake", "15": "lamp"}}
    ]
}


def feed(stand: Stand, levels: int) -> None:
    """Put levels on the inputs, and let them settle."""
    axis = stand.port.machine.axes[0x3F]
    axis.world.inputs = levels
    axis.sense(asyncio.get_running_loop().time())


@on_stand(NAMED)
async def test_inputs_are_booleans_with_their_names(stand: Stand) -> None:
    feed(stand, 0x201)
    await asyncio.sleep(0.1)
    told = (await stand.get("/bodies/3F/inputs")).json()
    assert told["body_id"] == "arm.3F"
    assert told["inputs"][0] == {"number": 0, "name": "door closed", "on": True}
    assert told["inputs"][9] == {"number": 9, "name": "index", "on": True}
    assert [it["on"] for it in told["inputs"]] == [True, *[False] * 8, True]
    assert told["inputs"][1]["name"] is None
    assert told["age_ms"] >= 0


@on_stand(NAMED)
async def test_an_output_is_switched_and_read_back(stand: Stand) -> None:
    on = await stand.client.put("/bodies/3F/outputs/3", json={"on": True})
    assert (on.status_code, on.json()) == (200, {"number": 3, "name": "brake", "on": True})
    assert stand.frames()[-2:] == ["&3FCOS3,1", "&3FCOD3"]
    told = (await stand.get("/bodies/3F/outputs")).json()["outputs"]
    assert [it["number"] for it in told if it["on"]] == [3]
    assert told[15] == {"number": 15, "name": "lamp", "on": False}
    assert (await stand.client.put("/bodies/3F/outputs/3", json={"on": False})).json()["on"] is False


@on_stand(NAMED)
async def test_an_output_that_does_not_switch_is_told(stand: Stand) -> None:
    await stand.send("3F", "set-operating-mode", mode="servo")
    answer = await stand.client.put("/bodies/3F/outputs/0", json={"on": True})
    refused(answer, 409)
    assert answer.json()["type"].rpartition(":")[2] == "not-done"
    assert "CLR" in answer.json()["detail"]


@on_stand(NAMED)
async def test_a_pulse_inverts_an_output_for_a_time(stand: Stand) -> None:
    assert (await stand.post("/bodies/3F/outputs/3/pulses", {"duration_ms": 1000})).json()["on"] is True
    again = await stand.post("/bodies/3F/outputs/3/pulses", {"duration_ms": 1000})
    refused(again, 422)
    await asyncio.sleep(1.1)
    assert (await stand.get("/bodies/3F/outputs")).json()["outputs"][3]["on"] is False
    refused(await stand.post("/bodies/3F/outputs/3/pulses", {"duration_ms": 0}), 422, "duration_ms")


@on_stand(NAMED)
async def test_sensors_are_booleans(stand: Stand) -> None:
    axis = stand.port.machine.axes[0x3F]
    axis.world.forced.update({CW_LIMIT: True})
    axis.sense(asyncio.get_running_loop().time())
    sensors = (await stand.get("/bodies/3F/sensors")).json()["sensors"]
    assert sensors == {
        "stall": False,
        "origin": False,
        "cw_limit": True,
        "ccw_limit": False,
        "in_position": False,
        "ems": False,
    }


@on_stand(NAMED)
async def test_an_error_output_is_set_comes_and_is_taken_back(stand: Stand) -> None:
    await stand.teach_speeds("3F")
    none = (await stand.get("/bodies/3F/error-outputs")).json()["error_outputs"]
    assert [it["cause"] for it in none] == ["ems", "limit", "stall", "any"]
    assert all((it["output"], it["on"], it["standing"]) == (None, None, False) for it in none)

    held = await stand.client.put("/bodies/3F/error-outputs/limit", json={"output": 3, "on": True})
    brake = {"cause": "limit", "output": 3, "name": "brake", "on": True, "standing": False}
    assert held.json()["error_outputs"] == [brake]

    await stand.post(
        "/bodies/3F/moves",
        {"kind": "relative", "direction": "cw", "distance": {"value": 90_000, "unit": "pulse"}},
    )
    axis = stand.port.machine.axes[0x3F]
    await asyncio.sleep(0.3)
    axis.world.forced.update({CW_LIMIT: True})
    axis.sense(asyncio.get_running_loop().time())
    await asyncio.sleep(0.3)
    assert (await stand.get("/bodies/3F/error-outputs")).json()["error_outputs"][1] == brake | {
        "standing": True
    }
    assert (await stand.get("/bodies/3F/outputs")).json()["outputs"][3]["on"] is True

    taken = (await stand.post("/bodies/3F/error-outputs/reset")).json()["error_outputs"]
    assert taken[1] == brake
    assert (await stand.get("/bodies/3F/outputs")).json()["outputs"][3]["on"] is False
    nothing = await stand.client.put("/bodies/3F/error-outputs/limit", json={"output": None})
    assert nothing.json()["error_outputs"][0]["output"] is None


@on_stand(NAMED)
async def test_what_cannot_be_is_not_sent(stand: Stand) -> None:
    sent = len([frame for frame in stand.frames() if frame[3:4] == "C"])
    refused(await stand.client.put("/bodies/3F/outputs/16", json={"on": True}), 422)
    refused(await stand.client.put("/bodies/3F/outputs/3", json={"on": 1}), 422, "on")
    refused(await stand.client.put("/bodies/3F/error-outputs/limit", json={"output": 3}), 422)
    refused(await stand.client.put("/bodies/3F/error-outputs/fire", json={"output": 3, "on": True}), 422)
    refused(await stand.get("/bodies/77/inputs"), 404)
    assert len([frame for frame in stand.frames() if frame[3:4] == "C"]) == sent
