"""Stored positions over HTTP: JSON and CSV, there and back, and tables that are refused as a whole."""

import asyncio

import pytest
from httpx2 import Response

from tests.api.bodies.test_moves import refused
from tests.api.robots.cell import HOME, UNIT, Cell, in_cell, mm

TABLE = "number,X mm,Y mm,Z mm\r\n1,10,20.5,-3\r\n2,-0.125,,7\r\n"


async def put_csv(cell: Cell, text: str | bytes, content_type: str = "text/csv") -> Response:
    content = text.encode() if isinstance(text, str) else text
    headers = {"content-type": content_type}
    return await cell.client.put(f"{UNIT}/positions.csv", content=content, headers=headers)


@in_cell()
async def test_positions_are_stored_undivided_and_read_back(cell: Cell) -> None:
    positions = [
        {"number": 6, "axes": mm(X=1, Y=2, Z=3)},
        {"number": 5, "axes": mm(X=4.5, Y=0, Z=-6)},
        {"number": 9, "axes": mm(Z=1)},
    ]
    stored = await cell.put(f"{UNIT}/positions", {"positions": positions})
    assert stored.json() == {"robot_id": "r1", "unit": 1, "count": 3}
    assert [text for text in cell.rig.heard("PO") if not text.startswith("POR")][-7:] == [
        "POF 1,5",
        "POS 4.5,0,-6",
        "POS 1,2,3",
        "POF 2",
        "POF 1,9",
        "POS ,,1",
        "POF 2",
    ]
    listed = (await cell.get(f"{UNIT}/positions?first=5&last=6")).json()["positions"]
    assert [entry["number"] for entry in listed] == [5, 6]
    assert listed[0]["axes"] == {
        "X": {"value": 4.5, "unit": "mm"},
        "Y": {"value": 0.0, "unit": "mm"},
        "Z": {"value": -6.0, "unit": "mm"},
    }


@in_cell()
async def test_a_table_comes_back_from_csv_as_it_was_stored(cell: Cell) -> None:
    stored = await put_csv(cell, TABLE, "text/csv; charset=utf-8")
    assert stored.json() == {"robot_id": "r1", "unit": 1, "count": 2}, stored.text
    downloaded = await cell.get(f"{UNIT}/positions.csv")
    assert downloaded.headers["content-type"].startswith("text/csv")
    assert downloaded.text == TABLE


@in_cell()
async def test_it_is_told_where_a_gap_ended_the_table(cell: Cell) -> None:
    await put_csv(cell, "number,X mm,Y mm,Z mm\n1,1,2,3\n2,1,2,3\n5,4,5,6\n")
    for query, numbers, ended_at in (
        ("", [1, 2], 3),
        ("?first=3", [], 3),
        ("?first=4&last=5", [], 4),
        ("?first=5&last=5", [5], None),
        ("?first=1&last=2", [1, 2], None),
    ):
        table = (await cell.get(f"{UNIT}/positions{query}")).json()
        assert [entry["number"] for entry in table["positions"]] == numbers
        assert table["ended_at"] == ended_at
        header = (await cell.get(f"{UNIT}/positions.csv{query}")).headers.get("ended-at")
        assert header == (None if ended_at is None else str(ended_at))


@in_cell()
async def test_a_full_table_fits(cell: Cell) -> None:
    rows = "".join(f"{number},-12345.125,-12345.125,-12345.125\n" for number in range(1, 2000))
    stored = await put_csv(cell, "number,X mm,Y mm,Z mm\n" + rows)
    assert stored.json()["count"] == 1999
    assert len((await cell.get(f"{UNIT}/positions")).json()["positions"]) == 1999


