"""A unit's table of stored positions over HTTP: as JSON in parts, as CSV in whole."""

import re
from collections.abc import Sequence
from typing import Annotated

from fastapi import Query, Request, Response
from pydantic import BaseModel, Field

from api.common.csv_tables import ANSWER, Row, csv_response, read_table
from api.common.etags import IF_MATCH, etag_of, expected_by, tagged
from api.common.problems import DECLARED
from api.common.requests import json_response, new_router, origin, plant_of
from api.robots.names import RobotId, UnitNumber, unit_of
from gateway.core.errors import InvalidRequest
from gateway.core.records import RequestModel, SentBack, example
from gateway.core.rights import Right
from gateway.fics.amounts import Amounts, AxisValue
from gateway.fics.units import RobotUnit
from gateway.operations import positions
from gateway.operations.positions import Numbered, Stored, Wanted
from protocols.fics.notation import DECIMALS, LARGEST, PositionNumber, Quantity
from protocols.fics.positions import LAST_POSITION

router = new_router("robot positions")

MAX_CSV_BYTES = 262_144
"""A whole table of 1999 positions with eight long coordinates each."""
NUMBER = "number"
_NUMBER = re.compile("[0-9]{1,4}")
_COORDINATE = re.compile(rf"[+-]?[0-9]{{1,8}}(?:\.[0-9]{{1,{DECIMALS}}})?")

First = Annotated[PositionNumber, Query(description="The first position.")]
Last = Annotated[PositionNumber, Query(description="The last position.")]


class PositionEntry(RequestModel):
    """A position to be stored."""

    number: PositionNumber
    axes: Annotated[Amounts, Field(min_length=1)] | None = Field(
        default=None,
        description="By name; an axis that is not named is left out. Without axes, where the unit stands.",
    )


class PositionUpload(
    SentBack,
    json_schema_extra=example(positions=[{"number": 1, "axes": {"X": {"value": 10, "unit": "mm"}}}]),
):
    """Positions to be stored; others stay as they are."""

    read_only = frozenset(("robot_id", "unit", "ended_at"))

    positions: Annotated[list[PositionEntry], Field(min_length=1, max_length=LAST_POSITION)]


class StoredEntry(BaseModel):
    """A stored position."""

    number: int
    axes: dict[str, AxisValue] = Field(description="By name, without the axes it has no coordinate for.")


ENDED_AT = {
    "Ended-At": {
        "description": "The number that is not set, where the robot ended; absent where `last` was reached.",
        "schema": {"type": "integer"},
    }
}


class PositionTable(BaseModel):
    """Stored positions of a unit."""

    robot_id: str
    unit: int
    positions: list[StoredEntry]
    ended_at: int | None = Field(
        description="The number that is not set, where the robot ended: what is stored behind it has to be "
        "asked for from there. Null where `last` was reached."
    )


class Uploaded(BaseModel):
    """Positions that were stored."""

    robot_id: str
    unit: int
    count: int


@router.get("/robots/{robot_id}/units/{unit}/positions", Right.VIEW, response_model=PositionTable)
async def list_positions(
    request: Request, robot_id: RobotId, unit: UnitNumber, first: First = 1, last: Last = LAST_POSITION
) -> Response:
    """Read stored positions (POR); the robot ends at the first number that is not set."""
    axes = unit_of(request, robot_id, unit)
    stored = await positions.read(plant_of(request), origin(), robot_id, unit, first, last)
    return tagged(_table(axes, stored))


@router.put("/robots/{robot_id}/units/{unit}/positions", Right.SETUP, response_model=Uploaded, **IF_MATCH)
async def store_positions(
    request: Request,
    robot_id: RobotId,
    unit: UnitNumber,
    upload: PositionUpload,
    first: First = 1,
    last: Last = LAST_POSITION,
) -> Response:
    """Store positions undivided (POF, POS); a stop in the middle ends the upload first.

    A number alone stores where the unit stands; refused while it moves, and where an axis is not homed.
    `If-Match` is the ETag of the positions from `first` to `last`, which are read first then.
    """
    plant = plant_of(request)
    stored: list[Wanted] = [
        (
            entry.number,
            None
            if entry.axes is None
            else positions.in_order(plant, robot_id, unit, f"positions.{index}.axes", entry.axes),
        )
        for index, entry in enumerate(upload.positions)
    ]
    return await _store(request, unit_of(request, robot_id, unit), stored, (first, last), upload)


