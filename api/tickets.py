"""Tickets for those that can send no header."""

from fastapi import Request, Response

from api.common.requests import access_of, json_response, new_router
from gateway.door.of_http import Ticket, ticket_of
from gateway.door.table import Right

router = new_router("system")


@router.post("/tickets", Right.VIEW, any_scope=True, response_model=Ticket)
async def issue_ticket(request: Request) -> Response:
    """Give a ticket for one event stream, which ends with the session or the key it was given for.

    It is for browsers, whose WebSockets and EventSources send no key.
    """
    access = access_of(request)
    ticket = ticket_of(access.ticket_for(request.scope))
    return json_response(ticket, headers={"Cache-Control": "no-store"})
