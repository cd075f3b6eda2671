"""Acceleration patterns over HTTP: their speed sets, their changes of speed, and the curves they make."""

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import pytest

from tests.api.bodies.test_speed_sets import set_by
from tests.api.stand import Stand, on_stand

PATTERN = "/bodies/01/patterns/17"
UP = {"start_speed_pps": 5_000, "maximum_speed_pps": 50_000, "acceleration_pps_s": 70_000}
UP |= {"rising_percent": 30, "falling_percent": 30}
DOWN = {"start_speed_pps": 50, "maximum_speed_pps": 50_000, "acceleration_pps_s": 95_000}
DOWN |= {"rising_percent": 50, "falling_percent": 20}
FAR = {"value": 150_000, "unit": "pulse"}
SLOW_AT_THE_SENSOR = [
    {"point": 0, "end": 78_000, "speed_pps": 10_000},
    {"point": 1, "begin": 80_000, "speed_pps": 50_000},
]
"""RC-420 manual 13.3.7."""


async def teach(stand: Stand, changes: Sequence[object] = ()) -> dict[str, Any]:
    """Set the pattern of RC-420 manual 13.3.4."""
    await stand.client.put("/bodies/01/speed-sets/12", json=UP)
    await stand.client.put("/bodies/01/speed-sets/13", json=DOWN)
    wanted = {"acceleration_set": 12, "deceleration_set": 13, "changes": list(changes)}
    answer = await stand.client.put(PATTERN, json=wanted)
    assert answer.status_code == 200, answer.text
    return dict(answer.json())


@on_stand()
async def test_a_pattern_that_was_never_set_says_so(stand: Stand) -> None:
    found = (await stand.get(PATTERN)).json()
    assert found == {
        "body_id": "arm.01",
        "number": 17,
        "acceleration_set": None,
        "deceleration_set": None,
        "changes": [],
        "flash": None,
    }
    standard = (await stand.get("/bodies/01/patterns/30")).json()
    assert (standard["acceleration_set"], standard["changes"]) == (30, [])
    assert (
        await stand.client.put("/bodies/01/patterns/30", json={"acceleration_set": 1, "deceleration_set": 1})
    ).status_code == 422
    assert (await stand.client.patch(PATTERN, json={"acceleration_set": 1})).status_code == 422
    assert {*set_by(stand.frames())} == {"9CS"}, "the command error that looking has left is cleared"


@on_stand()
async def test_changes_of_speed_are_told_with_where_they_begin_and_end(stand: Stand) -> None:
    told = await teach(stand, SLOW_AT_THE_SENSOR)
    first, second = told["changes"]
    assert (first["point"], first["end"], first["speed_pps"]) == (0, 78_000, 10_000)
    assert first["begin"] < 78_000
    assert second["begin"] == 80_000
    assert second["begin_in_unit"] == {"value": 80.0, "unit": "mm"}
    assert second["speed"] == {"value": 50.0, "unit": "mm/s"}
    assert [frame for frame in set_by(stand.frames()) if frame != "9CS"][-3:] == [
        "SPSA[17],A:S[12],D:S[13]",
        "SESA[17],0,T78000,S10000",
        "SESA[17],1,F80000,S50000",
    ]


@on_stand()
async def test_what_is_so_already_is_not_sent_again(stand: Stand) -> None:
    await teach(stand, SLOW_AT_THE_SENSOR)
    before = len(set_by(stand.frames()))
    told = await teach(stand, SLOW_AT_THE_SENSOR)
    assert {step["outcome"] for step in told["steps"]} == {"unchanged"}
    moved = [SLOW_AT_THE_SENSOR[0], {"point": 1, "begin": 81_000, "speed_pps": 50_000}]
    await stand.client.patch(PATTERN, json={"changes": moved})
    assert set_by(stand.frames())[before:] == ["SESA[17],1,F81000,S50000"]


@on_stand()
async def test_a_change_that_shall_go_takes_all_others_with_it_and_these_come_back(stand: Stand) -> None:
    await teach(stand, SLOW_AT_THE_SENSOR)
    told = (await stand.client.patch(PATTERN, json={"changes": SLOW_AT_THE_SENSOR[:1]})).json()
    assert [it["point"] for it in told["changes"]] == [0]
    assert set_by(stand.frames())[-2:] == ["SESA[17]", "SESA[17],0,T78000,S10000"]
    none = (await stand.client.patch(PATTERN, json={"changes": []})).json()
    assert none["changes"] == []


@on_stand()
async def test_changes_that_do_not_suit_the_speed_sets_can_be_cleared(stand: Stand) -> None:
    await teach(stand, SLOW_AT_THE_SENSOR)
    await stand.client.patch("/bodies/01/speed-sets/12", json={"acceleration_pps_s": 100})
    assert (await stand.get(PATTERN)).json()["changes"] is None
    cleared = await stand.client.patch(PATTERN, json={"changes": []})
    assert (cleared.status_code, cleared.json()["changes"]) == (200, [])


@on_stand()
async def test_changes_that_no_move_could_make_are_refused_before_anything_is_sent(stand: Stand) -> None:
    await teach(stand)
    frames = [frame for frame in set_by(stand.frames()) if frame != "9CS"]
    for changes, said in (
        ([{"point": 0, "begin": 100, "speed_pps": 10_000}], "are reached only at pulse"),
        (
            [{"point": 0, "begin": 30_000, "speed_pps": 9_000}, {"point": 1, "end": 31_000, "speed_pps": 1}],
            "would start",
        ),
    ):
        answer = await stand.client.patch(PATTERN, json={"changes": changes})
        assert (answer.status_code, answer.json()["moved"]) == (422, "no")
        assert said in answer.json()["detail"]
    other = {"acceleration_set": 1, "deceleration_set": 2, "changes": SLOW_AT_THE_SENSOR}
    assert (await stand.client.put("/bodies/01/patterns/3", json=other)).status_code == 422
    assert [frame for frame in set_by(stand.frames()) if frame != "9CS"] == frames


