"""A body's table of stored positions, in parts and as CSV, with the names that the gateway keeps for them."""

import re
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Annotated, Any, Final, Self

from pydantic import Field, model_validator

from gateway.core.errors import InvalidRequest
from gateway.core.marks import DETAIL
from gateway.core.names import PositionName, given
from gateway.core.operation import Expectation, PlainText, Rows, Wait
from gateway.core.records import AnswerModel, SentBack, example, require_same
from gateway.core.rights import Right
from gateway.core.tables import Name
from gateway.core.works import Jobs
from gateway.door.csv_tables import CSV, Table, csv_of, read_table
from gateway.door.records import list_records
from gateway.plant import Plant
from gateway.rorze import positions
from gateway.rorze.bodies import Body
from gateway.rorze.family import Rorze
from gateway.rorze.positions import (
    LAST_POSITION,
    NamedPosition,
    PositionReading,
    TablePosition,
    TableUpload,
    WantedPosition,
)
from gateway.rorze.units import Length

ROWS: Final = Rows("positions")
TABLES: Final = Rows("positions", later=True)
"""Rows of the table as CSV, and of what reads or stores it in long work."""
HEADER: Final = ("number", "pulse")
MAX_CSV_BYTES: Final = 65_536
"""A whole table of 2048 positions of ten digits."""
_NUMBER: Final = re.compile("[0-9]{1,4}")
_PULSES: Final = re.compile(r"([+-]?[0-9]{1,9})(\.0+)?")
MAX_TABLE_BYTES: Final = 262_144
"""A whole table as GET gives it: each of 2048 positions with its name, number, pulses, value and unit."""
PositionNumber = Annotated[int, Field(ge=0, le=LAST_POSITION)]
First = Annotated[PositionNumber, Field(description="The first position.")]
Last = Annotated[PositionNumber, Field(description="The last position.")]
Number = Annotated[PositionNumber, Field(description="0-2047.", examples=[7])]


class PositionToStore(SentBack):
    """A position to be stored."""

    read_only = frozenset(("value", "unit"))

    number: PositionNumber
    position: Length | None = Field(
        default=None, description="Position to store; left out, where the motor stands."
    )
    pulses: Annotated[int, Field(gt=-1_000_000_000, lt=1_000_000_000)] | None = Field(
        default=None, description="Instead of `position`: as GET gives it, encoder counts in encoder mode."
    )
    name: Name | None = Field(
        default=None, description="Name of the position; left out or null, it keeps the name it has."
    )

    @model_validator(mode="after")
    def _one_place(self) -> Self:
        if self.position is not None and self.pulses is not None:
            raise ValueError("give position or pulses, one of them")
        if self.told and self.pulses is None:
            raise ValueError("value and unit follow from pulses: give pulses, or position")
        return self


class PositionsToStore(
    SentBack,
    json_schema_extra=example(
        positions=[{"number": 7}, {"number": 8, "position": {"value": 500, "unit": "pulse"}}]
    ),
):
    """Positions to be stored; others stay as they are."""

    read_only = frozenset(("body_id", "flash"))
    compared_whole = False

    positions: Annotated[list[PositionToStore], Field(min_length=1, max_length=LAST_POSITION + 1)]
    flash: bool = Field(default=False, description="Write the whole table to flash memory too (FPS).")


class PositionLabel(AnswerModel):
    """The name that a position has now."""

    body_id: str
    number: int
    name: str | None


class BodyPositions(AnswerModel):
    """Stored positions of a body."""

    body_id: str
    positions: list[NamedPosition]
    flash: dict[int, int] = Field(
        description="Positions in flash memory, by number, as `pulses`: those that count at power-on. Only "
        "known ones: the gateway has to have seen that the table was saved (FPS) or loaded (FPD).",
        json_schema_extra=DETAIL,
    )


@ROWS.get("/bodies/{body_id}/positions", tagged=True)
async def list_body_positions(
    plant: Plant, body: Body, *, first: First = 0, last: Last = LAST_POSITION
) -> BodyPositions:
    """Read stored positions (3ND), each in a frame of its own: all 2048 take 90 s at 9600 baud.

    `POST .../positions/readings` answers at once.
    """
    return _table_of(plant, body, await positions.read(body, first, last))


