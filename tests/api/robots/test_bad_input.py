"""Everything that a row of the C-HOST table cannot hold: refused with field and range, and not sent."""

import json
from collections.abc import Iterator, Mapping, Sequence
from math import inf, nan
from typing import Any, Final

import pytest

from protocols.fics.commands import ROWS, Row, of_the_robot, read
from protocols.fics.row import NAME_LENGTH
from tests.api.bodies.test_moves import refused
from tests.api.robots.cell import UNIT, Cell, in_cell

Parameters = dict[str, Any]

ONE_AXIS_AT_LEAST = "at least one axis needs a value"
AXIS = "must be one capital letter, or @ for theta"
NUMBER = "must be a number from -99999999 to 99999999 with at most 3 decimals"
NO_NUMBERS: Final[tuple[object, ...]] = ("1", True, [1], {})


def whole(first: int, last: int) -> list[tuple[object, str]]:
    """Values that are no whole number of a range: below, above, too long, a fraction, another type."""
    says = f"must be a whole number from {first} to {last}"
    return [(value, says) for value in (first - 1, last + 1, 10**30, first + 0.5, *NO_NUMBERS, None)]


def number(says: str, *outside: float) -> list[tuple[object, str]]:
    """Values that are no number of a range."""
    return [(value, says) for value in (*outside, *NO_NUMBERS)]


COORDINATE = number(NUMBER, 1e8, -1e8, 123_456_789_012, 0.0001, 1.2345)
SPEED = number("must be a number above 0, up to 99999999, with at most 3 decimals", 0, -1, 1e8, 0.0001)
PERCENT = number(
    "must be a number from 0.1 to 100 of at most 5 characters, the point included", 0, 0.05, 100.1, 10.125, -5
)
SINGLE: Final[Mapping[str, Sequence[tuple[object, str]]]] = {
    "unit": whole(1, 9),
    "mode": whole(2, 3),
    "axis": [(value, AXIS) for value in ("xy", "XY", "", "Ä", "X\r", "1", 1, None)],
    "direction": [(value, "'+' or '-'") for value in ("", "*", "+-", 1, True)],
    "steps": [
        (value, "must be a whole number from -255 to 255 other than 0") for value in (0, -256, 256, 1.5, "1")
    ],
    "enabled": whole(0, 1),
    "first": whole(1, 1999)[:-1],
    "count": whole(1, 1999)[:-1],
    "position": whole(1, 1999),
    "channel": whole(1, 99),
    "bit": whole(0, 7),
    "on": [(value, "must be true or false") for value in (1, "+", None)],
    "number": whole(0, 99),
    "value": [*COORDINATE, (None, NUMBER)],
    "macro": [
        *(
            (value, "must be three capital letters or digits")
            for value in ("pck", "PC", "PCKK", "A\rB", "ÄBC", 1)
        ),
        ("LMA", "LMA is a command"),
        ("POE", "POE is a command"),
    ],
}
"""Values that each field with a single value refuses, and the sentence about each."""

EACH: Final[Mapping[str, Sequence[tuple[object, str]]]] = {
    "coordinates": COORDINATE,
    "percents": PERCENT,
    "speeds": SPEED,
    "speeds_pps": whole(0, 9999)[:-1],
    "times_ms": whole(1, 9999)[:-1],
    "types": whole(0, 6)[:-1],
    "arguments": COORDINATE,
}
"""Values that the lists of a field refuse as items, where null is a hole."""

WITH_FIELDS = [row for row in ROWS if row.model_fields]
FOR_AXES = [row for row in WITH_FIELDS if set(row.model_fields) & (set(EACH) - {"arguments"})]


def good(row: Row) -> Parameters:
    """Parameters that can be sent, as in the manual's example with the most of them."""
    text = max(row.example[::2], key=len)
    command = read(text[:NAME_LENGTH], text[NAME_LENGTH:].lstrip())
    return dict(command.model_dump(exclude_none=True))


