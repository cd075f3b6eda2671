"""Moves of SCARA robots over HTTP."""

from typing import Any

import pytest

from tests.api.scaras.cell import on_cell
from tests.api.stand import Stand, socket

LINE: dict[str, Any] = {
    "kind": "line",
    "x": {"value": 0, "unit": "mm"},
    "y": {"value": 215, "unit": "mm"},
    "pattern": 3,
}


@on_cell
async def test_a_move_is_started_followed_and_found_again(stand: Stand) -> None:
    begun = await stand.post("/scaras/wafer/moves", LINE)
    assert begun.status_code == 202
    move = begun.json()
    assert begun.headers["location"] == f"/scaras/wafer/moves/{move['id']}"
    over = (await stand.get(f"{begun.headers['location']}?wait=30")).json()
    assert (over["status"], over["kind"], over["end_cause"]) == ("succeeded", "line", "normal")
    assert over["coordinates"]["y"]["value"] == pytest.approx(215_000, abs=60)
    assert (await stand.get("/scaras/wafer/moves")).json()["moves"] == [over]
    for axis in over["axes"]:
        own = (await stand.get(f"/bodies/{axis['body_id']}/moves/{axis['move_id']}")).json()
        assert (own["status"], own["group_id"], own["command"]) == ("succeeded", "arm.8A", "HMM")
    assert (await stand.get("/scaras/wafer/moves/nothing")).status_code == 404


@on_cell
async def test_who_waits_has_the_end(stand: Stand) -> None:
    over = await stand.post("/scaras/wafer/moves?wait=30", LINE)
    assert (over.status_code, over.json()["status"]) == (200, "succeeded")


@on_cell
async def test_a_client_that_has_missed_something_learns_of_the_move_under_way(stand: Stand) -> None:
    move = (await stand.post("/scaras/wafer/moves", LINE)).json()
    missed = await stand.get("/events?after=00000000-000000000001&limit=2&bodies=wafer")
    (_, snapshot) = missed.json()["events"]
    assert [it["id"] for it in snapshot["data"]["moves"]] == [move["id"]]


@on_cell
async def test_a_point_with_an_unknown_key_is_answered_with_those_it_has(stand: Stand) -> None:
    points = [{"x_um": 255_000, "y": {"value": 300, "unit": "mm"}}]
    refused = await stand.post("/scaras/wafer/moves", {"kind": "path", "points": points})
    assert refused.status_code == 422
    assert "points.0.x_um: is not known here (known are x, y, radius" in refused.json()["detail"]


@on_cell
async def test_a_misspelt_key_is_named_where_the_kind_is_the_name_of_a_field(stand: Stand) -> None:
    refused = await stand.post("/scaras/wafer/moves", {"kind": "path", "path": 3, "pattren": 1})
    assert refused.status_code == 422
    assert "pattren: is not known here (did you mean pattern?); nothing" in refused.json()["detail"]
    assert refused.json()["errors"][0]["field"] == "pattren"


@on_cell
async def test_a_plan_moves_nothing(stand: Stand) -> None:
    plan = (await stand.post("/scaras/wafer/moves", {**LINE, "validate_only": True})).json()
    assert plan["frames"][-3:] == ["&8AHDSH[63],0,X:0,Y:215000,R:0\\r", "&8AHMSA[3],H[63]\\r", "&8AHMM\\r"]
    assert plan["length_um"] == pytest.approx(100_000, abs=20)
    assert plan["start"]["y"]["value"] == pytest.approx(115_000, abs=1)
    assert stand.moved() == []


@pytest.mark.parametrize(
    "request_",
    [
        {"kind": "circle"},
        {"kind": "line", "x": {"value": 0, "unit": "mm"}},
        {"kind": "line", "x": {"value": 0, "unit": "pulse"}, "y": {"value": 0, "unit": "mm"}},
        {"kind": "path", "path": 64},
        {"kind": "path"},
        {"kind": "path", "points": []},
        {"kind": "path", "path": 3, "points": [{"place": "center"}]},
        {"kind": "offset"},
        {"kind": "extend", "distance": {"value": 0, "unit": "mm"}},
        {"kind": "retract", "distance": {"value": -1, "unit": "mm"}},
        {"kind": "rotate", "radius": {"value": 1, "unit": "mm"}, "angle": {"value": 1, "unit": "mm"}},
        {"kind": "align", "x": {"value": 0, "unit": "mm"}, "path": 3},
        {"kind": "align"},
        {"kind": "finger", "angle": {"value": 1, "unit": "deg"}, "pattern": 30},
    ],
)
def test_what_is_no_move_is_refused(request_: dict[str, Any]) -> None:
    @on_cell
    async def story(stand: Stand) -> None:
        before = len(stand.frames())
        assert (await stand.post("/scaras/wafer/moves", request_)).status_code == 422
        assert stand.frames()[before:] == []

    story()


@on_cell
async def test_a_stop_of_the_robot_stops_all_axes(stand: Stand) -> None:
    slow = {"speed_set": 3, "speed": 20_000}
    for body in ("02", "03", "04"):
        await stand.send(body, "set-maximum-speed", **slow)
    begun = (await stand.post("/scaras/wafer/moves", LINE)).json()
    stopped = (await stand.post("/scaras/wafer/stop", {"mode": "immediate"})).json()
    assert stopped["confirmed"]
    assert [body["body_id"] for body in stopped["bodies"]] == ["arm.02", "arm.03", "arm.04"]
    over = (await stand.get(f"/scaras/wafer/moves/{begun['id']}?wait=10")).json()
    assert (over["status"], over["end_cause"]) == ("stopped", "stop_command")


@on_cell
async def test_events_of_a_robot_can_be_wanted_by_its_id(stand: Stand) -> None:
    async with socket(stand, "/events?bodies=Wafer&types=scara.move.*") as events:
        await events.message()
        await stand.post("/scaras/wafer/moves?wait=30", LINE)
        first = await events.event()
        assert (first["type"], first["subject"]) == ("scara.move.queued", "/scaras/wafer")
