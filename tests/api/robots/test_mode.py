"""The communication mode is changed at run time, without a move lost or a power cycle told."""

from tests.api.bodies.test_moves import refused
from tests.api.robots.cell import HOME, UNIT, Cell, in_cell

MODE = "/robots/r1/mode"


@in_cell()
async def test_a_robot_is_brought_into_the_other_mode_and_back(cell: Cell) -> None:
    await cell.move(HOME)
    for mode in (2, 2, 3):
        robot = await cell.put(MODE, {"mode": mode})
        assert (robot.status_code, robot.json()["mode"]) == (200, mode), robot.text
        assert cell.rig.fics.mode == mode
        await cell.move({"kind": "home"})
    assert cell.rig.heard("MOD 2") == ["MOD 2"]
    assert cell.rig.types("robot.power_cycled") == []


@in_cell()
async def test_while_the_robot_moves_its_mode_stays(cell: Cell) -> None:
    await cell.post(f"{UNIT}/moves", HOME)
    answer = await cell.put(MODE, {"mode": 2})
    refused(answer, 409)
    assert answer.json()["type"].endswith(":robot-busy")
    assert cell.rig.heard("MOD 2") == []


@in_cell()
async def test_there_are_two_modes(cell: Cell) -> None:
    assert (await cell.put(MODE, {"mode": 4})).status_code == 422