@TABLES.post("/bodies/{body_id}/positions/readings", Right.VIEW, over="It is over.")
async def read_body_positions(
    plant: Plant, body: Body, *, first: First = 0, last: Last = LAST_POSITION, wait: Wait = None
) -> PositionReading:
    """Begin to read stored positions; the record at `Location` has them in the end."""
    begun = plant.family(Rorze).position_readings.start(body, first, last, partial(named, plant, body))
    await plant.family(Rorze).position_readings.wait(begun, wait or 0.0)
    return begun


def _readings(plant: Plant, body_id: str) -> tuple[Jobs[Any], str]:
    return plant.family(Rorze).position_readings, f"/bodies/{plant.family(Rorze).body(body_id).address}"


list_records(
    TABLES,
    "/bodies/{body_id}/positions/readings",
    PositionReading,
    _readings,
    one="a reading of positions",
    names=("get_body_position_reading", "cancel_body_position_reading"),
    cancelled="Read no more.",
    right=Right.VIEW,
)


@ROWS.put("/bodies/{body_id}/positions", Right.SETUP, most_bytes=MAX_TABLE_BYTES)
async def store_body_positions(
    plant: Plant,
    body: Body,
    upload: PositionsToStore,
    *,
    first: First = 0,
    last: Last = LAST_POSITION,
    expects: Expectation | None,
) -> BodyPositions:
    """Store positions (3PS) and read them back; without a position, where the motor stands.

    `If-Match` is the ETag of the positions from `first` to `last`, which are read first then. Each position
    takes 0.13 s at 9600 baud: for many, `POST .../positions/uploads` answers at once.
    """
    wanted, names = _of(body, upload)
    if expects is not None:
        expects(_table_of(plant, body, await positions.read(body, first, last)))
    await _require_unchanged(plant, body, upload)
    return await store(plant, body, wanted, names, flash=upload.flash)


@TABLES.post(
    "/bodies/{body_id}/positions/uploads", Right.SETUP, over="It is over.", most_bytes=MAX_TABLE_BYTES
)
async def upload_body_position_table(
    plant: Plant, body: Body, upload: PositionsToStore, *, wait: Wait = None
) -> TableUpload:
    """Begin to store positions as `PUT .../positions` does; the record at `Location` tells the progress.

    The request is not held meanwhile: all 2048 positions take four minutes at 9600 baud.
    """
    wanted, names = _of(body, upload)
    await _require_unchanged(plant, body, upload)
    return await begin_to_store(plant, body, wanted, names, flash=upload.flash, wait_s=wait or 0.0)


def _uploads(plant: Plant, body_id: str) -> tuple[Jobs[Any], str]:
    return plant.family(Rorze).position_uploads, f"/bodies/{plant.family(Rorze).body(body_id).address}"


list_records(
    TABLES,
    "/bodies/{body_id}/positions/uploads",
    TableUpload,
    _uploads,
    one="an upload of positions",
    names=("get_body_position_upload", "cancel_body_position_upload"),
    cancelled="Store no more; what was sent stays in RAM, and `error` says how much that is.",
)


@ROWS.put("/bodies/{body_id}/positions/{number}/name", Right.SETUP, later=True)
async def name_body_position(plant: Plant, body: Body, number: Number, wanted: PositionName) -> PositionLabel:
    """Name a position. The gateway keeps the name; nothing is sent."""
    await plant.names.name(body.address, {number: wanted.name or ""})
    return PositionLabel(body_id=body.address, number=number, name=wanted.name)


@TABLES.get("/bodies/{body_id}/positions.csv", media=CSV, tagged=True)
async def download_body_positions(
    plant: Plant, body: Body, *, first: First = 0, last: Last = LAST_POSITION
) -> PlainText:
    """Read stored positions as CSV: the columns `number` and `pulse`."""
    table = await list_body_positions(plant, body, first=first, last=last)
    return PlainText(
        csv_of(HEADER, [(position.number, position.pulses) for position in table.positions]), table
    )


@TABLES.put(
    "/bodies/{body_id}/positions.csv", Right.SETUP, media=CSV, most_bytes=MAX_CSV_BYTES, documented=False
)
async def upload_body_positions(
    plant: Plant,
    body: Body,
    table: Table,
    *,
    first: First = 0,
    last: Last = LAST_POSITION,
    expects: Expectation | None,
) -> BodyPositions:
    """Store positions from CSV as it is downloaded, or as Excel writes it; others stay as they are."""
    wanted = await _read_csv(table)
    if expects is not None:
        expects(await list_body_positions(plant, body, first=first, last=last))
    return await store(plant, body, wanted, {})


