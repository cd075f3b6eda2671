"""A body's table of stored positions over HTTP: as JSON in parts, as CSV in whole."""

import re
from typing import Annotated, Final, Self

from fastapi import Path, Query, Request, Response
from pydantic import BaseModel, Field, model_validator

from api.bodies.names import body_of
from api.common.csv_tables import ANSWER, csv_response, read_table
from api.common.documentation import begins
from api.common.etags import IF_MATCH, etag_of, expected_by, tagged
from api.common.problems import DECLARED
from api.common.records import RecordRoutes
from api.common.requests import begun_response, json_response, new_router, origin, plant_of, wait_s
from api.common.strict_json import StrictRequest, StrictRoute
from gateway.core.errors import InvalidRequest
from gateway.core.operation import Wait
from gateway.core.records import RequestModel, SentBack, example, require_same
from gateway.core.rights import Right
from gateway.core.tables import Name
from gateway.door.names import BodyId
from gateway.operations import body_positions
from gateway.rorze.move_requests import Length
from gateway.rorze.position_uploads import TableUpload
from gateway.rorze.positions import LAST_POSITION, NamedPosition, Position, PositionReading, Wanted

MAX_TABLE_BYTES: Final = 262_144
"""A whole table as GET gives it: each of 2048 positions with its name, number, pulses, value and unit."""


class TableRequest(StrictRequest):
    """A request with a table in it."""

    most = MAX_TABLE_BYTES


class TableRoute(StrictRoute):
    """A route that may take a table."""

    request_class = TableRequest


router = new_router("positions", TableRoute)

HEADER: Final = ("number", "pulse")
MAX_CSV_BYTES: Final = 65_536
"""A whole table of 2048 positions of ten digits."""
_NUMBER: Final = re.compile("[0-9]{1,4}")
_PULSES: Final = re.compile(r"([+-]?[0-9]{1,9})(\.0+)?")

PositionNumber = Annotated[int, Field(ge=0, le=LAST_POSITION)]
First = Annotated[PositionNumber, Query(description="The first position.")]
Last = Annotated[PositionNumber, Query(description="The last position.")]
Number = Annotated[PositionNumber, Path(description="0-2047.", examples=[7])]


class PositionToStore(SentBack):
    """A position to be stored."""

    read_only = frozenset(("value", "unit"))

    number: PositionNumber
    position: Length | None = Field(default=None, description="Left out, where the motor stands.")
    pulses: Annotated[int, Field(gt=-1_000_000_000, lt=1_000_000_000)] | None = Field(
        default=None, description="Instead of `position`: as GET gives it, encoder counts in encoder mode."
    )
    name: Name | None = Field(default=None, description="Left out or null, it keeps the name it has.")

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

    positions: Annotated[list[PositionToStore], Field(min_length=1, max_length=LAST_POSITION + 1)]
    flash: bool = Field(default=False, description="Write the whole table to flash memory too (FPS).")


class PositionName(RequestModel, json_schema_extra=example(name="unload")):
    """What a position is called."""

    name: Name | None = Field(description="Null takes the name away.")


class PositionLabel(BaseModel):
    """What a position is called now."""

    body_id: str
    number: int
    name: str | None


class BodyPositions(BaseModel):
    """Stored positions of a body."""

    body_id: str
    positions: list[NamedPosition]
    flash: dict[int, int] = Field(
        description="What flash memory holds of these, in pulses by number: what counts at power-on. "
        "Only what is known: the gateway has to have seen that the table was saved (FPS) or loaded (FPD)."
    )


@router.get("/bodies/{body_id}/positions", Right.VIEW, response_model=BodyPositions)
async def list_body_positions(
    request: Request, body_id: BodyId, first: First = 0, last: Last = LAST_POSITION
) -> Response:
    """Read stored positions (3ND), each in a frame of its own: all 2048 take 90 s at 9600 baud.

    `POST .../positions/readings` answers at once.
    """
    return tagged(await _read(request, body_id, first, last))


