"""Sessions over HTTP: who has signed in with a browser, and the end of them."""

from typing import Annotated

from fastapi import Path, Query, Request, Response
from pydantic import BaseModel

from api.common.requests import access_of, json_response, new_router, origin, plant_of
from gateway.access.grants import SessionInfo
from gateway.core.rights import Right
from gateway.operations import sessions

router = new_router("sessions")


class SessionList(BaseModel):
    """Sessions, the one that was used last first."""

    sessions: list[SessionInfo]


@router.get("/access/sessions", Right.ADMIN, response_model=SessionList)
async def list_sessions(request: Request) -> Response:
    """List who has signed in with a browser, from where, and when the session was last used."""
    found = await sessions.listed(plant_of(request), origin(), access_of(request).sessions)
    return json_response(SessionList(sessions=list(found)))


@router.delete("/access/sessions/{session_id}", Right.ADMIN, response_model=SessionInfo)
async def end_session(
    request: Request, session_id: Annotated[str, Path(max_length=64, description="The id of a session.")]
) -> Response:
    """End a session: its next request is refused, and its event streams end within 5 s."""
    return json_response(
        await sessions.end(plant_of(request), origin(), access_of(request).sessions, session_id)
    )


@router.delete("/access/sessions", Right.ADMIN, response_model=SessionList)
async def end_sessions(
    request: Request,
    key: Annotated[str, Query(min_length=1, max_length=256, description="The name of a key.")],
) -> Response:
    """End all sessions of a key, which stays good, and list them."""
    ended = await sessions.end_all(plant_of(request), origin(), access_of(request).sessions, key)
    return json_response(SessionList(sessions=list(ended)))
