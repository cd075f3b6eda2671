"""Sessions of browsers that have signed in, as an administrator sees and ends them."""

from collections.abc import Sequence

from gateway.access.grants import SessionInfo, Sessions
from gateway.core.errors import NotFound
from gateway.core.rights import Right
from gateway.operations.caller import needs
from gateway.plant import Plant
from protocols.wording import as_given


@needs(Right.ADMIN, whole_plant=True)
async def listed(_: Plant, sessions: Sessions) -> Sequence[SessionInfo]:
    """Those that last, the one that was used last first."""
    return sessions.all()


@needs(Right.ADMIN, whole_plant=True)
async def end(_: Plant, sessions: Sessions, session_id: str) -> SessionInfo:
    """End one.

    :raises NotFound: there is none of this id, or it has ended.
    """
    for ended in sessions.end_by(id=session_id):
        return ended
    raise NotFound(f"There is no session {as_given(session_id)}, or it has ended.")


@needs(Right.ADMIN, whole_plant=True)
async def end_all(_: Plant, sessions: Sessions, name: str) -> Sequence[SessionInfo]:
    """End all of a key, or of a holder of tokens, by its name; gives those that have ended."""
    return sessions.end_by(name=name)