@router.post("/bodies/{body_id}/positions/readings", Right.VIEW, **begins(PositionReading, "It is over."))
async def read_body_positions(
    request: Request, body_id: BodyId, first: First = 0, last: Last = LAST_POSITION, wait: Wait = None
) -> Response:
    """Begin to read stored positions; the record at `Location` has them in the end."""
    plant, waited_s = plant_of(request), wait_s(request, wait)
    begun = await body_positions.begin_to_read(plant, origin(), body_id, first, last, waited_s)
    return begun_response(begun, f"{begun.target}/positions/readings", waited_s)


RecordRoutes("a reading of positions", PositionReading, body_positions.READINGS, "Read no more.").add_to(
    router,
    "/bodies/{body_id}/positions/readings",
    "get_body_position_reading",
    "cancel_body_position_reading",
    body_id=BodyId,
)


@router.put("/bodies/{body_id}/positions", Right.SETUP, response_model=BodyPositions, **IF_MATCH)
async def store_body_positions(
    request: Request, body_id: BodyId, upload: PositionsToStore, first: First = 0, last: Last = LAST_POSITION
) -> Response:
    """Store positions (3PS) and read them back; without a position, where the motor stands.

    `If-Match` is the ETag of the positions from `first` to `last`, which are read first then. Each position
    takes 0.13 s at 9600 baud: for many, `POST .../positions/uploads` answers at once.
    """
    wanted, names = _of(request, body_id, upload)
    await _require_match(request, body_id, first, last, upload)
    await _require_unchanged(request, body_id, upload)
    return json_response(await _store(request, body_id, wanted, names, flash=upload.flash))


@router.post("/bodies/{body_id}/positions/uploads", Right.SETUP, **begins(TableUpload, "It is over."))
async def upload_body_position_table(
    request: Request, body_id: BodyId, upload: PositionsToStore, wait: Wait = None
) -> Response:
    """Begin to store positions as `PUT .../positions` does; the record at `Location` tells how far it is.

    What takes long does so without holding a request: all 2048 positions take four minutes at 9600 baud.
    """
    wanted, names = _of(request, body_id, upload)
    await _require_unchanged(request, body_id, upload)
    return await _begin(request, body_id, wanted, names, upload.flash, wait)


RecordRoutes(
    "an upload of positions",
    TableUpload,
    body_positions.UPLOADS,
    "Store no more; what was sent stays in RAM, and `error` says how much that is.",
).add_to(
    router,
    "/bodies/{body_id}/positions/uploads",
    "get_body_position_upload",
    "cancel_body_position_upload",
    body_id=BodyId,
)


@router.put("/bodies/{body_id}/positions/{number}/name", Right.SETUP, response_model=PositionLabel)
async def name_body_position(
    request: Request, body_id: BodyId, number: Number, named: PositionName
) -> Response:
    """Name a position. The gateway keeps the name; nothing is sent."""
    plant = plant_of(request)
    await body_positions.name(plant, origin(), body_id, number, named.name or "")
    address = body_of(request, body_id).address
    return json_response(PositionLabel(body_id=address, number=number, name=named.name))


@router.get(
    "/bodies/{body_id}/positions.csv",
    Right.VIEW,
    response_class=Response,
    responses={**DECLARED, 200: ANSWER},
)
async def download_body_positions(
    request: Request, body_id: BodyId, first: First = 0, last: Last = LAST_POSITION
) -> Response:
    """Read stored positions as CSV: the columns `number` and `pulse`."""
    table = await _read(request, body_id, first, last)
    rows = [(it.number, it.pulses) for it in table.positions]
    return csv_response(HEADER, rows, {"ETag": etag_of(table)})


