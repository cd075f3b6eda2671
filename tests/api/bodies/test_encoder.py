"""The encoder over HTTP: counts beside pulses, the set-up by what a turn is, adjustments after moves."""

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gateway.core.errors import InvalidRequest
from gateway.rorze.encoders import EDGES, ResolutionRequest, resolution_of
from tests.api.bodies.test_homing import axis_of
from tests.api.bodies.test_speed_sets import set_by
from tests.api.stand import Stand, on_stand

PATH = "/bodies/01/encoder"
RESOLUTION = {"motor_steps_per_turn": 1_000, "encoder_lines_per_turn": 100}


async def in_encoder_mode(stand: Stand, body: str, **settings: Any) -> None:
    change = {"operating_mode": "encoder", **settings}
    answer = await stand.client.patch(f"/bodies/{body}/settings", json=change)
    assert answer.status_code == 200, answer.text


def moved(distance: int) -> dict[str, Any]:
    return {"kind": "relative", "direction": "cw", "distance": {"value": distance, "unit": "pulse"}}


@on_stand()
async def test_a_position_says_what_it_is_counted_in(stand: Stand) -> None:
    assert (await stand.get("/bodies/01/position")).json()["counted_in"] == "pulses"
    await in_encoder_mode(stand, "01")
    assert (await stand.get("/bodies/01/position")).json()["counted_in"] == "encoder_counts"
    modes = [frame for frame in stand.frames() if frame == "&01EAD"]
    await stand.get("/bodies/01/position")
    assert [frame for frame in stand.frames() if frame == "&01EAD"] == modes, "it is known by now"


@on_stand()
async def test_what_the_encoder_counts_stands_beside_what_the_motor_was_given(stand: Stand) -> None:
    await stand.teach_speeds("01")
    axis_of(stand, 0x01).world.slipped = 0
    assert (await stand.post("/bodies/01/moves?wait=10", moved(1_000))).json()["status"] == "succeeded"
    axis_of(stand, 0x01).world.slipped = 100
    told = (await stand.get(PATH)).json()
    assert told["operating_mode"] == "stepping"
    assert told["last"] == {
        "counted_in": "pulses",
        "position": 1_000,
        "position_in_unit": {"value": 1.0, "unit": "mm"},
        "count": 900,
        "count_in_pulses": 900,
        "difference": 100,
        "stalled": False,
    }
    assert told["settings"]["encoder_ratio"] == 1.0
    assert "adjustment" in told["unavailable"]


@on_stand()
async def test_in_encoder_mode_a_move_is_followed_through_its_adjustment(stand: Stand) -> None:
    await stand.teach_speeds("3F")
    await in_encoder_mode(stand, "3F", adjustment=True, adjustment_speed_pps=200, adjustment_delay_ms=500)
    begun = (await stand.post("/bodies/3F/moves", moved(1_000))).json()
    axis_of(stand).world.slipped = 40
    move = (await stand.get(f"/bodies/3F/moves/{begun['id']}?wait=30")).json()
    assert (move["status"], move["position"], move["target_position"]) == ("succeeded", 1_000, 1_000)
    told = (await stand.get("/bodies/3F/encoder")).json()["last"]
    assert (told["counted_in"], told["position"], told["difference"]) == ("encoder_counts", 1_000, None)


@on_stand()
async def test_an_adjustment_that_takes_too_long_is_a_stall_that_the_encoder_has_found(stand: Stand) -> None:
    await stand.teach_speeds("3F")
    await in_encoder_mode(stand, "3F", adjustment=True, adjustment_limit=10)
    begun = (await stand.post("/bodies/3F/moves", moved(1_000))).json()
    axis_of(stand).world.slipped = 40
    move = (await stand.get(f"/bodies/3F/moves/{begun['id']}?wait=30")).json()
    assert (move["status"], move["end_cause"]) == ("failed", "stall")
    assert (await stand.get("/bodies/3F/encoder")).json()["last"]["stalled"]


@on_stand()
async def test_a_curve_in_encoder_mode_goes_by_the_pulses_that_are_put_out(stand: Stand) -> None:
    curve = "/bodies/01/patterns/30/curve?distance=1&unit=mm"
    assert (await stand.get(curve)).json()["pulses"] == 1_000
    await in_encoder_mode(stand, "01", encoder_ratio=2.5)
    told = (await stand.get(curve)).json()
    assert (told["distance"], told["pulses"]) == (1_000, 2_500)
    last = told["points"][-1]
    assert (last["position"], last["position_in_unit"]) == (pytest.approx(2_500), pytest.approx(1.0))


@on_stand()
async def test_an_encoder_is_set_up_by_what_a_turn_is(stand: Stand) -> None:
    plan = (await stand.client.put(f"{PATH}/resolution", json={**RESOLUTION, "dry_run": True})).json()
    assert (plan["encoder_multiplier"], plan["encoder_ratio"], plan["changed"]) == ("quadruple", 2.5, None)
    assert (plan["counts_per_turn"], plan["drift_per_turn"]) == (400, 0)
    assert set_by(stand.frames()) == []
    done = (await stand.client.put(f"{PATH}/resolution", json=RESOLUTION)).json()
    assert [it["outcome"] for it in done["changed"]["steps"]] == ["unchanged", "changed"]
    assert set_by(stand.frames()) == ["PBS2.50"]
    seen = (await stand.get(PATH)).headers["etag"]
    await stand.client.patch(PATH, json={"encoder_stall_threshold": 100})
    stale = await stand.client.put(f"{PATH}/resolution", json=RESOLUTION, headers={"If-Match": seen})
    assert stale.status_code == 412
    few = {"motor_steps_per_turn": 200, "encoder_lines_per_turn": 500}
    refused = await stand.client.put(f"{PATH}/resolution", json=few)
    assert (refused.status_code, refused.json()["moved"]) == (422, "no")
    assert "Take finer motor steps" in refused.json()["remedy"]


@given(st.integers(1, 10**8), st.integers(1, 10**7), st.sampled_from(["double", "quadruple", None]))
def test_a_ratio_is_the_pulses_of_a_turn_over_its_counts_or_refused(
    steps: int, lines: int, multiplier: Any
) -> None:
    wanted = ResolutionRequest(
        motor_steps_per_turn=steps, encoder_lines_per_turn=lines, multiplier=multiplier
    )
    ratios = {name: steps / (lines * edges) for name, edges in EDGES.items()}
    try:
        name, ratio, exact = resolution_of(wanted)
    except InvalidRequest:
        tried = [ratios[multiplier]] if multiplier else ratios.values()
        assert all(not 1 <= round(it, 2) <= 99_999.99 for it in tried)
        return
    assert multiplier in (None, name)
    assert exact == ratios[name]
    assert abs(ratio - exact) <= 0.0050001
