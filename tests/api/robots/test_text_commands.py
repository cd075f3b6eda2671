"""Commands to robots as plain text go the way of all others."""

import pytest

from simulator.fics.settings import RobotSettings
from tests.api.robots.cell import HOME, UNIT, Cell, in_cell, mm

RAW = "[server]\nraw_commands = true"
ROBOT_RAW = "/robots/r1/raw"


@in_cell()
async def test_plain_text_has_to_be_allowed(cell: Cell) -> None:
    answer = await cell.post(ROBOT_RAW, {"text": "ACD"})
    assert answer.status_code == 403
    assert "raw_commands" in answer.json()["remedy"]


@in_cell(options=RAW)
async def test_a_query_is_answered_as_it_stands_on_the_line(cell: Cell) -> None:
    answer = (await cell.post(ROBOT_RAW, {"text": "VAR V07=2"})).json()
    assert (answer["robot_id"], answer["sent"]) == ("r1", "VAR V07=2\\r")
    answer = (await cell.post(ROBOT_RAW, {"text": "VAR V07"})).json()
    assert answer["replies"] == ["V07=+2"]
    answer = (await cell.post(f"{UNIT}/raw", {"text": "VAO"})).json()
    assert answer["replies"] == ["100.0,100.0,100.0"]


@pytest.mark.parametrize(("mode", "done"), [(2, []), (3, [""])])
def test_answers_are_told_as_they_came(mode: int, done: list[str]) -> None:
    @in_cell(mode=mode, options=RAW)
    async def story(cell: Cell) -> None:
        await cell.move(HOME)
        cell.rig.machine.robot.settings = RobotSettings(
            status_bits=("alarm", "moving", "servo_ready", "origin_done")
        )
        stored = await cell.put(
            f"{UNIT}/positions", {"positions": [{"number": 1, "axes": mm(X=150, Y=150, Z=-1.5)}]}
        )
        assert stored.status_code == 200, stored.text
        for text, came in {
            "APS": ["150.00,150.00,0.00"],
            "ACD": ["0C00,0C00,0C00"],
            "POR 1,1": ["150,150,-1.5"],
            "VAO 50": done,
        }.items():
            assert (await cell.post(f"{UNIT}/raw", {"text": text})).json()["replies"] == came, text
        for text, came in {"ERR": ["E00"], "DRT": done}.items():
            assert (await cell.post(ROBOT_RAW, {"text": text})).json()["replies"] == came, text

    story()


@in_cell(options=RAW)
async def test_text_that_moves_makes_a_move_and_text_that_stops_a_stop(cell: Cell) -> None:
    await cell.move(HOME)
    moved = await cell.post(f"{UNIT}/raw?wait=60", {"text": "LMI ,,-5"})
    assert (moved.status_code, moved.json()["status"]) == (200, "succeeded")
    stopped = await cell.post(ROBOT_RAW, {"text": "AES"})
    assert (stopped.status_code, cell.rig.heard("AES")) == (200, ["AES"])
    assert cell.rig.types("robot.stop.confirmed") == ["robot.stop.confirmed"]


@in_cell(options=RAW)
async def test_text_that_is_kept_back_or_no_command_is_not_sent(cell: Cell) -> None:
    for text in ("POF 1,1", "JOG X+9", "VAO 1,2,3,4,x"):
        answer = await cell.post(ROBOT_RAW, {"text": text})
        assert answer.status_code == 422, text
    several = await cell.post(ROBOT_RAW, {"text": "JOG X"})
    assert several.json()["remedy"] == "Say on which."
    assert [text for text in cell.commands() if not text.startswith(("VAR", "ASD", "VSS", "MSS"))] == []
