"""Moves of robots over HTTP: each kind as its bytes, the life of a move, and what is refused."""

import pytest

from tests.api.bodies.test_moves import refused
from tests.api.robots.cell import HOME, UNIT, Cell, in_cell, mm

ABSOLUTE = {"kind": "absolute", "axes": mm(X=100, Z=-5.5)}


@in_cell()
async def test_a_move_is_accepted_followed_and_ends(cell: Cell) -> None:
    await cell.move(HOME)
    accepted = await cell.post(f"{UNIT}/moves", ABSOLUTE)
    move = accepted.json()
    assert (accepted.status_code, move["status"]) == (202, "moving")
    assert accepted.headers["location"] == f"{UNIT}/moves/{move['id']}"
    over = (await cell.get(accepted.headers["location"] + "?wait=60")).json()
    assert (over["status"], over["end_cause"], over["completion"]) == ("succeeded", "normal", "reply")
    assert (over["position"]["X"], over["position"]["Z"]) == (100.0, -5.5)
    listed = (await cell.get(f"{UNIT}/moves")).json()["moves"]
    assert [it["kind"] for it in listed] == ["absolute", "home"]
    refused(await cell.get(f"/robots/r1/units/2/moves/{move['id']}"), 404)


@in_cell(mode=2)
async def test_in_the_silent_mode_the_end_is_marked_as_inferred(cell: Cell) -> None:
    assert (await cell.move(HOME))["completion"] == "inferred"


@pytest.mark.parametrize(
    ("move", "frame"),
    [
        (ABSOLUTE, "LMA 100,,-5.5"),
        ({"kind": "relative", "axes": mm(Y=0.125)}, "LMI ,0.125"),
        (
            {"kind": "absolute", "coordinates": "motor", "axes": {"B": {"value": -45, "unit": "degree"}}},
            "MMA ,-45",
        ),
        ({"kind": "relative", "coordinates": "motor", "axes": mm(Z=7)}, "MMI ,,7"),
        ({"kind": "position", "position": 1999}, "POM 1999"),
        (HOME, "ORG"),
        ({"kind": "step", "axis": "X", "steps": -10}, "JTE X-10"),
        ({"kind": "step", "axis": "B", "steps": 255}, "JTE B255"),
    ],
)
def test_validate_only_answers_the_exact_bytes_and_moves_nothing(move: dict[str, object], frame: str) -> None:
    @in_cell()
    async def story(cell: Cell) -> None:
        answer = await cell.post(f"{UNIT}/moves", move | {"validate_only": True})
        planned = answer.json()
        assert (answer.status_code, planned["body_id"], planned["frame"]) == (
            200,
            "r1/units/1",
            frame + "\\r",
        )
        assert not cell.rig.machine.truth.of("motion_start")

    story()


@in_cell()
async def test_validate_only_tells_where_a_move_goes_and_how_long_it_takes_as_far_as_that_is_known(
    cell: Cell,
) -> None:
    await cell.move(HOME, unit=2)
    planned = (await cell.post("/robots/r1/units/2/moves", ABSOLUTE | {"validate_only": True})).json()
    assert planned["start_position"] == {"X": 0.0, "Y": 0.0, "Z": 0.0}
    assert planned["target_position"] == {"X": 100.0, "Z": -5.5}
    assert planned["units"] == {"X": "mm", "Y": "mm", "Z": "mm"}
    assert (planned["duration_s"], planned["note"]) == (
        None,
        "How the robot times several axes together is not known.",
    )
    single = {"kind": "relative", "axes": mm(X=100), "validate_only": True}
    assert (await cell.post("/robots/r1/units/2/moves", single)).json()["duration_s"] == 0.4
    assert (await cell.get("/robots/r1/units/2/moves")).json()["moves"][0]["kind"] == "home"


@pytest.mark.parametrize(
    ("move", "field", "says"),
    [
        ({"axes": {}}, "axes", "1 or more"),
        ({"axes": {"X": 5}}, "axes.X", "must be an object, not 5"),
        ({"axes": {"X": {"value": 5}}}, "axes.X.unit", "required"),
        ({"axes": {"X": {"value": 5, "unit": "inch"}}}, "axes.X.unit", "'mm', 'pulse' or 'degree'"),
        ({"axes": mm(X=1e8)}, "axes.X.value", "99999999"),
        ({"axes": mm(X=0.0001)}, "axes.X.value", "at most 3 decimals"),
        ({"axes": {"X": {"value": "5", "unit": "mm"}}}, "axes.X.value", "must be a number from"),
        ({"axes": {"X": {"value": True, "unit": "mm"}}}, "axes.X.value", "must be a number from"),
        ({"coordinates": "world"}, "coordinates", "'user' or 'motor'"),
        ({"kind": "position", "position": 0}, "position", "from 1 to 1999"),
        ({"kind": "position", "position": 2000}, "position", "from 1 to 1999"),
        ({"kind": "step", "axis": "X", "steps": 256}, "steps", "from -255 to 255 other than 0"),
        ({"kind": "step", "axis": "X", "steps": 0}, "steps", "from -255 to 255 other than 0"),
        ({"kind": "step", "axis": "XY", "steps": 1}, "axis", "one capital letter"),
        ({"kind": "fly"}, "kind", "'absolute'"),
        ({"more": 1}, "more", "is not known here"),
    ],
)
def test_an_odd_move_is_422_with_field_and_range_and_is_not_sent(
    move: dict[str, object], field: str, says: str
) -> None:
    @in_cell()
    async def story(cell: Cell) -> None:
        before = cell.commands()
        request = move if "kind" in move else ABSOLUTE | move
        answer = await cell.post(f"{UNIT}/moves", request)
        refused(answer, 422, field)
        assert any(says in error["message"] for error in answer.json()["errors"]), answer.text
        assert cell.commands() == before

    story()


