"""A unit's table of stored positions over HTTP as CSV."""

import re
from typing import Final

from fastapi import Request, Response

from api.common.csv_tables import ANSWER, Row, csv_response, read_table
from api.common.etags import header_of, matching
from api.common.problems import DECLARED
from api.common.requests import json_response, new_router, plant_of
from api.robots.names import robot_of
from gateway.core.errors import InvalidRequest
from gateway.core.rights import Right
from gateway.door.caller import require
from gateway.door.documents import expectation
from gateway.door.names import RobotId, UnitNumber
from gateway.door.robot_positions import First, Last, Numbered, read, store, table_of
from gateway.fics.units import RobotUnit
from protocols.fics.notation import DECIMALS, LARGEST, Quantity
from protocols.fics.positions import LAST_POSITION

router = new_router("robot positions")

MAX_CSV_BYTES: Final = 262_144
"""A whole table of 1999 positions with eight long coordinates each."""
NUMBER = "number"
_NUMBER = re.compile("[0-9]{1,4}")
_COORDINATE = re.compile(rf"[+-]?[0-9]{{1,8}}(?:\.[0-9]{{1,{DECIMALS}}})?")

ENDED_AT = {
    "Ended-At": {
        "description": "The number that is not set, where the robot ended; absent where `last` was reached.",
        "schema": {"type": "integer"},
    }
}


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
    require(plant_of(request), Right.VIEW, robot_id)
    robot = robot_of(request, robot_id)
    axes = robot.unit(unit)
    stored = await read(robot, unit, first, last)
    rows = [[number, *map(_cell, values)] for number, values in stored.positions]
    headers = {} if stored.ended_at is None else {"Ended-At": str(stored.ended_at)}
    return csv_response(_header(axes), rows, {**headers, **header_of(table_of(axes, stored))})


# Generated clients cannot send text/csv: it stays out of the OpenAPI document, whose way is JSON in parts.
@router.put("/robots/{robot_id}/units/{unit}/positions.csv", Right.SETUP, include_in_schema=False)
async def upload_positions(
    request: Request, robot_id: RobotId, unit: UnitNumber, first: First = 1, last: Last = LAST_POSITION
) -> Response:
    """Store positions from CSV as it is downloaded, or as Excel writes it; others stay as they are."""
    require(plant_of(request), Right.SETUP, robot_id)
    robot = robot_of(request, robot_id)
    axes = robot.unit(unit)
    header = _header(axes)
    rows = _parse(header, await read_table(request, header, MAX_CSV_BYTES))
    expects = expectation(None, matching(request))
    return json_response(await store(robot, axes, rows, (first, last), expects))


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
