"""Commands to robots as plain text go the way of all others."""

from tests.api.robots.cell import HOME, UNIT, Cell, in_cell

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
    assert [text for text in cell.commands() if not text.startswith(("VAR", "ASD"))] == []