@on_stand()
async def test_a_stale_etag_leaves_a_pattern_alone(stand: Stand) -> None:
    seen = (await stand.get(PATTERN)).headers["etag"]
    await teach(stand)
    frames = set_by(stand.frames())
    stale = await stand.client.patch(PATTERN, json={"changes": []}, headers={"If-Match": seen})
    assert stale.status_code == 412
    assert set_by(stand.frames()) == frames


@on_stand()
async def test_each_point_and_each_place_may_be_given_once(stand: Stand) -> None:
    for wrong in (
        [{"point": 1, "begin": 1, "speed_pps": 1}, {"point": 1, "begin": 2, "speed_pps": 1}],
        [{"point": 1, "begin": 1, "end": 2, "speed_pps": 1}],
        [{"point": 1, "speed_pps": 1}],
        [{"point": 16, "begin": 1, "speed_pps": 1}],
    ):
        assert (await stand.client.patch(PATTERN, json={"changes": wrong})).status_code == 422


@on_stand()
async def test_patterns_are_listed_in_their_order(stand: Stand) -> None:
    await teach(stand)
    found = (await stand.get("/bodies/01/patterns?first=16&last=18")).json()["patterns"]
    assert [(it["number"], it["acceleration_set"]) for it in found] == [(16, None), (17, 12), (18, None)]


@on_stand()
async def test_a_curve_is_what_the_move_then_does(stand: Stand) -> None:
    await teach(stand)
    curve = (await stand.get(f"{PATTERN}/curve?distance=100000")).json()
    first, *_, last = curve["points"]
    assert (first["time_s"], first["position"], first["speed"]) == (0.0, 0.0, 5_000)
    assert last["time_s"] == curve["total_time_s"]
    assert last["position"] == pytest.approx(100_000)
    assert last["speed"] == pytest.approx(50, abs=1)
    assert curve["top_speed"] == pytest.approx(50_000)
    assert all(one["position"] <= other["position"] for one, other in pairwise(curve["points"]))
    assert first["speed_in_unit"] == 5.0
    assert curve["distance_in_unit"] == {"value": 100.0, "unit": "mm"}
    plan = {"kind": "relative", "direction": "cw", "distance": {"value": 100_000, "unit": "pulse"}}
    planned = (await stand.post("/bodies/01/moves", {**plan, "pattern": 17, "validate_only": True})).json()
    assert planned["duration_s"] == pytest.approx(curve["total_time_s"])


@on_stand()
async def test_a_curve_goes_through_its_changes_of_speed(stand: Stand) -> None:
    await teach(stand, SLOW_AT_THE_SENSOR)
    points = (await stand.get(f"{PATTERN}/curve?distance=150&unit=mm&points=500")).json()["points"]
    at_sensor = [it["speed"] for it in points if 78_100 < it["position"] < 79_900]
    assert at_sensor
    assert max(at_sensor) == pytest.approx(10_000)


@on_stand()
async def test_a_curve_of_a_draft_is_that_of_the_pattern_once_it_is_set(stand: Stand) -> None:
    draft = {"acceleration": UP, "deceleration": DOWN, "changes": SLOW_AT_THE_SENSOR, "distance": FAR}
    drawn = (await stand.post(f"{PATTERN}/curve", draft)).json()
    assert set_by(stand.frames()) == []
    await teach(stand, SLOW_AT_THE_SENSOR)
    assert (await stand.get(f"{PATTERN}/curve?distance=150000")).json() == drawn


@on_stand()
async def test_a_draft_that_would_be_refused_says_why(stand: Stand) -> None:
    twice = [{"point": 0, "begin": it, "speed_pps": 20_000} for it in (40_000, 60_000)]
    for draft, said in (
        ({"acceleration": {**UP, "maximum_speed_pps": 4_000}}, "above maximum_speed_pps"),
        ({"acceleration": UP, "changes": twice}, "each point may be given once"),
        (
            {"acceleration": UP, "changes": [{"point": 0, "begin": 10, "speed_pps": 20_000}]},
            "would be refused",
        ),
    ):
        answer = await stand.post(f"{PATTERN}/curve", {**draft, "distance": FAR})
        assert answer.status_code == 422
        assert said in answer.text


@on_stand()
async def test_a_slow_curve_has_no_ramps(stand: Stand) -> None:
    curve = (await stand.get("/bodies/01/patterns/30/curve?distance=100&speed=low&points=2")).json()
    assert curve["total_time_s"] == pytest.approx(2.0)
    assert {it["speed"] for it in curve["points"]} == {50.0}


@on_stand()
async def test_what_would_be_refused_has_no_curve(stand: Stand) -> None:
    assert (await stand.get(f"{PATTERN}/curve?distance=100")).status_code == 422
    await teach(stand, SLOW_AT_THE_SENSOR)
    too_short = await stand.get(f"{PATTERN}/curve?distance=90000")
    assert too_short.status_code == 422
    assert "would be refused" in too_short.json()["detail"]
    for query in ("distance=1.5", "distance=0", "distance=0.0001&unit=mm", "distance=5&unit=deg", ""):
        assert (await stand.get(f"{PATTERN}/curve?{query}")).status_code == 422
