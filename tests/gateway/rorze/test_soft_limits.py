"""A refusal at a soft limit names the target and the limit; other refusals keep the controller's words."""

from collections.abc import Mapping
from typing import Any

import pytest

from tests.api.stand import Stand, on_stand

LIMITS = {"soft_limits": {"lower": -1000, "upper": 1200}}


async def refused(stand: Stand, move: Mapping[str, object], **headers: str) -> dict[str, Any]:
    await stand.teach_speeds("01")
    assert (await stand.client.patch("/bodies/01/settings", json=LIMITS)).status_code == 200
    answer = await stand.post("/bodies/01/moves", move, **headers)
    assert (answer.status_code, answer.json()["code"], answer.json()["moved"]) == (422, "0x5D", "no")
    return dict(answer.json())


@pytest.mark.parametrize(
    ("move", "said"),
    [
        (
            {"kind": "absolute", "position": {"value": 5, "unit": "mm"}},
            "refused 1AM: the target 5000 lies beyond its upper soft limit 1200 (pulses)",
        ),
        (
            {"kind": "relative", "direction": "ccw", "distance": {"value": 1001, "unit": "pulse"}},
            "refused 1-M: the target -1001 lies beyond its lower soft limit -1000 (pulses)",
        ),
    ],
)
def test_a_refusal_names_target_and_limit(move: dict[str, object], said: str) -> None:
    @on_stand()
    async def story(stand: Stand) -> None:
        problem = await refused(stand, move)
        assert problem["detail"] == f"arm.01 {said}. Nothing moved because of it."
        assert "soft limits" in problem["remedy"]

    story()


@on_stand()
async def test_it_is_told_in_japanese_too(stand: Stand) -> None:
    move = {"kind": "absolute", "position": {"value": 5, "unit": "mm"}}
    problem = await refused(stand, move, **{"accept-language": "ja"})
    assert "目標位置 5000 が移動可能範囲の上限 1200 を超えています" in problem["detail"]


@on_stand()
async def test_a_command_by_its_name_is_refused_in_the_same_words(stand: Stand) -> None:
    await refused(stand, {"kind": "absolute", "position": {"value": 5, "unit": "mm"}})
    answer = await stand.post("/bodies/01/commands/move-to", {"position": -2000})
    assert "the target -2000 lies beyond its lower soft limit -1000" in answer.json()["detail"]


@on_stand()
async def test_the_record_of_a_move_that_was_refused_has_the_same_words(stand: Stand) -> None:
    await refused(stand, {"kind": "absolute", "position": {"value": 5, "unit": "mm"}})
    [move] = (await stand.get("/bodies/01/moves")).json()["moves"]
    assert "the target 5000 lies beyond its upper soft limit 1200 (pulses)" in move["error"]["detail"]


@on_stand()
async def test_the_member_of_a_group_that_refuses_says_which_limit(stand: Stand) -> None:
    await stand.client.put("/groups/80", json={"members": ["00", "01"]})
    await stand.teach_speeds("01")
    assert (await stand.client.patch("/bodies/01/settings", json=LIMITS)).status_code == 200
    move = {"kind": "relative", "direction": "cw", "distance": {"value": 5000, "unit": "pulse"}}
    answer = (await stand.post("/groups/80/moves", move)).json()
    said = [it["error"]["detail"] for it in answer["moves"] if it["error"]]
    assert len(said) == 1
    assert "the target 5000 lies beyond its upper soft limit 1200 (pulses)" in said[0]