def odd(row: Row) -> Iterator[tuple[Parameters, str, str]]:
    """Every way in which one parameter cannot be, with the place it is told at and what is said."""
    for field in row.model_fields:
        for value, says in SINGLE.get(field, ()):
            yield good(row) | {field: value}, field, says
        for value, says in EACH.get(field, ()):
            yield good(row) | {field: [value]}, f"{field}.0", says
            yield good(row) | {field: [1, None, value]}, f"{field}.2", says
        if field in EACH:
            most = 4 if field == "arguments" else 8
            yield good(row) | {field: []}, field, "1 or more entries"
            yield good(row) | {field: [1] * (most + 1)}, field, f"{most} or fewer entries"
            yield good(row) | {field: [None]}, field, ONE_AXIS_AT_LEAST
            yield good(row) | {field: [None, None, None]}, field, ONE_AXIS_AT_LEAST
            yield good(row) | {field: "1,2"}, field, "must be an array"
        if row.model_fields[field].is_required():
            yield {name: value for name, value in good(row).items() if name != field}, field, "required"
    yield good(row) | {"more": 1}, "more", "is not known here"


def route(row: Row) -> str:
    return f"{'/robots/r1' if of_the_robot(row) else UNIT}/commands/{row.name()}"


def test_every_field_of_the_table_has_something_that_it_cannot_be() -> None:
    assert {field for row in ROWS for field in row.model_fields} == set(SINGLE) | set(EACH)


@pytest.mark.parametrize("row", WITH_FIELDS, ids=lambda row: row.name())
def test_what_a_parameter_cannot_be_is_told_with_field_and_range_and_nothing_is_sent(row: Row) -> None:
    @in_cell()
    async def story(cell: Cell) -> None:
        written = list(cell.rig.cable.written)
        for parameters, field, says in odd(row):
            answer = await cell.post(route(row), parameters)
            refused(answer, 422, field)
            assert any(says in error["message"] for error in answer.json()["errors"]), (
                parameters,
                answer.text,
            )
            assert says in answer.json()["detail"] or len(answer.json()["errors"]) > 1
        assert cell.rig.cable.written == written

    story()


@pytest.mark.parametrize("row", WITH_FIELDS, ids=lambda row: row.name())
def test_what_is_no_finite_number_is_told_with_its_field_and_not_sent(row: Row) -> None:
    @in_cell()
    async def story(cell: Cell) -> None:
        written = list(cell.rig.cable.written)
        for field in row.model_fields:
            for value in (nan, inf, -inf):
                odd_value, place = ([1, value], f"{field}.1") if field in EACH else (value, field)
                content = json.dumps(good(row) | {field: odd_value})
                answer = await cell.client.post(
                    route(row), content=content, headers={"content-type": "application/json"}
                )
                refused(answer, 422)
                assert f"{place} is not a number" in answer.json()["detail"]
        assert cell.rig.cable.written == written

    story()


@pytest.mark.parametrize("row", FOR_AXES, ids=lambda row: row.name())
def test_more_values_than_the_unit_has_axes_are_refused_with_their_names(row: Row) -> None:
    @in_cell()
    async def story(cell: Cell) -> None:
        (field,) = row.model_fields
        written = list(cell.rig.cable.written)
        answer = await cell.post(route(row), {field: [1, None, 1, 1]})
        refused(answer, 422)
        detail = answer.json()["detail"]
        if row.name() != "upload-position":  # sent by the gateway alone
            assert "r1/units/1 has the axes X, Y, Z" in detail or "has the axes A, B, Z" in detail
            assert field in detail
        assert cell.rig.cable.written == written

    story()


@pytest.mark.parametrize(
    ("name", "more"), [("start-jog", {"direction": "+"}), ("stop-jog", {}), ("step-axis", {"steps": 1})]
)
def test_an_axis_that_does_not_exist_is_refused_with_those_that_do(name: str, more: Parameters) -> None:
    @in_cell()
    async def story(cell: Cell) -> None:
        written = list(cell.rig.cable.written)
        answer = await cell.post(f"{UNIT}/commands/{name}", {"axis": "W", **more})
        refused(answer, 422)
        assert answer.json()["detail"].startswith("axis: r1/units/1 has the axes X, Y, Z, A, B; ")
        assert cell.rig.cable.written == written

    story()


def stored(value: object, position: object = 1) -> Parameters:
    return {"positions": [{"number": position, "axes": {"X": {"value": value, "unit": "mm"}}}]}


