"""A body's table of stored positions over HTTP as CSV."""

import re
from typing import Final

from fastapi import Request, Response

from api.bodies.names import body_of
from api.common.csv_tables import ANSWER, csv_response, read_table
from api.common.etags import header_of, matching
from api.common.problems import DECLARED
from api.common.requests import begun_response, json_response, new_router, plant_of, wait_s
from gateway.core.errors import InvalidRequest
from gateway.core.operation import Wait
from gateway.core.rights import Right
from gateway.door.body_positions import First, Last, begin_to_store, list_body_positions, store
from gateway.door.caller import require
from gateway.door.documents import expectation
from gateway.door.names import BodyId
from gateway.rorze.positions import LAST_POSITION, Wanted

router = new_router("positions")

HEADER: Final = ("number", "pulse")
MAX_CSV_BYTES: Final = 65_536
"""A whole table of 2048 positions of ten digits."""
_NUMBER: Final = re.compile("[0-9]{1,4}")
_PULSES: Final = re.compile(r"([+-]?[0-9]{1,9})(\.0+)?")


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
    plant = plant_of(request)
    require(plant, Right.VIEW, body_id)
    table = await list_body_positions(plant, body_of(request, body_id), first=first, last=last)
    rows = [(it.number, it.pulses) for it in table.positions]
    return csv_response(HEADER, rows, header_of(table))


# Generated clients cannot send text/csv: it stays out of the OpenAPI document, whose way is JSON in parts.
@router.put("/bodies/{body_id}/positions.csv", Right.SETUP, include_in_schema=False)
async def upload_body_positions(
    request: Request, body_id: BodyId, first: First = 0, last: Last = LAST_POSITION
) -> Response:
    """Store positions from CSV as it is downloaded, or as Excel writes it; others stay as they are."""
    plant, body, wanted = plant_of(request), body_of(request, body_id), await _read_csv(request, body_id)
    require(plant, Right.SETUP, body_id)
    expects = expectation(None, matching(request))
    if expects is not None:
        expects(await list_body_positions(plant, body, first=first, last=last))
    return json_response(await store(plant, body, wanted, {}))


@router.post("/bodies/{body_id}/positions.csv", Right.SETUP, status_code=202, include_in_schema=False)
async def upload_body_position_csv(request: Request, body_id: BodyId, wait: Wait = None) -> Response:
    """Begin to store positions from CSV; the record is among `positions/uploads`."""
    plant, body, wanted = plant_of(request), body_of(request, body_id), await _read_csv(request, body_id)
    require(plant, Right.SETUP, body_id)
    waited_s = wait_s(request, wait)
    begun = await begin_to_store(plant, body, wanted, {}, flash=False, wait_s=waited_s)
    return begun_response(begun, f"{begun.target}/positions/uploads", waited_s)


async def _read_csv(request: Request, body_id: str) -> list[Wanted]:
    body_of(request, body_id)
    return [_wanted(line, *cells) for line, cells in await read_table(request, HEADER, MAX_CSV_BYTES)]


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
