"""One route for each row of the C-HOST table, where it belongs, with the row's own rules."""

import pytest

from gateway.door import commands
from gateway.fics.family import Fics
from protocols.fics.commands import ROWS, Row, of_the_robot
from protocols.table import Retry
from tests.api.bodies.test_moves import refused
from tests.api.robots.cell import HOME, UNIT, Cell, in_cell

BARE_READS = [row for row in ROWS if row.retry is Retry.READ and not row.model_fields]


def place(row: Row) -> str:
    return "/robots/r1" if of_the_robot(row) else UNIT


def test_every_row_has_one_route() -> None:
    paths = [row.path for row in commands.rows_of(Fics)]
    for row in ROWS:
        assert len([path for path in paths if path.endswith(f"/commands/{row.name()}")]) == 1
    assert len(paths) == len(ROWS)


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row.name())
def test_every_row_is_described_with_its_code_and_title(row: Row) -> None:
    text = commands.describe(Fics, row)
    assert (f"`{row.code}`" if row.code else "named by the macro") in text
    assert row.titles()[0] in text


@in_cell()
async def test_reads_without_parameters_need_no_body_and_answer_in_their_type(cell: Cell) -> None:
    for row in BARE_READS:
        answer = await cell.post(f"{place(row)}/commands/{row.name()}")
        assert answer.status_code == 200, (row.name(), answer.text)
        assert float(answer.headers["age-ms"]) >= 0
        assert row.reply_type().model_validate_json(answer.content).model_dump(mode="json") == answer.json()


@in_cell()
async def test_a_setting_is_written_and_read_back_in_its_own_unit(cell: Cell) -> None:
    percents = {"percents": [10.0, None, 30.5]}
    written = await cell.post("/robots/r1/units/2/commands/set-speed-percent", percents)
    assert written.json() == {}
    assert "age-ms" not in written.headers
    read = "commands/get-speed-percent"
    assert (await cell.post(f"/robots/r1/units/2/{read}")).json() == {"percents": [10.0, 100.0, 30.5]}
    assert (await cell.post(f"{UNIT}/{read}")).json() == {"percents": [100.0, 100.0, 100.0]}


@in_cell()
async def test_several_replies_are_a_list(cell: Cell) -> None:
    table = {"positions": [{"number": n, "axes": {"X": {"value": n, "unit": "mm"}}} for n in (1, 2)]}
    assert (await cell.put(f"{UNIT}/positions", table)).status_code == 200
    answer = await cell.post(f"{UNIT}/commands/download-positions", {"first": 1, "count": 2})
    assert [reply["coordinates"][0] for reply in answer.json()["replies"]] == [1.0, 2.0]


@in_cell()
async def test_a_motion_row_makes_the_same_move_as_moves_do(cell: Cell) -> None:
    await cell.move(HOME)
    answer = await cell.post(f"{UNIT}/commands/move-relative?wait=60", {"coordinates": [None, None, -5]})
    move = answer.json()
    assert (answer.status_code, move["status"], move["frame"]) == (200, "succeeded", "LMI ,,-5\\r")
    assert (await cell.get(answer.headers["location"])).json() == move


@in_cell()
async def test_a_stop_row_makes_the_same_stop_as_stop_does(cell: Cell) -> None:
    answer = await cell.post("/robots/r1/commands/stop-all-decelerating")
    assert answer.json()["confirmed"] is True
    assert "ASS" in cell.commands()


@in_cell()
async def test_the_row_that_stops_a_jog_ends_the_session_of_its_own_unit_and_of_no_other(cell: Cell) -> None:
    await cell.move(HOME)
    jog = {"unit": 1, "axis": "Z", "direction": "-"}
    place = (await cell.post("/robots/r1/jogs", jog)).headers["location"]
    other = await cell.post("/robots/r1/units/2/commands/stop-jog", {"axis": "Z"})
    refused(other, 503)
    assert other.json()["detail"].startswith("Axis Z of unit 2 was not stopped")
    assert (await cell.post(f"{place}/heartbeat")).json()["state"] == "jogging"
    assert "JOG Z" not in cell.commands()
    own = await cell.post(f"{UNIT}/commands/stop-jog", {"axis": "Z"})
    assert (own.status_code, own.json()) == (200, {})
    assert cell.rig.fics.job is None
    assert (await cell.post(f"{place}/heartbeat")).status_code == 409