@pytest.mark.parametrize(
    ("table", "says"),
    [
        ("", "line 1: the columns are number,X mm,Y mm,Z mm"),
        ("number,X mm,Y mm\n1,2,3\n", "line 1: the columns are"),
        ("number,X degree,Y mm,Z mm\n1,2,3,4\n", "line 1: the columns are"),
        ("number,X mm,Y mm,Z mm\n", "no positions"),
        ("number,X mm,Y mm,Z mm\n1,2,3\n", "line 2: it has 3 columns, not 4"),
        ("number,X mm,Y mm,Z mm\n0,2,3,4\n", "line 2, number: positions go from 1 to 1999"),
        ("number,X mm,Y mm,Z mm\n1,2,3,4\n2000,2,3,4\n", "line 3, number"),
        ("number,X mm,Y mm,Z mm\n1,2,nan,4\n", "line 2, Y mm: a coordinate is"),
        ("number,X mm,Y mm,Z mm\n1,2,3,0.0001\n", "line 2, Z mm"),
        ("number,X mm,Y mm,Z mm\n1,2,3,=1+1\n", "line 2, Z mm"),
        ("number,X mm,Y mm,Z mm\n1,2,3,4\n1,2,3,4\n", "Position 1 is given twice"),
        ("number,X mm,Y mm,Z mm\n1,,,\n", "at least one axis needs a value"),
        (b"number,X mm,Y mm,Z mm\n1,\xff,3,4\n", "no CSV"),
        ('number,X mm,Y mm,Z mm\n1,"2,3,4\n', "no CSV"),
    ],
)
def test_a_table_with_a_fault_is_refused_as_a_whole(table: str | bytes, says: str) -> None:
    @in_cell()
    async def story(cell: Cell) -> None:
        before = cell.commands()
        answer = await put_csv(cell, table)
        refused(answer, 422)
        assert says in answer.json()["detail"]
        assert cell.commands() == before

    story()


@in_cell()
async def test_what_is_no_csv_or_too_long_is_not_read(cell: Cell) -> None:
    refused(await put_csv(cell, TABLE, "application/json"), 415)
    answer = await put_csv(cell, "x" * 300_000)
    refused(answer, 413)
    assert "262144" in answer.json()["detail"]


@in_cell()
async def test_a_range_or_number_outside_the_table_is_refused(cell: Cell) -> None:
    refused(await cell.get(f"{UNIT}/positions?first=0"), 422, "first")
    refused(await cell.get(f"{UNIT}/positions?first=9&last=8"), 422)
    upload = {"positions": [{"number": 2000, "axes": mm(X=1)}]}
    refused(await cell.put(f"{UNIT}/positions", upload), 422, "positions.0.number")
    upload = {"positions": [{"number": 1, "axes": mm(X=1)}, {"number": 2, "axes": mm(W=1)}]}
    answer = await cell.put(f"{UNIT}/positions", upload)
    assert "positions.1.axes.W: r1/units/1 has the axes" in answer.json()["detail"]


@pytest.mark.parametrize("csv", [False, True])
@pytest.mark.parametrize("mode", [2, 3])
def test_an_upload_that_lost_a_line_is_409_with_what_the_robot_holds(mode: int, csv: bool) -> None:
    @in_cell(units=1, mode=mode)
    async def story(cell: Cell) -> None:
        positions = [{"number": number, "axes": mm(X=number, Y=0, Z=0)} for number in range(1, 4)]
        table = "number,X mm,Y mm,Z mm\r\n" + "".join(f"{number},{number},0,0\r\n" for number in range(1, 4))
        cell.rig.cable.lost_once = "POS 2"
        if csv:
            storing = asyncio.create_task(
                cell.client.put(f"{UNIT}/positions.csv", content=table, headers={"content-type": "text/csv"})
            )
        else:
            storing = asyncio.create_task(cell.put(f"{UNIT}/positions", {"positions": positions}))
        await cell.rig.cable.written_from("POS 2")
        if mode == 3:
            cell.rig.cable._deliver(b"POS\r")
        answer = await storing
        refused(answer, 409)
        problem = answer.json()
        assert problem["type"].endswith(":positions-differ")
        assert "2 differ: 2 holds 3,0,0 and was sent as 2,0,0; 3 is not set" in problem["detail"]
        assert (problem["moved"], problem["retryable"]) == ("no", True)

    story()


@in_cell()
async def test_a_number_alone_stores_where_the_unit_stands(cell: Cell) -> None:
    unhomed = await cell.put(f"{UNIT}/positions", {"positions": [{"number": 7}]})
    refused(unhomed, 409)
    assert "POF was not sent" in unhomed.json()["detail"]
    await cell.move(HOME)
    await cell.move({"kind": "relative", "axes": mm(Z=-12.5)})
    here = (await cell.get(f"{UNIT}/position")).json()["axes"]
    both = [{"number": 7}, {"number": 8, "axes": mm(X=1, Y=2, Z=3)}]
    assert (await cell.put(f"{UNIT}/positions", {"positions": both})).json()["count"] == 2
    [seven, eight] = (await cell.get(f"{UNIT}/positions?first=7&last=8")).json()["positions"]
    assert {name: it["value"] for name, it in seven["axes"].items()} == {
        name: it["value"] for name, it in here.items()
    }
    assert eight["axes"]["X"]["value"] == 1
    await cell.post(f"{UNIT}/moves", {"kind": "relative", "axes": mm(Z=-20)})
    moving = await cell.put(f"{UNIT}/positions", {"positions": [{"number": 9}]})
    refused(moving, 409)


