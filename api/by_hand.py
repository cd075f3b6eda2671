"""Answers to what HTTP alone serves: probes, figures, tickets, and documents with their tags."""

from collections.abc import Awaitable, Callable, Mapping
from functools import partial
from typing import Final, get_args

from starlette.requests import Request
from starlette.responses import FileResponse, Response

from api.common.requests import access_of, plant_of
from api.common.responses import json_response
from api.front.documents import JSON, Document
from gateway.door.catalogue import Family, tables_of
from gateway.door.of_http import Liveness, readiness_of, ticket_of
from gateway.door.recordings import CONTENT, file_of


async def livez(_request: Request) -> Response:
    """Answer, as long as the process can."""
    return json_response(Liveness(status="alive"))


async def readyz(request: Request) -> Response:
    """Say whether all can be used, by the status, too."""
    readiness = readiness_of(plant_of(request), access_of(request).view_of(request.scope))
    return json_response(readiness, 200 if readiness.ready else 503)


async def metrics(request: Request) -> Response:
    """Give all figures to Prometheus, whose library few gateways need."""
    from gateway.door.metrics import CONTENT_TYPE, text_of

    text = await text_of(plant_of(request), request.app.traffic)
    return Response(text, media_type=CONTENT_TYPE)


async def issue_ticket(request: Request) -> Response:
    """Give a ticket, which ends with the session or the key it was given for."""
    ticket = ticket_of(access_of(request).ticket_for(request.scope))
    return json_response(ticket, headers={"Cache-Control": "no-store"})


async def download_recording(request: Request, recording_id: str) -> Response:
    """Send a recording: a zip, for `motion-gateway export` and `replay`."""
    path = file_of(plant_of(request), recording_id)
    return FileResponse(path, media_type=CONTENT, filename=path.name)


async def list_commands(request: Request, family: Family | None) -> Response:
    """Send the tables of commands, which are written once."""
    return await TABLES[family].send(request)


def _written(*families: Family) -> bytes:
    return tables_of(*families).model_dump_json().encode()


TABLES: Final[Mapping[Family | None, Document]] = {
    None: Document(JSON, partial(_written, *get_args(Family))),
    **{family: Document(JSON, partial(_written, family)) for family in get_args(Family)},
}
"""The answers: all commands, and those of each family."""
ANSWERS: Final[Mapping[str, Callable[..., Awaitable[Response]]]] = {
    "livez": livez,
    "readyz": readyz,
    "metrics": metrics,
    "issueTicket": issue_ticket,
    "downloadRecording": download_recording,
    "listCommands": list_commands,
}
"""The functions that answer, by the operations' names."""
