"""Jogging a body over HTTP: it moves only for as long as heartbeats come."""

import asyncio

from tests.api.bodies.test_moves import refused
from tests.api.stand import Stand, on_stand

JOG = {"direction": "cw"}


@on_stand()
async def test_a_body_jogs_while_heartbeats_come_and_stops_when_told(stand: Stand) -> None:
    await stand.teach_speeds("3F")
    started = await stand.post("/bodies/3F/jogs", JOG)
    assert started.status_code == 201, started.text
    jog, place = started.json(), started.headers["location"]
    assert place == f"/bodies/arm.3F/jogs/{jog['id']}"
    assert (jog["state"], jog["heartbeat_within_ms"], jog["distance"]) == ("jogging", 500, 50_000)
    for _ in range(4):
        await asyncio.sleep(0.4)
        assert (await stand.post(f"{place}/heartbeat")).json()["state"] == "jogging"
    ended = await stand.post(f"{place}/stop")
    assert (ended.status_code, ended.json()["state"]) == (200, "ended")
    move = (await stand.get(f"/bodies/3F/moves/{jog['id']}")).json()
    assert (move["status"], move["frame"]) == ("stopped", "&3F2+M50000\\r")
    assert (await stand.post(f"{place}/stop")).json() == ended.json()


@on_stand()
async def test_without_a_heartbeat_it_is_stopped_and_the_next_one_is_told_so(stand: Stand) -> None:
    await stand.teach_speeds("3F")
    place = (await stand.post("/bodies/3F/jogs", JOG | {"direction": "-"})).headers["location"]
    await asyncio.sleep(2)
    assert "&3F5SS" in stand.frames()
    late = await stand.post(f"{place}/heartbeat")
    assert (late.status_code, late.json()["type"].rpartition(":")[2]) == (409, "jog-over")
    assert (await stand.get("/bodies/3F/status")).json()["moving"] is False


@on_stand()
async def test_the_length_is_in_the_unit_of_the_body(stand: Stand) -> None:
    await stand.teach_speeds("01")
    jog = JOG | {"speed": "high", "at_most": {"value": 2.5, "unit": "mm"}}
    assert (await stand.post("/bodies/01/jogs", jog)).json()["distance"] == 2_500
    refused(await stand.post("/bodies/3F/jogs", jog), 422)


@on_stand()
async def test_what_makes_no_jog_is_not_sent(stand: Stand) -> None:
    before = stand.moved()
    refused(await stand.post("/bodies/3F/jogs", {"direction": "up"}), 422, "direction")
    refused(await stand.post("/bodies/3F/jogs", {}), 422, "direction")
    refused(await stand.post("/bodies/77/jogs", JOG), 404)
    refused(await stand.post("/bodies/3F/jogs/nobody/heartbeat"), 404)
    refused(await stand.post("/bodies/3F/jogs/nobody/stop"), 404)
    assert stand.moved() == before