@in_cell()
async def test_what_only_the_gateway_may_send_is_refused_with_the_way_to_do_it(cell: Cell) -> None:
    before = cell.commands()
    for name, parameters in (
        ("begin-position-upload", {}),
        ("upload-position", {"coordinates": [1]}),
        ("end-position-upload", {}),
    ):
        answer = await cell.post(f"{UNIT}/commands/{name}", parameters)
        refused(answer, 422)
        assert "as a whole" in answer.json()["remedy"]
    refused(await cell.post("/robots/r1/commands/set-communication-mode", {"mode": 2}), 422)
    assert cell.commands() == before


@pytest.mark.parametrize(
    ("path", "parameters", "field"),
    [
        ("/robots/r1/commands/select-unit", {"unit": 10}, "unit"),
        ("/robots/r1/commands/get-variable", {"number": 100}, "number"),
        ("/robots/r1/commands/switch-output", {"channel": 1, "bit": 8, "on": True}, "bit"),
        (f"{UNIT}/commands/move-to-position", {"position": 2000}, "position"),
        (f"{UNIT}/commands/set-speed-percent", {"percents": [0.05]}, "percents.0"),
        (f"{UNIT}/commands/set-homing-types", {"types": [7]}, "types.0"),
        (f"{UNIT}/commands/move-absolute", {"coordinates": [None]}, "coordinates"),
        (f"{UNIT}/commands/move-absolute", {"coordinates": [1] * 9}, "coordinates"),
        (f"{UNIT}/commands/move-absolute", {"coordinates": ["1\rAES"]}, "coordinates.0"),
        (f"{UNIT}/commands/run-macro", {"macro": "A\rB"}, "macro"),
        (f"{UNIT}/commands/run-macro", {"macro": "pck"}, "macro"),
    ],
)
def test_a_parameter_outside_its_range_is_422_and_not_sent(
    path: str, parameters: dict[str, object], field: str
) -> None:
    @in_cell()
    async def story(cell: Cell) -> None:
        before = cell.commands()
        refused(await cell.post(path, parameters), 422, field)
        assert cell.commands() == before

    story()


@in_cell()
async def test_a_row_is_found_only_where_it_belongs(cell: Cell) -> None:
    refused(await cell.post(f"{UNIT}/commands/get-system-version"), 404)
    refused(await cell.post("/robots/r1/commands/get-axis-status"), 404)
    refused(await cell.post(f"{UNIT}/commands/fly"), 404)


def limits_sent(cell: Cell) -> list[str]:
    """The changes of limits that the robot has heard."""
    return [text for text in cell.commands() if text.startswith(("SLP ", "SLM "))]


@in_cell()
async def test_soft_limits_are_kept_apart(cell: Cell) -> None:
    for name, parameters, says in (
        ("set-upper-soft-limits", [None, -301], "coordinates: axis Y"),
        ("set-lower-soft-limits", [301], "coordinates: axis X"),
        ("set-motor-upper-soft-limits", [-9999], "coordinates: axis A"),
    ):
        answer = await cell.post(f"{UNIT}/commands/{name}", {"coordinates": parameters})
        refused(answer, 422)
        assert says in answer.json()["detail"]
    assert not limits_sent(cell)
    assert (await cell.post(f"{UNIT}/commands/set-upper-soft-limits", {"coordinates": [299]})).json() == {}
    assert limits_sent(cell) == ["SLP 299"]


@pytest.mark.parametrize(
    ("name", "content", "lost"),
    [
        ("set-speed-percent", {"percents": [50]}, "VAO 50"),
        ("set-upper-soft-limits", {"coordinates": [333]}, "SLP 333"),
        ("clear-positions", {}, "PCL"),
    ],
)
def test_in_mode_2_a_command_whose_line_is_lost_is_409_not_done(
    name: str, content: dict[str, object], lost: str
) -> None:
    @in_cell(units=1, mode=2)
    async def story(cell: Cell) -> None:
        cell.rig.fics.units[1].positions[1] = (1.0,)
        cell.rig.cable.lost_once = lost
        answer = await cell.post(f"{UNIT}/commands/{name}", content)
        refused(answer, 409)
        assert answer.json()["type"].endswith(":not-done")
        assert cell.rig.heard(lost) == []
        assert (await cell.post(f"{UNIT}/commands/{name}", content)).status_code == 200
        assert cell.rig.heard(lost) == [lost]

    story()
