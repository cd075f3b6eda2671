"""Routes of the subjects that HTTP alone has: probes, figures, tickets, and documents with their tags."""

from collections.abc import Mapping
from functools import partial
from typing import Final, get_args

from fastapi import Request, Response
from fastapi.responses import FileResponse

from api.common.requests import access_of, json_response, new_router, plant_of
from api.front.documents import JSON, Document
from gateway.door.catalogue import CommandList, Family, FamilyName, tables_of
from gateway.door.metrics import CONTENT_TYPE, text_of
from gateway.door.of_http import Liveness, Readiness, Ticket, readiness_of, ticket_of
from gateway.door.recordings import CONTENT, file_of
from gateway.door.table import Right

health, tickets, commands = new_router("health"), new_router("system"), new_router("commands")
recordings = new_router("recordings")
ROUTERS: Final = (health, tickets, commands, recordings)


@health.get("/livez", Right.OPEN, responses={}, response_model=Liveness)
async def livez() -> Response:
    """Answer, as long as the process can."""
    return json_response(Liveness(status="alive"))


@health.get(
    "/readyz",
    Right.OPEN,
    response_model=Readiness,
    responses={503: {"model": Readiness, "description": "A line is down, silent or being set up."}},
)
async def readyz(request: Request) -> Response:
    """Say whether all lines are open and set up, a device answers on each, and the journal can be written.

    A journal in trouble is no 503: no other gateway could carry out the stops and reads that go on.
    """
    readiness = readiness_of(plant_of(request), access_of(request).view_of(request.scope))
    return json_response(readiness, 200 if readiness.ready else 503)


@health.get("/metrics", Right.VIEW, include_in_schema=False)
async def metrics(request: Request) -> Response:
    """Give all figures to Prometheus."""
    return Response(await text_of(request.app.state.metrics), media_type=CONTENT_TYPE)


@tickets.post("/tickets", Right.VIEW, any_scope=True, response_model=Ticket)
async def issue_ticket(request: Request) -> Response:
    """Give a ticket for one event stream, which ends with the session or the key it was given for.

    It is for browsers, whose WebSockets and EventSources send no key.
    """
    access = access_of(request)
    ticket = ticket_of(access.ticket_for(request.scope))
    return json_response(ticket, headers={"Cache-Control": "no-store"})


# Clients made of the OpenAPI document know no files.
@recordings.get("/recordings/{recording_id}/content", Right.VIEW, any_scope=True, include_in_schema=False)
async def download_recording(request: Request, recording_id: str) -> Response:
    """Download a recording: a zip, for `motion-gateway export` and `replay`."""
    path = file_of(plant_of(request), recording_id)
    return FileResponse(path, media_type=CONTENT, filename=path.name)


@commands.get("/commands", Right.VIEW, any_scope=True, response_model=CommandList)
async def list_commands(request: Request, family: FamilyName = None) -> Response:
    """List every command that controllers and robots know."""
    return await TABLES[family].send(request)


def _written(*families: Family) -> bytes:
    return tables_of(*families).model_dump_json().encode()


TABLES: Final[Mapping[Family | None, Document]] = {
    None: Document(JSON, partial(_written, *get_args(Family))),
    **{family: Document(JSON, partial(_written, family)) for family in get_args(Family)},
}
"""The answers: all commands, and those of each family."""