@router.get(
    "/robots/{robot_id}/units/{unit}/positions.csv",
    Right.VIEW,
    response_class=Response,
    responses={**DECLARED, 200: {**ANSWER, "headers": ENDED_AT}},
)
async def download_positions(
    request: Request, robot_id: RobotId, unit: UnitNumber, first: First = 1, last: Last = LAST_POSITION
) -> Response:
    """Read stored positions as CSV: the number, then a column for each axis with its unit.

    The robot ends at the first number that is not set; the header `Ended-At` names it.
    """
    axes = unit_of(request, robot_id, unit)
    stored = await positions.read(plant_of(request), origin(), robot_id, unit, first, last)
    rows = [[number, *map(_cell, values)] for number, values in stored.positions]
    headers = {} if stored.ended_at is None else {"Ended-At": str(stored.ended_at)}
    headers["ETag"] = etag_of(_table(axes, stored))
    return csv_response(_header(axes), rows, headers)


# Generated clients cannot send text/csv: it stays out of the OpenAPI document, whose way is JSON in parts.
@router.put("/robots/{robot_id}/units/{unit}/positions.csv", Right.SETUP, include_in_schema=False)
async def upload_positions(
    request: Request, robot_id: RobotId, unit: UnitNumber, first: First = 1, last: Last = LAST_POSITION
) -> Response:
    """Store positions from CSV as it is downloaded, or as Excel writes it; others stay as they are."""
    axes = unit_of(request, robot_id, unit)
    header = _header(axes)
    rows = await read_table(request, header, MAX_CSV_BYTES)
    return await _store(request, axes, _parse(header, rows), (first, last))


async def _store(
    request: Request,
    unit: RobotUnit,
    stored: Sequence[Wanted],
    known: Sequence[int],
    upload: PositionUpload | None = None,
) -> Response:
    plant, expects = plant_of(request), expected_by(request, upload, lambda held: _table(unit, held))
    await positions.store(plant, origin(), unit.robot_id, unit.number, stored, known, expects)
    return json_response(Uploaded(robot_id=unit.robot_id, unit=unit.number, count=len(stored)))


def _table(unit: RobotUnit, stored: Stored) -> PositionTable:
    entries = [StoredEntry(number=number, axes=_named(unit, values)) for number, values in stored.positions]
    return PositionTable(
        robot_id=unit.robot_id, unit=unit.number, positions=entries, ended_at=stored.ended_at
    )


def _named(unit: RobotUnit, values: list[float | None]) -> dict[str, AxisValue]:
    padded = values + [None] * (len(unit.axes) - len(values))
    return {
        name: AxisValue(value=value, unit=unit.systems[name].unit(Quantity.POSITION))
        for name, value in unit.by_axis(unit.axes, padded).items()
        if value is not None
    }


def _header(unit: RobotUnit) -> list[str]:
    return [NUMBER, *(f"{name} {unit.systems[name].unit(Quantity.POSITION)}" for name in unit.axes)]


def _parse(header: list[str], rows: list[Row]) -> list[Numbered]:
    """Read positions; errors name the line and the column.

    :raises InvalidRequest: a cell has another form.
    """
    return [_position(header, line, cells) for line, cells in rows]


def _position(header: list[str], line: int, cells: list[str]) -> Numbered:
    number, *coordinates = cells
    if not _NUMBER.fullmatch(number) or not 1 <= int(number) <= LAST_POSITION:
        raise InvalidRequest(
            f"line {line}, {NUMBER}: positions go from 1 to {LAST_POSITION}; nothing was sent."
        )
    values = [_coordinate(line, *cell) for cell in zip(header[1:], coordinates, strict=True)]
    return int(number), values


def _coordinate(line: int, column: str, text: str) -> float | None:
    if not text:
        return None
    if not _COORDINATE.fullmatch(text):
        raise InvalidRequest(
            f"line {line}, {column}: a coordinate is a number from {-LARGEST} to {LARGEST} with at most "
            f"{DECIMALS} decimals; nothing was sent."
        )
    return float(text)


def _cell(value: float | None) -> str | None:
    return None if value is None else f"{value:.15g}"
