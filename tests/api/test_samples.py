"""The samples of moves over HTTP, as JSON and as CSV."""

import csv
from io import StringIO

from gateway.fics.plans import RobotSamples
from gateway.rorze.samples import BodySamples
from tests.api.bodies.test_moves import refused
from tests.api.robots.cell import HOME, UNIT, Cell, in_cell, mm
from tests.api.stand import RELATIVE, Stand, on_stand


def rows_of(text: str) -> list[list[str]]:
    return list(csv.reader(StringIO(text)))


@on_stand()
async def test_samples_have_time_pulses_and_the_planned_position(stand: Stand) -> None:
    await stand.teach_speeds("01")
    move = (await stand.post("/bodies/01/moves?wait=30", RELATIVE)).json()
    answer = await stand.get(f"/bodies/01/moves/{move['id']}/samples")
    assert answer.status_code == 200
    told = BodySamples.model_validate_json(answer.text)
    assert (told.move_id, told.body_id, told.unit) == (move["id"], "arm.01", "mm")
    last = told.samples[-1]
    assert (last.pulses, last.value, last.planned_pulses) == (50_000, 50.0, 50_000)
    assert told.samples[0].time.isoformat() == move["sent_at"].replace("Z", "+00:00")


@on_stand()
async def test_samples_are_a_table_too(stand: Stand) -> None:
    await stand.teach_speeds("01")
    move = (await stand.post("/bodies/01/moves?wait=30", RELATIVE)).json()
    answer = await stand.get(f"/bodies/01/moves/{move['id']}/samples.csv")
    assert answer.headers["content-type"].startswith("text/csv")
    header, first, *_, last = rows_of(answer.text)
    assert header == ["time", "time_s", "pulses", "planned_pulses", "value mm"]
    assert first[1:] == ["0.0", "0", "0.0", "0.0"]
    assert last[2:] == ["50000", "50000.0", "50.0"]


@on_stand()
async def test_a_move_that_is_none_has_no_samples(stand: Stand) -> None:
    await stand.teach_speeds("01")
    move = (await stand.post("/bodies/01/moves?wait=30", RELATIVE)).json()
    for path in ("/bodies/01/moves/none", f"/bodies/00/moves/{move['id']}"):
        refused(await stand.get(f"{path}/samples"), 404)
        refused(await stand.get(f"{path}/samples.csv"), 404)


@in_cell()
async def test_a_robots_move_has_samples_by_axis(cell: Cell) -> None:
    await cell.move(HOME)
    move = await cell.move({"kind": "absolute", "axes": mm(X=-200)})
    answer = await cell.get(f"{UNIT}/moves/{move['id']}/samples")
    told = RobotSamples.model_validate_json(answer.text)
    assert (told.robot_id, told.unit, told.coordinates) == ("r1", 1, "user")
    assert told.units["X"] == "mm"
    places = [sample.axes["X"] for sample in told.samples]
    assert places[-1] == -200
    assert len(set(places)) > 5
    gaps = told.samples[2].time_s - told.samples[1].time_s
    assert 0.15 < gaps < 0.25

    header, *rows = rows_of((await cell.get(f"{UNIT}/moves/{move['id']}/samples.csv")).text)
    assert header[:5] == ["time", "time_s", "X mm", "Y mm", "Z mm"]
    assert header[5:] == ["planned X mm", "planned Y mm", "planned Z mm"]
    assert len(rows) == len(places)
    assert float(rows[-1][2]) == -200


@in_cell(options="move_samples_per_s = 0")
async def test_a_robot_is_asked_for_no_samples_where_it_is_switched_off(cell: Cell) -> None:
    await cell.move(HOME)
    move = await cell.move({"kind": "absolute", "axes": mm(X=-200)})
    told = (await cell.get(f"{UNIT}/moves/{move['id']}/samples")).json()
    assert len(told["samples"]) <= 3


@in_cell(units=2)
async def test_an_axis_that_goes_alone_has_a_plan_beside_its_samples(cell: Cell) -> None:
    unit = UNIT.replace("units/1", "units/2")
    await cell.post(f"{unit}/moves?wait=60", HOME)
    move = (await cell.post(f"{unit}/moves?wait=60", {"kind": "absolute", "axes": mm(X=-200)})).json()
    told = (await cell.get(f"{unit}/moves/{move['id']}/samples")).json()
    assert told["note"] is None
    for sample in told["samples"]:
        assert abs(sample["planned"]["X"] - sample["axes"]["X"]) < 20
    assert told["samples"][-1]["planned"] == {"X": -200}
    both = (await cell.post(f"{unit}/moves?wait=60", {"kind": "absolute", "axes": mm(X=0, Y=5)})).json()
    told = (await cell.get(f"{unit}/moves/{both['id']}/samples")).json()
    assert (told["planned_s"], told["samples"][0]["planned"]) == (None, None)
    assert told["note"] == "How the robot times several axes together is not known."