def moved(value: object) -> Parameters:
    return {"kind": "absolute", "axes": {"X": {"value": value, "unit": "mm"}}}


POSITION = "must be a whole number from 1 to 1999"
CHANNEL = "must be a whole number from 1 to 99"
ELSEWHERE: Final[Sequence[tuple[str, str, Parameters | None, str, str]]] = [
    ("GET", "/robots/r1/units/0", None, "unit", "must be a whole number from 1 to 9"),
    ("GET", "/robots/r1/units/x/position", None, "unit", "must be a whole number from 1 to 9"),
    ("GET", f"{UNIT}/position?coordinates=world", None, "coordinates", "'user' or 'motor'"),
    ("GET", f"{UNIT}/positions?first=0", None, "first", POSITION),
    ("GET", f"{UNIT}/positions.csv?last=2000", None, "last", POSITION),
    ("PUT", f"{UNIT}/positions", stored(1, position=2000), "positions.0.number", POSITION),
    ("PUT", f"{UNIT}/positions", stored(0.0001), "positions.0.axes.X.value", NUMBER),
    ("POST", f"{UNIT}/moves", moved(1e8), "axes.X.value", NUMBER),
    ("POST", f"{UNIT}/moves", {"kind": "position", "position": 0}, "position", POSITION),
    (
        "POST",
        f"{UNIT}/moves",
        {"kind": "step", "axis": "X", "steps": 256},
        "steps",
        "-255 to 255 other than 0",
    ),
    ("POST", f"{UNIT}/moves", {"kind": "step", "axis": "xy", "steps": 1}, "axis", AXIS),
    ("PATCH", f"{UNIT}/settings", {"speed_percent": {"X": 0.05}}, "speed_percent.X", "from 0.1 to 100"),
    ("PATCH", f"{UNIT}/settings", {"homing_type": {"A": 7}}, "homing_type.A", "from 0 to 6"),
    ("POST", f"{UNIT}/stop", {"mode": "slowly"}, "mode", "'decelerate' or 'immediate'"),
    ("POST", "/robots/r1/jogs", {"unit": 0, "axis": "X", "direction": "+"}, "unit", "from 1 to 9"),
    ("POST", "/robots/r1/jogs", {"unit": 1, "axis": "X", "direction": ""}, "direction", "'+' or '-'"),
    ("POST", "/robots/r1/macros/PCKX/runs", None, "name", "three capital letters or digits"),
    ("POST", "/robots/r1/macros/ERR/runs", None, "name", "ERR is a command"),
    ("POST", "/robots/r1/macros/PCK/runs", {"unit": 1, "arguments": [0.0001]}, "arguments.0", NUMBER),
    (
        "POST",
        "/robots/r1/macros/PCK/runs",
        {"unit": 1, "arguments": [1] * 5},
        "arguments",
        "4 or fewer entries",
    ),
    ("GET", "/robots/r1/inputs?first=100", None, "first", CHANNEL),
    ("GET", "/robots/r1/outputs?count=0", None, "count", CHANNEL),
    ("PUT", "/robots/r1/outputs/0/0", {"on": True}, "channel", CHANNEL),
    ("PUT", "/robots/r1/outputs/1/8", {"on": True}, "bit", "must be a whole number from 0 to 7"),
    ("GET", "/robots/r1/variables?count=101", None, "count", "must be a whole number from 1 to 100"),
    ("PUT", "/robots/r1/variables/100", {"value": 1}, "number", "must be a whole number from 0 to 99"),
    ("PUT", "/robots/r1/variables/1", {"value": 1e8}, "value", NUMBER),
]


@pytest.mark.parametrize(("method", "path", "content", "field", "says"), ELSEWHERE)
def test_the_routes_in_the_clients_words_tell_field_and_range_too(
    method: str, path: str, content: Parameters | None, field: str, says: str
) -> None:
    @in_cell()
    async def story(cell: Cell) -> None:
        written = list(cell.rig.cable.written)
        answer = await cell.client.request(method, path, json=content)
        refused(answer, 422, field)
        assert any(says in error["message"] for error in answer.json()["errors"]), answer.text
        assert cell.rig.cable.written == written

    story()