@pytest.mark.parametrize(
    ("move", "says"),
    [
        ({"kind": "absolute", "axes": mm(W=5)}, "axes.W: r1/units/1 has the axes X, Y, Z"),
        ({"kind": "absolute", "axes": {"X": {"value": 5, "unit": "degree"}}}, "axes.X.unit: axis X"),
        ({"kind": "relative", "coordinates": "motor", "axes": mm(A=5)}, "is set up for degree, not for mm"),
        ({"kind": "step", "axis": "W", "steps": 1}, "axis: r1/units/1 has the axes X, Y, Z, A, B"),
    ],
)
def test_what_the_unit_cannot_do_is_422_and_not_sent(move: dict[str, object], says: str) -> None:
    @in_cell()
    async def story(cell: Cell) -> None:
        before = cell.commands()
        answer = await cell.post(f"{UNIT}/moves", move)
        refused(answer, 422)
        assert says in answer.json()["detail"]
        assert cell.commands() == before

    story()


@in_cell()
async def test_a_second_move_of_a_busy_robot_is_409(cell: Cell) -> None:
    await cell.post(f"{UNIT}/moves", HOME)
    second = await cell.post("/robots/r1/units/2/moves", HOME)
    refused(second, 409)
    assert second.json()["type"].endswith(":robot-busy")
    assert second.json()["retryable"] is True


@in_cell()
async def test_moves_tell_their_news_under_the_units_address(cell: Cell) -> None:
    move = await cell.move(HOME)
    events = (await cell.get("/events?types=robot.move.*")).json()["events"]
    assert [event["type"].rpartition(".")[2] for event in events] == [
        "queued",
        "sent",
        "started",
        "succeeded",
    ]
    assert {(event["subject"], event["correlationid"]) for event in events} == {(UNIT, move["id"])}


@in_cell()
async def test_a_macro_runs_as_a_move_of_a_unit(cell: Cell) -> None:
    await cell.move(HOME, unit=2)
    name = next(iter(cell.rig.fics.layout.macros))
    ambiguous = await cell.post(f"/robots/r1/macros/{name}/runs")
    refused(ambiguous, 422)
    run = await cell.post(f"/robots/r1/macros/{name}/runs?wait=60", {"unit": 2, "arguments": [1, None, 2]})
    assert (run.status_code, run.json()["kind"]) == (200, "macro"), run.text
    assert f"{name} 1,,2" in cell.commands()


@in_cell(units=1)
async def test_a_macro_that_cannot_be_is_refused(cell: Cell) -> None:
    unknown = await cell.post("/robots/r1/macros/ZZ9/runs")
    refused(unknown, 422)
    assert unknown.json()["code"] == "E12"
    before = cell.commands()
    reserved = await cell.post("/robots/r1/macros/LMA/runs")
    refused(reserved, 422, "name")
    assert "name: LMA is a command" in reserved.json()["detail"]
    refused(await cell.post("/robots/r1/macros/pck/runs"), 422, "name")
    refused(await cell.post("/robots/r1/macros/PCK/runs", {"unit": 10}), 422, "unit")
    refused(await cell.post("/robots/r1/macros/PCK/runs", {"arguments": [1, 2, 3, 4, 5]}), 422, "arguments")
    assert cell.commands() == before


@in_cell(units=1)
async def test_macros_are_listed_from_the_configuration_and_from_refusals(cell: Cell) -> None:
    known = next(iter(cell.rig.fics.layout.macros))
    cell.rig.robot.macros.titles = {known: "pick a wafer", "ZZ8": "not there"}
    await cell.move(HOME)
    for name in ("ZZ9", "ZZ8"):
        refused(await cell.post(f"/robots/r1/macros/{name}/runs"), 422)
    await cell.post(f"/robots/r1/macros/{known}/runs?wait=60")
    listed = (await cell.get("/robots/r1/macros")).json()
    assert listed == {
        "robot_id": "r1",
        "macros": [
            {"name": known, "title": "pick a wafer", "refused": False},
            {"name": "ZZ8", "title": "not there", "refused": True},
            {"name": "ZZ9", "title": None, "refused": True},
        ],
    }
