"""Keys and sessions as an administrator sees and ends them; of each change of keys an event tells."""

import asyncio
from functools import partial
from typing import Annotated, Final

from pydantic import Field

from gateway.access.grants import SessionInfo
from gateway.access.keys import (
    LONGEST_S,
    OVERLAP_S,
    KeyFault,
    KeyFileFault,
    KeyInfo,
    KeyStore,
    State,
)
from gateway.access.principal import current
from gateway.access.roles import Role
from gateway.access.territory import PlantAccess
from gateway.core.errors import InvalidRequest, NotAllowed, NotFound, NotSent
from gateway.core.events import EventHub
from gateway.core.operation import Rows
from gateway.core.parts import GATEWAY
from gateway.core.records import AnswerModel, RequestModel, example
from gateway.core.rights import Right
from gateway.core.targets import Opened
from gateway.security import entries
from protocols.wording import as_given

ROWS: Final = Rows("access keys")
SESSIONS: Final = Rows("sessions")
KeyName = Annotated[str, Field(max_length=64, description="The name of a key.", examples=["mes"])]


class NewKey(
    RequestModel, json_schema_extra=example(name="mes", role="operator", scope=["line1"], expires_s=7_776_000)
):
    """A key to be made."""

    name: str = Field(
        max_length=64,
        description="The person or program it is for: letters, digits and . _ @ -; records name it.",
    )
    # A word in JSON is no member of an enumeration, where nothing is converted.
    role: Annotated[Role, Field(strict=False, description="The rights of the key; every role may stop.")]
    scope: list[str] | None = Field(
        default=None,
        min_length=1,
        max_length=200,
        description="Addresses of the lines, bodies, groups and robots that the key is for; left out: all.",
    )
    expires_s: float | None = Field(
        default=None,
        gt=0,
        le=LONGEST_S,
        description="Seconds from now; left out: `access.key_lifetime_d`, a year if nothing else is said.",
    )


class Rotation(RequestModel, json_schema_extra=example(overlap_s=604_800)):
    """The rotation of a key."""

    overlap_s: float = Field(
        default=OVERLAP_S, ge=0, le=LONGEST_S, description="Seconds for which the old key stays good."
    )


class MadeKey(KeyInfo):
    """A key that was made, with its secret."""

    key: str = Field(
        description="The secret that the owner sends. It is told this once: the gateway keeps its hash only."
    )


class KeyList(AnswerModel):
    """All keys, those that cannot be used any more too, oldest first."""

    keys: list[KeyInfo]


@ROWS.get("/access/keys", Right.ADMIN)
async def list_keys(access: PlantAccess) -> KeyList:
    """List the keys, without what is secret of them."""
    keys = _managed(access)
    try:
        return KeyList(keys=await asyncio.to_thread(keys.infos))
    except KeyFault as fault:
        raise NotSent(str(fault)) from None


@ROWS.post("/access/keys", Right.ADMIN, result=MadeKey, opens=True)
async def make_key(access: PlantAccess, events: EventHub, new: NewKey) -> Opened:
    """Make a key and tell it once. The header Idempotency-Key is refused: it would store the secret."""
    keys = _managed(access)
    by = current().name
    try:
        lasts_s = keys.policy().lifetime_s if new.expires_s is None else new.expires_s
        key = await asyncio.to_thread(partial(keys.create, new.name, new.role, new.scope, lasts_s, by=by))
    except KeyFileFault as fault:
        raise NotSent(f"{fault} No key was made.") from None
    except KeyFault as fault:
        raise InvalidRequest(f"{fault} No key was made.") from None
    made = await _told(keys, new.name)
    events.publish("gateway.key.made", GATEWAY, made)
    await access.security.keep(entries.KEY_MADE, new.name, **_of(made), expires_at=_ending(made))
    return _shown(key, made)


@ROWS.post("/access/keys/{name}/rotate", Right.ADMIN, whole_plant=True, result=MadeKey, opens=True)
async def rotate_key(access: PlantAccess, events: EventHub, name: KeyName, rotation: Rotation) -> Opened:
    """Make a new key in the place of a good one and tell it once; the old one is good for the overlap yet."""
    keys, overlap_s = _managed(access), rotation.overlap_s
    await _require(keys, name, "good")
    try:
        key = await asyncio.to_thread(partial(keys.rotate, name, overlap_s, by=current().name))
    except KeyFileFault as fault:
        raise NotSent(f"{fault} No key was made.") from None
    except KeyFault as fault:
        raise NotAllowed(f"{fault} No key was made.") from None
    rotated = await _told(keys, name)
    events.publish("gateway.key.rotated", GATEWAY, rotated)
    changed = {**_of(rotated), "expires_at": _ending(rotated), "overlap": f"{overlap_s:g} s"}
    await access.security.keep(entries.KEY_CHANGED, name, **changed)
    return _shown(key, rotated)


