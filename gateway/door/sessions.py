"""Sessions: who has signed in with a browser, and the end of them."""

from typing import Annotated, Final

from pydantic import BaseModel, Field

from gateway.access.grants import SessionInfo
from gateway.core.errors import NotFound
from gateway.core.operation import Rows
from gateway.core.rights import Right
from gateway.plant import Plant
from protocols.wording import as_given

ROWS: Final = Rows("sessions")
SessionId = Annotated[str, Field(max_length=64, description="The id of a session.")]


class SessionList(BaseModel):
    """Sessions, the one that was used last first."""

    sessions: list[SessionInfo]


@ROWS.get("/access/sessions", Right.ADMIN)
async def list_sessions(plant: Plant) -> SessionList:
    """List who has signed in with a browser, from where, and when the session was last used."""
    return SessionList(sessions=list(plant.sessions.all()))


@ROWS.delete("/access/sessions/{session_id}", Right.ADMIN, whole_plant=True)
async def end_session(plant: Plant, session_id: SessionId) -> SessionInfo:
    """End a session: its next request is refused, and its event streams end within 5 s."""
    for ended in plant.sessions.end_by(id=session_id):
        return ended
    raise NotFound(f"There is no session {as_given(session_id)}, or it has ended.")


@ROWS.delete("/access/sessions", Right.ADMIN)
async def end_sessions(
    plant: Plant,
    *,
    key: Annotated[str, Field(min_length=1, max_length=256, description="The name of a key.")],
) -> SessionList:
    """End all sessions of a key, which stays good, and list them."""
    return SessionList(sessions=list(plant.sessions.end_by(name=key)))
