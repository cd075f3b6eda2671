"""Soft limits over HTTP: never refused by the robot for their order, never sent where they would cross."""

import pytest

from tests.api.robots.cell import UNIT, Cell, in_cell, mm
from tests.api.test_moves import refused


def sent(cell: Cell) -> list[str]:
    """The changes of limits that the robot has heard."""
    return [text for text in cell.commands() if text.startswith(("SLP ", "SLM "))]


async def change(cell: Cell, **limits: object) -> None:
    answer = await cell.client.patch(f"{UNIT}/settings", json=limits)
    assert answer.status_code == 200, answer.text
    assert all(answer.json()[name] | wanted == answer.json()[name] for name, wanted in limits.items())


@in_cell()
async def test_limits_that_go_up_raise_the_upper_one_first(cell: Cell) -> None:
    await change(cell, lower_soft_limit=mm(X=400), upper_soft_limit=mm(X=500))
    assert sent(cell) == ["SLP 500", "SLM 400"]


@in_cell()
async def test_limits_that_go_down_lower_the_lower_one_first(cell: Cell) -> None:
    await change(cell, lower_soft_limit=mm(X=-500), upper_soft_limit=mm(X=-400))
    assert sent(cell) == ["SLM -500", "SLP -400"]


@in_cell()
async def test_limits_of_two_axes_may_go_either_way_at_once(cell: Cell) -> None:
    await change(cell, lower_soft_limit=mm(X=400, Y=-500), upper_soft_limit=mm(X=500, Y=-400))
    assert sent(cell) == ["SLP 500", "SLM 400,-500", "SLP ,-400"]


@in_cell()
async def test_motor_limits_have_an_order_of_their_own(cell: Cell) -> None:
    degrees = [{"A": {"value": value, "unit": "degree"}} for value in (-200, -190)]
    await change(cell, motor_lower_soft_limit=degrees[0], motor_upper_soft_limit=degrees[1])
    assert [text for text in cell.commands() if text.startswith("MS")][-4:-2] == ["MSM -200", "MSP -190"]


@pytest.mark.parametrize(
    ("limits", "says"),
    [
        ({"upper_soft_limit": mm(X=-301)}, "upper_soft_limit: axis X of r1/units/1 would have soft limits"),
        ({"lower_soft_limit": mm(Z=101)}, "lower_soft_limit: axis Z of r1/units/1 would have soft limits"),
        ({"lower_soft_limit": mm(X=6), "upper_soft_limit": mm(X=5)}, "from 6 to 5"),
    ],
)
def test_limits_that_would_cross_are_refused_with_both(limits: dict[str, object], says: str) -> None:
    @in_cell()
    async def story(cell: Cell) -> None:
        answer = await cell.client.patch(f"{UNIT}/settings", json=limits)
        refused(answer, 422)
        assert says in answer.json()["detail"]
        assert not sent(cell)

    story()


@in_cell()
async def test_the_commands_of_the_table_keep_the_limits_apart_too(cell: Cell) -> None:
    for name, parameters, says in (
        ("set-upper-soft-limits", [None, -301], "coordinates: axis Y"),
        ("set-lower-soft-limits", [301], "coordinates: axis X"),
        ("set-motor-upper-soft-limits", [-9999], "coordinates: axis A"),
    ):
        answer = await cell.post(f"{UNIT}/commands/{name}", {"coordinates": parameters})
        refused(answer, 422)
        assert says in answer.json()["detail"]
    assert not sent(cell)
    assert (await cell.post(f"{UNIT}/commands/set-upper-soft-limits", {"coordinates": [299]})).json() == {}
    assert sent(cell) == ["SLP 299"]