@ROWS.post("/access/keys/{name}/approve", Right.ADMIN, whole_plant=True)
async def approve_key(access: PlantAccess, events: EventHub, name: KeyName) -> KeyInfo:
    """Approve a key of an admin that another admin has made (`access.four_eyes`)."""
    keys = _managed(access)
    await _require(keys, name, "waiting")
    try:
        await asyncio.to_thread(keys.approve, name, current().name)
    except KeyFileFault as fault:
        raise NotSent(f"{fault} {name} was not approved.") from None
    except KeyFault as fault:
        raise NotAllowed(f"{fault} It was not approved.") from None
    approved = await _told(keys, name)
    events.publish("gateway.key.approved", GATEWAY, approved)
    await access.security.keep(entries.KEY_APPROVED, name, **_of(approved), expires_at=_ending(approved))
    return approved


@ROWS.delete("/access/keys/{name}", Right.ADMIN, whole_plant=True)
async def revoke_key(access: PlantAccess, events: EventHub, name: KeyName) -> KeyInfo:
    """Revoke a key: its next request is refused, and its event streams end within 5 s."""
    keys = _managed(access)
    if name == current().name:
        raise NotAllowed(
            f"You have signed in with {name}; it was not revoked.", "Revoke it with another key of an admin."
        )
    try:
        await asyncio.to_thread(keys.revoke, name)
    except KeyFileFault as fault:
        raise NotSent(f"{fault} {name} was not revoked.") from None
    except KeyFault as fault:
        raise NotFound(str(fault)) from None
    revoked = await _told(keys, name)
    events.publish("gateway.key.revoked", GATEWAY, revoked)
    await access.security.keep(entries.KEY_REVOKED, name, **_of(revoked))
    return revoked


def _shown(key: str, made: KeyInfo) -> Opened:
    return Opened(f"/access/keys/{made.name}", MadeKey(**made.model_dump(), key=key))


async def _require(keys: KeyStore, name: str, state: State) -> None:
    """Refuse what cannot be done to a key in another state.

    :raises NotFound: no key of this name is in it.
    :raises NotSent: the keys cannot be read.
    """
    try:
        infos = await asyncio.to_thread(keys.infos)
    except KeyFault as fault:
        raise NotSent(str(fault)) from None
    if not any(info.name == name and info.state == state for info in infos):
        raise NotFound(f"There is no {state} key {as_given(name)}; nothing was changed.")


def _managed(access: PlantAccess) -> KeyStore:
    """The store of keys, where the gateway asks for keys."""
    store = access.credentials.keys
    if store is None:
        raise NotAllowed(
            "This gateway lets everybody in (access.mode is open), so nobody manages keys over HTTP; "
            "nothing was changed.",
            'Set access.mode = "keys", or use `motion-gateway keys` on its machine.',
        )
    return store


async def _told(keys: KeyStore, name: str) -> KeyInfo:
    """The newest key of a name."""
    return next(info for info in reversed(await asyncio.to_thread(keys.infos)) if info.name == name)


def _of(key: KeyInfo) -> dict[str, object]:
    return {"role": key.role, "scope": key.scope}


def _ending(key: KeyInfo) -> str | None:
    return None if key.expires_at is None else key.expires_at.isoformat()


SessionId = Annotated[str, Field(max_length=64, description="The id of a session.")]


class SessionList(AnswerModel):
    """Sessions, the one that was used last first."""

    sessions: list[SessionInfo]


@SESSIONS.get("/access/sessions", Right.ADMIN)
async def list_sessions(access: PlantAccess) -> SessionList:
    """List the sessions of browsers: the key, the address, and the time of the last use."""
    return SessionList(sessions=list(access.sessions.all()))


@SESSIONS.delete("/access/sessions/{session_id}", Right.ADMIN, whole_plant=True)
async def end_session(access: PlantAccess, session_id: SessionId) -> SessionInfo:
    """End a session: its next request is refused, and its event streams end within 5 s."""
    for ended in access.sessions.end_by(id=session_id):
        return ended
    raise NotFound(f"There is no session {as_given(session_id)}, or it has ended.")


@SESSIONS.delete("/access/sessions", Right.ADMIN)
async def end_sessions(
    access: PlantAccess,
    *,
    key: Annotated[str, Field(min_length=1, max_length=256, description="The name of a key.")],
) -> SessionList:
    """End all sessions of a key, which stays good, and list them."""
    return SessionList(sessions=list(access.sessions.end_by(name=key)))
