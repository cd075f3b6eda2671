"""A unit's table of stored positions, in parts and as CSV."""

import re
from collections.abc import Sequence
from typing import Annotated, Final, NamedTuple

from pydantic import Field

from gateway.core.errors import InvalidRequest
from gateway.core.names import PositionName, given
from gateway.core.operation import Expectation, PlainText, Rows
from gateway.core.records import AnswerModel, RequestModel, SentBack, example
from gateway.core.rights import Right
from gateway.core.tables import Name
from gateway.door.csv_tables import CSV, Row, Table, csv_of, read_table
from gateway.fics.amounts import AxisAmounts, AxisValue, numbers
from gateway.fics.axes import UnitNumber
from gateway.fics.robot import Robot
from gateway.fics.units import RobotUnit
from gateway.plant import Plant
from protocols.fics.notation import DECIMALS, LARGEST, PositionNumber, Quantity
from protocols.fics.positions import LAST_POSITION

ROWS: Final = Rows("robot positions")
TABLES: Final = Rows("robot positions")
"""Rows of the table as CSV."""
MAX_CSV_BYTES: Final = 262_144
"""A whole table of 1999 positions with eight long coordinates each."""
NUMBER: Final = "number"
ENDED_AT: Final = "Ended-At"
_NUMBER: Final = re.compile("[0-9]{1,4}")
_COORDINATE: Final = re.compile(rf"[+-]?[0-9]{{1,8}}(?:\.[0-9]{{1,{DECIMALS}}})?")
First = Annotated[PositionNumber, Field(description="The first position.")]
Last = Annotated[PositionNumber, Field(description="The last position.")]
Numbered = tuple[int, list[float | None]]
"""A position's number, and its coordinates in the order of the axes."""

Wanted = tuple[int, list[float | None] | None]
"""A position to be stored: its number and coordinates; without coordinates, where the unit stands."""


class Stored(NamedTuple):
    """Positions that a robot holds."""

    positions: list[Numbered]
    ended_at: int | None
    """The number that is not set, where the robot ended before the last that was asked for."""


class PositionEntry(RequestModel):
    """A position to be stored."""

    number: PositionNumber
    axes: AxisAmounts | None = Field(
        default=None,
        description=(
            "Coordinates by name; an axis that is not named is left out. Without axes, where the unit stands."
        ),
    )
    name: Name | None = Field(
        default=None, description="Name of the position; left out or null, it keeps the name it has."
    )


class PositionUpload(
    SentBack,
    json_schema_extra=example(positions=[{"number": 1, "axes": {"X": {"value": 10, "unit": "mm"}}}]),
):
    """Positions to be stored; others stay as they are."""

    read_only = frozenset(("robot_id", "unit"))
    passing = frozenset(("ended_at",))
    compared_whole = False

    positions: Annotated[list[PositionEntry], Field(max_length=LAST_POSITION)]


class StoredEntry(AnswerModel):
    """A stored position."""

    number: int
    name: str | None
    axes: dict[str, AxisValue] = Field(
        description="Coordinates by name, without the axes it has no coordinate for."
    )


class PositionTable(AnswerModel):
    """Stored positions of a unit."""

    robot_id: str
    unit: int
    positions: list[StoredEntry]
    ended_at: int | None = Field(
        description="The number that is not set, where the robot ended: what is stored behind it has to be "
        "asked for from there. Null where `last` was reached."
    )


class UnitPositionLabel(AnswerModel):
    """The name that a unit's position has now."""

    robot_id: str
    unit: int
    number: int
    name: str | None


class Uploaded(AnswerModel):
    """Positions that were stored."""

    robot_id: str
    unit: int
    count: int


@ROWS.get("/robots/{robot_id}/units/{unit}/positions", tagged=True)
async def list_positions(
    plant: Plant, robot: Robot, unit: UnitNumber, *, first: First = 1, last: Last = LAST_POSITION
) -> PositionTable:
    """Read stored positions (POR); the robot ends at the first number that is not set."""
    return table_of(plant, robot.unit(unit), await read(robot, unit, first, last))


@ROWS.put("/robots/{robot_id}/units/{unit}/positions", Right.SETUP)
async def store_positions(
    plant: Plant,
    robot: Robot,
    unit: UnitNumber,
    upload: PositionUpload,
    *,
    first: First = 1,
    last: Last = LAST_POSITION,
    expects: Expectation | None,
) -> Uploaded:
    """Store positions undivided (POF, POS); a stop in the middle ends the upload first.

    A number alone stores where the unit stands; refused while it moves, and where an axis is not homed.
    `If-Match` is the ETag of the positions from `first` to `last`, which are read first then.
    """
    addressed = robot.unit(unit)
    upload.require_unchanged(table_of(plant, addressed, Stored([], None)))
    wanted: list[Wanted] = [
        (
            entry.number,
            None
            if entry.axes is None
            else numbers(f"positions.{index}.axes", addressed, addressed.axes, entry.axes),
        )
        for index, entry in enumerate(upload.positions)
    ]
    stored = await store(plant, robot, addressed, wanted, (first, last), expects)
    await plant.names.name(addressed.address, given(upload.positions))
    return stored