# Generated clients cannot send text/csv: it stays out of the OpenAPI document, whose way is JSON in parts.
@router.put("/bodies/{body_id}/positions.csv", Right.SETUP, include_in_schema=False)
async def upload_body_positions(
    request: Request, body_id: BodyId, first: First = 0, last: Last = LAST_POSITION
) -> Response:
    """Store positions from CSV as it is downloaded, or as Excel writes it; others stay as they are."""
    wanted = await _read_csv(request, body_id)
    await _require_match(request, body_id, first, last)
    return json_response(await _store(request, body_id, wanted, {}))


@router.post("/bodies/{body_id}/positions.csv", Right.SETUP, status_code=202, include_in_schema=False)
async def upload_body_position_csv(request: Request, body_id: BodyId, wait: Wait = None) -> Response:
    """Begin to store positions from CSV; the record is among `positions/uploads`."""
    return await _begin(request, body_id, await _read_csv(request, body_id), {}, False, wait)


async def _begin(
    request: Request,
    body_id: str,
    wanted: list[Wanted],
    names: dict[int, str],
    flash: bool,
    wait: float | None,
) -> Response:
    plant, waited_s = plant_of(request), wait_s(request, wait)
    begun = await body_positions.begin_to_store(plant, origin(), body_id, wanted, names, flash, waited_s)
    return begun_response(begun, f"{begun.target}/positions/uploads", waited_s)


async def _read_csv(request: Request, body_id: str) -> list[Wanted]:
    body_of(request, body_id)
    return [_wanted(line, *cells) for line, cells in await read_table(request, HEADER, MAX_CSV_BYTES)]


def _of(request: Request, body_id: str, upload: PositionsToStore) -> tuple[list[Wanted], dict[int, str]]:
    """The positions of a request in pulses, and their names."""
    scale = body_of(request, body_id).scale
    wanted = [
        Wanted(it.number, it.pulses if it.position is None else it.position.pulses(scale))
        for it in upload.positions
    ]
    return wanted, {it.number: it.name for it in upload.positions if it.name is not None}


def _wanted(line: int, number: str, pulses: str) -> Wanted:
    if not _NUMBER.fullmatch(number) or int(number) > LAST_POSITION:
        raise InvalidRequest(
            f"line {line}, number: positions go from 0 to {LAST_POSITION}; nothing was sent."
        )
    whole = _PULSES.fullmatch(pulses)
    if whole is None:
        raise InvalidRequest(
            f"line {line}, pulse: it is a whole number from -999999999 to 999999999; nothing was sent."
        )
    return Wanted(int(number), int(whole[1]))


async def _read(request: Request, body_id: str, first: int, last: int) -> BodyPositions:
    held = await body_positions.read(plant_of(request), origin(), body_id, first, last)
    return _table(request, body_id, held)


async def _require_unchanged(request: Request, body_id: str, upload: PositionsToStore) -> None:
    """Refuse a value in the body's unit that is neither that of the pulses beside it nor that of now."""
    scale = body_of(request, body_id).scale
    for it in upload.positions:
        follows = {
            "value": None if scale is None else scale.value(it.pulses or 0),
            "unit": None if scale is None else scale.unit,
        }
        if not it.told.items() <= follows.items():
            [held] = (await _read(request, body_id, it.number, it.number)).positions
            require_same(it.told, held, f"positions.{it.number}.")


async def _require_match(
    request: Request, body_id: str, first: int, last: int, upload: PositionsToStore | None = None
) -> None:
    expects = expected_by(request, upload)
    if expects is not None:
        expects(await _read(request, body_id, first, last))


async def _store(
    request: Request, body_id: str, wanted: list[Wanted], names: dict[int, str], *, flash: bool = False
) -> BodyPositions:
    held = await body_positions.store(plant_of(request), origin(), body_id, wanted, names, flash)
    return _table(request, body_id, held)


def _table(request: Request, body_id: str, held: list[Position]) -> BodyPositions:
    body = body_of(request, body_id)
    return BodyPositions(
        body_id=body.address,
        positions=[body_positions.named(plant_of(request), body, it) for it in held],
        flash=body.position_flash.held_of(it.number for it in held),
    )
