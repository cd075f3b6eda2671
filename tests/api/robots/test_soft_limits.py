"""A refusal at a soft limit names axis, target and limit with their unit; others keep the manual's words."""

from typing import Any

import pytest

from tests.api.robots.cell import HOME, UNIT, Cell, in_cell, mm


async def refused(cell: Cell, move: object, **headers: str) -> dict[str, Any]:
    await cell.move(HOME)
    answer = await cell.post(f"{UNIT}/moves", move, **headers)
    problem = dict(answer.json())
    assert (problem["code"], problem["moved"]) == ("E07", "no"), answer.text
    return problem


@pytest.mark.parametrize("mode", [2, 3])
@pytest.mark.parametrize(
    ("move", "said"),
    [
        (
            {"kind": "absolute", "axes": mm(X=300.5)},
            "LMA: the target 300.5 mm of axis X lies beyond its upper soft limit 300 mm",
        ),
        (
            {"kind": "relative", "axes": mm(X=-500.01, Y=700)},
            "LMI: the target -350.01 mm of axis X lies beyond its lower soft limit -300 mm, and the target "
            "850 mm of axis Y lies beyond its upper soft limit 300 mm",
        ),
        (
            {"kind": "absolute", "coordinates": "motor", "axes": {"A": {"value": 400, "unit": "degree"}}},
            "MMA: the target 400 degree of axis A lies beyond its upper soft limit 120 degree",
        ),
    ],
)
def test_a_refusal_names_axis_target_and_limit(mode: int, move: dict[str, object], said: str) -> None:
    @in_cell(mode=mode)
    async def story(cell: Cell) -> None:
        problem = await refused(cell, move)
        assert problem["detail"] == f"r1/units/1 refused {said}. Nothing moved because of it."
        assert "soft limits" in problem["remedy"]

    story()


@in_cell()
async def test_it_is_told_in_japanese_too(cell: Cell) -> None:
    move = {"kind": "absolute", "axes": mm(X=301)}
    problem = await refused(cell, move, **{"accept-language": "ja"})
    assert "X軸の移動先 301 mm が+ソフトリミット 300 mm を超えています。" in problem["detail"]


@in_cell()
async def test_where_the_limits_cannot_be_read_the_words_of_the_manual_stand(cell: Cell) -> None:
    cell.rig.cable.lost_command = "SLP"
    problem = await refused(cell, {"kind": "absolute", "axes": mm(X=301)})
    assert "The target of the move is beyond a soft limit." in problem["detail"]
