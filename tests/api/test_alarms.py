"""Alarms over HTTP: what a technician reads, and the calls that help."""

import asyncio
from typing import Any

from simulator.rorze.world import EMS
from tests.api.access.guarded import Keys, guarded
from tests.api.stand import Stand, on_stand

RELATIVE = {"kind": "relative", "direction": "cw", "distance": {"value": 500, "unit": "pulse"}}
SEEN_S = 40.0


async def power_is_cut(stand: Stand) -> dict[str, Any]:
    stand.port.machine.brown_out(0x3F, 0.05, asyncio.get_running_loop().time())
    await asyncio.sleep(SEEN_S)
    [alarm] = (await stand.get("/alarms?standing=true")).json()["alarms"]
    return dict(alarm)


@on_stand()
async def test_an_alarm_tells_what_happened_what_the_motor_did_and_what_to_do_next(stand: Stand) -> None:
    assert (await stand.get("/alarms")).json() == {"alarms": []}
    alarm = await power_is_cut(stand)
    assert alarm["cause"] == "body.power_cycled"
    assert alarm["subject"] == "/bodies/arm.3F"
    assert alarm["en"].keys() == alarm["ja"].keys() == {"happened", "motor", "remedy"}
    assert alarm["manual"] == "RC-420 manual 5.4.2"
    assert (await stand.get(f"/alarms/{alarm['id']}")).json() == alarm
    for call in alarm["next"]:
        answer = await stand.client.request(call["method"], call["path"], json=call.get("body"))
        assert answer.status_code < 300, answer.text


@on_stand()
async def test_a_reset_has_no_body_and_is_refused_while_the_cause_lasts(stand: Stand) -> None:
    alarm = await power_is_cut(stand)
    refused = await stand.post(f"/alarms/{alarm['id']}/reset")
    assert refused.status_code == 409
    assert refused.json()["type"].endswith(":alarm-lasts")
    assert refused.json()["moved"] == "no"
    assert refused.json()["next"] == alarm["next"]
    japanese = await stand.client.post(f"/alarms/{alarm['id']}/reset", headers={"accept-language": "ja"})
    assert japanese.json()["title"] == "アラームの原因が続いています"
    assert alarm["ja"]["happened"] in japanese.json()["detail"]
    await stand.post("/bodies/3F/power-cycle/acknowledge")
    frames = len(stand.frames())
    done = await stand.post(f"/alarms/{alarm['id']}/reset")
    assert done.status_code == 200
    assert done.json()["reset_by"]
    assert stand.frames()[frames:] == []
    assert (await stand.get("/alarms?standing=true")).json()["alarms"] == []
    assert [it["id"] for it in (await stand.get("/alarms")).json()["alarms"]] == [alarm["id"]]
    assert (await stand.get("/alarms?standing=false")).json()["alarms"] == [done.json()]


@on_stand()
async def test_an_alarm_that_is_none_is_not_found(stand: Stand) -> None:
    answer = await stand.post("/alarms/none/reset")
    assert answer.status_code == 404
    assert [call["path"] for call in answer.json()["next"]] == ["/alarms"]


@on_stand()
async def test_a_refusal_names_the_calls_that_help(stand: Stand) -> None:
    alarm = await power_is_cut(stand)
    move = {"kind": "absolute", "position": {"value": 500, "unit": "pulse"}}
    refused = await stand.post("/bodies/3F/moves", move)
    assert refused.json()["type"].endswith(":power-cycled")
    assert refused.json()["next"] == alarm["next"]


@on_stand()
async def test_a_controller_s_code_names_the_call_that_helps(stand: Stand) -> None:
    axis = stand.port.machine.axes[0x3F]
    axis.world.forced.update({EMS: True})
    axis.sense(asyncio.get_running_loop().time())
    refused = await stand.post("/bodies/3F/moves", RELATIVE)
    assert refused.json()["code"] == "0x51"
    commands = "/bodies/arm.3F/commands"
    paths = [call["path"] for call in refused.json()["next"]]
    assert paths == ["/bodies/arm.3F/status", f"{commands}/clear-controller-status"]
    [move] = (await stand.get("/bodies/3F/moves")).json()["moves"]
    assert move["error"]["next"] == refused.json()["next"]


@on_stand()
async def test_a_busy_body_names_its_stop(stand: Stand) -> None:
    await stand.teach_speeds("3F")
    far = {**RELATIVE, "distance": {"value": 50_000, "unit": "pulse"}}
    assert (await stand.post("/bodies/3F/moves", far)).status_code == 202
    refused = await stand.post("/bodies/3F/moves", far)
    stop = refused.json()["next"][-1]
    assert (stop["method"], stop["path"]) == ("POST", "/bodies/arm.3F/stop")
    assert (await stand.post(stop["path"], stop["body"])).status_code == 200


@on_stand(latch=True)
async def test_a_latched_body_names_the_reset(stand: Stand) -> None:
    await stand.teach_speeds("3F")
    alarm = await power_is_cut(stand)
    await stand.post("/bodies/3F/power-cycle/acknowledge")
    await stand.teach_speeds("3F")
    refused = await stand.post("/bodies/3F/moves", RELATIVE)
    assert refused.status_code == 409
    assert refused.json()["type"].endswith(":latched")
    assert refused.json()["next"][-1]["path"] == f"/alarms/{alarm['id']}/reset"
    japanese = await stand.client.post("/bodies/3F/moves", json=RELATIVE, headers={"accept-language": "ja"})
    assert japanese.json()["title"] == "アラームが発生中です"
    assert alarm["id"] in japanese.json()["detail"]
    await stand.post(refused.json()["next"][-1]["path"])
    assert (await stand.post("/bodies/3F/moves", RELATIVE)).status_code == 202


@guarded()
async def test_a_key_sees_and_resets_the_alarms_of_its_scope(stand: Stand, keys: Keys) -> None:
    for line in stand.ports:
        stand.ports[line].machine.brown_out(0x00, 0.05, asyncio.get_running_loop().time())
    await asyncio.sleep(SEEN_S)
    everything = (await stand.get("/alarms", **keys.header("viewer"))).json()["alarms"]
    assert {it["subject"] for it in everything} == {"/bodies/arm.00", "/bodies/leg.00"}
    [own] = (await stand.get("/alarms", **keys.header("operator", "arm"))).json()["alarms"]
    assert own["subject"] == "/bodies/arm.00"
    [other] = [it for it in everything if it != own]
    for header, alarm, status in (
        (keys.header("operator", "arm"), other, 403),
        (keys.header("viewer"), own, 403),
        (keys.header("operator", "arm"), own, 409),
    ):
        answer = await stand.post(f"/alarms/{alarm['id']}/reset", **header)
        assert answer.status_code == status, answer.text


@on_stand()
async def test_a_line_that_is_down_names_where_its_state_stands(stand: Stand) -> None:
    stand.port.unplug()
    for path in ("/lines/arm/scans", "/bodies/3F/commands/get-controller-status"):
        refused = await stand.post(path)
        assert refused.json()["type"].endswith(":line-down")
        assert [call["path"] for call in refused.json()["next"]] == ["/lines/arm"]