@ROWS.put("/robots/{robot_id}/units/{unit}/positions/{number}/name", Right.SETUP, later=True)
async def name_unit_position(
    plant: Plant, robot: Robot, unit: UnitNumber, number: PositionNumber, wanted: PositionName
) -> UnitPositionLabel:
    """Name a position. The gateway keeps the name; nothing is sent."""
    await plant.names.name(robot.unit(unit).address, {number: wanted.name or ""})
    return UnitPositionLabel(robot_id=robot.id, unit=unit, number=number, name=wanted.name)


@TABLES.get(
    "/robots/{robot_id}/units/{unit}/positions.csv",
    media=CSV,
    tagged=True,
    beside={
        ENDED_AT: {
            "description": "The number that is not set, where the robot ended; absent where `last` was "
            "reached.",
            "schema": {"type": "integer"},
        }
    },
)
async def download_positions(
    plant: Plant, robot: Robot, unit: UnitNumber, *, first: First = 1, last: Last = LAST_POSITION
) -> PlainText:
    """Read stored positions as CSV: the number, then a column for each axis with its unit.

    The robot ends at the first number that is not set; the header `Ended-At` names it.
    """
    axes = robot.unit(unit)
    stored = await read(robot, unit, first, last)
    rows = [[number, *map(_cell, values)] for number, values in stored.positions]
    ended = {} if stored.ended_at is None else {ENDED_AT: str(stored.ended_at)}
    return PlainText(csv_of(_header(axes), rows), table_of(plant, axes, stored), ended)


@TABLES.put(
    "/robots/{robot_id}/units/{unit}/positions.csv",
    Right.SETUP,
    media=CSV,
    most_bytes=MAX_CSV_BYTES,
    documented=False,
)
async def upload_positions(
    plant: Plant,
    robot: Robot,
    unit: UnitNumber,
    table: Table,
    *,
    first: First = 1,
    last: Last = LAST_POSITION,
    expects: Expectation | None,
) -> Uploaded:
    """Store positions from CSV as it is downloaded, or as Excel writes it; others stay as they are."""
    axes = robot.unit(unit)
    header = _header(axes)
    rows = _parse(header, await read_table(table, header))
    return await store(plant, robot, axes, rows, (first, last), expects)


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


async def read(robot: Robot, unit: int, first: int, last: int) -> Stored:
    """Read stored positions; the robot ends at the first number that is not set.

    :raises InvalidRequest: the last is before the first.
    :raises GatewayError: they were not read; errors as of `download`.
    """
    robot.unit(unit)
    if last < first:
        raise InvalidRequest(f"last: it is less than first, {first}; nothing was sent.")
    stored = await robot.positions(first, last, unit)
    following = stored[-1][0] + 1 if stored else first
    return Stored(stored, following if following <= last else None)


async def store(
    plant: Plant,
    robot: Robot,
    unit: RobotUnit,
    positions: Sequence[Wanted],
    known: Sequence[int] = (1, LAST_POSITION),
    expects: Expectation | None = None,
) -> Uploaded:
    """Store positions undivided, and see that the robot holds them.

    `expects` refuses what the robot holds if the sender does not know it, from the first to the last `known`.
    Errors as of `tables.store`, and as of `tables.here` where one is to be where the unit stands.
    """

    def require(held: Stored) -> None:
        if expects is not None:
            expects(table_of(plant, unit, held))

    since = await robot.conversation.as_expected(
        lambda: read(robot, unit.number, *known), require if expects else None
    )
    here: list[float | None] = []
    if any(coordinates is None for _, coordinates in positions):
        here = await robot.tables.here(unit)
    stored = [(number, here if axes is None else axes) for number, axes in positions]
    await robot.upload_positions(stored, unit.number, since=since)
    return Uploaded(robot_id=unit.robot_id, unit=unit.number, count=len(stored))


def table_of(plant: Plant, unit: RobotUnit, stored: Stored) -> PositionTable:
    """Stored positions with their names, as they are told."""
    names = plant.names.of(unit.address)
    entries = [
        StoredEntry(number=number, name=names.get(number), axes=_named(unit, values))
        for number, values in stored.positions
    ]
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