@TABLES.post(
    "/bodies/{body_id}/positions.csv",
    Right.SETUP,
    media=CSV,
    most_bytes=MAX_CSV_BYTES,
    documented=False,
    over="It is over.",
    kept_at="/bodies/{body_id}/positions/uploads",
)
async def upload_body_position_csv(
    plant: Plant, body: Body, table: Table, *, wait: Wait = None
) -> TableUpload:
    """Begin to store positions from CSV; the record is among `positions/uploads`."""
    return await begin_to_store(plant, body, await _read_csv(table), {}, flash=False, wait_s=wait or 0.0)


async def _read_csv(table: bytes) -> list[WantedPosition]:
    return [_wanted(line, *cells) for line, cells in await read_table(table, HEADER)]


def _wanted(line: int, number: str, pulses: str) -> WantedPosition:
    if not _NUMBER.fullmatch(number) or int(number) > LAST_POSITION:
        raise InvalidRequest(
            f"line {line}, number: positions go from 0 to {LAST_POSITION}; nothing was sent."
        )
    whole = _PULSES.fullmatch(pulses)
    if whole is None:
        raise InvalidRequest(
            f"line {line}, pulse: it is a whole number from -999999999 to 999999999; nothing was sent."
        )
    return WantedPosition(int(number), int(whole[1]))


async def store(
    plant: Plant,
    body: Body,
    wanted: Sequence[WantedPosition],
    names: Mapping[int, str],
    *,
    flash: bool = False,
) -> BodyPositions:
    """Store positions, and give them as they were read back; then name them.

    :raises BodyBusy: others are being stored; nothing was sent.
    :raises GatewayError: as of `positions.store`.
    """
    plant.family(Rorze).position_uploads.require_none(f"/bodies/{body.address}")
    held = await positions.store(body, wanted, flash=flash)
    await plant.names.name(body.address, names)
    return _table_of(plant, body, held)


async def begin_to_store(
    plant: Plant,
    body: Body,
    wanted: Sequence[WantedPosition],
    names: Mapping[int, str],
    *,
    flash: bool,
    wait_s: float,
) -> TableUpload:
    """Begin to store and name positions, and give the record after `wait_s` at most; errors as of `start`."""

    async def name_all(held: Sequence[TablePosition]) -> list[NamedPosition]:
        await plant.names.name(body.address, names)
        return [named(plant, body, position) for position in held]

    begun = plant.family(Rorze).position_uploads.start(body, wanted, flash=flash, named=name_all)
    await plant.family(Rorze).position_uploads.wait(begun, wait_s)
    return begun


def _of(body: Body, upload: PositionsToStore) -> tuple[list[WantedPosition], dict[int, str]]:
    """The positions of a request in pulses, and their names."""
    wanted = [
        WantedPosition(
            position.number,
            position.pulses if position.position is None else position.position.pulses(body.scale),
        )
        for position in upload.positions
    ]
    return wanted, given(upload.positions)


async def _require_unchanged(plant: Plant, body: Body, upload: PositionsToStore) -> None:
    """Refuse what cannot be set and is otherwise now.

    A value in the body's unit may be that of the pulses beside it, too.
    """
    numbers = (position.number for position in upload.positions)
    upload.require_unchanged(
        BodyPositions(body_id=body.address, positions=[], flash=body.flash.positions.held_of(numbers))
    )
    scale = body.scale
    for position in upload.positions:
        follows = {
            "value": None if scale is None else scale.value(position.pulses or 0),
            "unit": None if scale is None else scale.unit,
        }
        if not position.told.items() <= follows.items():
            [held] = await positions.read(body, position.number, position.number)
            require_same(position.told, named(plant, body, held), f"positions.{position.number}.")


def _table_of(plant: Plant, body: Body, held: Sequence[TablePosition]) -> BodyPositions:
    return BodyPositions(
        body_id=body.address,
        positions=[named(plant, body, position) for position in held],
        flash=body.flash.positions.held_of(position.number for position in held),
    )


def named(plant: Plant, body: Body, position: TablePosition) -> NamedPosition:
    """A position with its name, and in the unit of the body's scale."""
    scale = body.scale
    return NamedPosition(
        number=position.number,
        name=plant.names.of(body.address).get(position.number),
        pulses=position.pulses,
        value=None if scale is None else scale.value(position.pulses),
        unit=None if scale is None else scale.unit,
    )