@in_cell()
async def test_names_are_given_with_positions_and_alone_without_a_word_on_the_wire(cell: Cell) -> None:
    table, named = f"{UNIT}/positions?first=1&last=2", f"{UNIT}/positions/2/name"
    upload = [{"number": 1, "axes": mm(X=1), "name": "load"}, {"number": 2, "axes": mm(X=2)}]
    await cell.put(f"{UNIT}/positions", {"positions": upload})
    before = cell.commands()
    told = await cell.put(named, {"name": "置き場"})
    assert told.json() == {"robot_id": "r1", "unit": 1, "number": 2, "name": "置き場"}
    refused(await cell.put(f"{UNIT}/positions/2000/name", {"name": "x"}), 422)
    refused(await cell.put("/robots/r1/units/3/positions/1/name", {"name": "x"}), 404)
    assert cell.commands() == before
    held = (await cell.get(table)).json()
    assert [entry["name"] for entry in held["positions"]] == ["load", "置き場"]
    await cell.put(f"{UNIT}/positions", held)  # sent back as it was told
    await cell.put(f"{UNIT}/positions", {"positions": [{"number": 2, "axes": mm(X=3)}]})
    assert (await cell.get(table)).json()["positions"][1]["name"] == "置き場"
    await cell.put(named, {"name": None})
    assert [entry["name"] for entry in (await cell.get(table)).json()["positions"]] == ["load", None]
    other = table.replace("units/1", "units/2")
    await cell.put(f"{other}", {"positions": [{"number": 1, "axes": mm(X=1)}]})
    assert (await cell.get(other)).json()["positions"][0]["name"] is None


@in_cell()
async def test_a_table_as_excel_writes_it_is_read(cell: Cell) -> None:
    stored = await put_csv(cell, "\ufeffnumber;x mm;Y mm;Z MM\r\n1;10;20,5;-3\r\n2;-0,125;;7\r\n;;;\r\n")
    assert stored.json() == {"robot_id": "r1", "unit": 1, "count": 2}, stored.text
    assert (await cell.get(f"{UNIT}/positions.csv")).text == TABLE
    thousands = await put_csv(cell, "number;X mm;Y mm;Z mm\n1;1.000;0;0\n")
    refused(thousands, 422)
    assert "decimals stand behind a comma" in thousands.json()["detail"]


@in_cell()
async def test_axes_are_taken_in_lower_case_and_each_once(cell: Cell) -> None:
    lower = {"positions": [{"number": 3, "axes": mm(x=1, Y=2)}]}
    assert (await cell.put(f"{UNIT}/positions", lower)).status_code == 200
    [stored] = (await cell.get(f"{UNIT}/positions?first=3&last=3")).json()["positions"]
    assert list(stored["axes"]) == ["X", "Y"]
    twice = await cell.put(f"{UNIT}/positions", {"positions": [{"number": 3, "axes": mm(x=1, X=2)}]})
    refused(twice, 422, "positions.0.axes")
    assert "must name axis X once only" in twice.json()["detail"]


@pytest.mark.parametrize("read", ["positions", "positions.csv"])
def test_a_stale_etag_stores_nothing(read: str) -> None:
    @in_cell()
    async def story(cell: Cell) -> None:
        put, known, place = (
            cell.client.put,
            "?first=1&last=5",
            {"positions": [{"number": 1, "axes": mm(X=1)}]},
        )
        seen = {"If-Match": (await cell.get(f"{UNIT}/{read}{known}")).headers["etag"]}
        assert (await put(f"{UNIT}/positions{known}", json=place, headers=seen)).status_code == 200
        stale = await put(f"{UNIT}/positions{known}", json=place, headers=seen)
        assert (stale.status_code, stale.json()["moved"]) == (412, "no")
        as_csv = {**seen, "content-type": "text/csv"}
        assert (await put(f"{UNIT}/positions.csv{known}", content=TABLE, headers=as_csv)).status_code == 412
        assert cell.rig.heard("POF 1") == ["POF 1,1"]

    story()


@in_cell()
async def test_only_the_positions_that_were_read_have_to_be_as_they_were(cell: Cell) -> None:
    known = f"{UNIT}/positions?first=100&last=105"
    seen = {"If-Match": (await cell.get(known)).headers["etag"]}
    place = {"positions": [{"number": 1, "axes": mm(X=1)}]}
    for _ in range(2):
        assert (await cell.client.put(known, json=place, headers=seen)).status_code == 200
