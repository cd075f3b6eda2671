"""Keys, as an administrator makes and revokes them: each time everybody who follows the gateway is told."""

import asyncio
from collections.abc import Sequence
from functools import partial

from gateway.access.keys import KeyFault, KeyFileFault, KeyInfo, KeyStore, State
from gateway.access.principal import current
from gateway.access.roles import Role
from gateway.core.errors import InvalidRequest, NotAllowed, NotFound, NotSent
from gateway.core.rights import Right
from gateway.operations.caller import needs
from gateway.plant import Plant
from gateway.security import entries
from gateway.wind_down import SUBJECT
from protocols.wording import as_given


@needs(Right.ADMIN, whole_plant=True)
async def listed(_: Plant, store: KeyStore | None) -> Sequence[KeyInfo]:
    """All keys, oldest first.

    :raises NotAllowed: nobody needs a key.
    :raises NotSent: they cannot be read.
    """
    keys = _managed(store)
    try:
        return await asyncio.to_thread(keys.infos)
    except KeyFault as fault:
        raise NotSent(str(fault)) from None


@needs(Right.ADMIN, whole_plant=True)
async def make(
    plant: Plant,
    store: KeyStore | None,
    name: str,
    role: Role,
    scope: Sequence[str] | None,
    expires_s: float | None,
) -> tuple[str, KeyInfo]:
    """Make a key, and give it with what is no secret of it; without a time it lasts as configured.

    :raises NotAllowed: nobody needs a key.
    :raises InvalidRequest: the name or the scope is none, or a good key has this name; no key was made.
    :raises NotSent: the keys cannot be written; no key was made.
    """
    keys = _managed(store)
    by = current().name
    try:
        lasts_s = keys.policy().lifetime_s if expires_s is None else expires_s
        key = await asyncio.to_thread(partial(keys.create, name, role, scope, lasts_s, by=by))
    except KeyFileFault as fault:
        raise NotSent(f"{fault} No key was made.") from None
    except KeyFault as fault:
        raise InvalidRequest(f"{fault} No key was made.") from None
    made = await _told(keys, name)
    plant.events.publish("gateway.key.made", SUBJECT, made)
    await plant.security.keep(entries.KEY_MADE, name, **_of(made), expires_at=_ending(made))
    return key, made


@needs(Right.ADMIN, whole_plant=True)
async def rotate(plant: Plant, store: KeyStore | None, name: str, overlap_s: float) -> tuple[str, KeyInfo]:
    """Make a new key in the place of a good one, which is good for the overlap yet.

    :raises NotAllowed: nobody needs a key, or it is another admin's where four eyes are wanted.
    :raises NotFound: there is no good key of this name.
    :raises NotSent: the keys cannot be written; no key was made.
    """
    keys = _managed(store)
    await _require(keys, name, "good")
    try:
        key = await asyncio.to_thread(partial(keys.rotate, name, overlap_s, by=current().name))
    except KeyFileFault as fault:
        raise NotSent(f"{fault} No key was made.") from None
    except KeyFault as fault:
        raise NotAllowed(f"{fault} No key was made.") from None
    rotated = await _told(keys, name)
    plant.events.publish("gateway.key.rotated", SUBJECT, rotated)
    changed = {**_of(rotated), "expires_at": _ending(rotated), "overlap": f"{overlap_s:g} s"}
    await plant.security.keep(entries.KEY_CHANGED, name, **changed)
    return key, rotated


@needs(Right.ADMIN, whole_plant=True)
async def approve(plant: Plant, store: KeyStore | None, name: str) -> KeyInfo:
    """Let a key that waits for a second admin be good.

    :raises NotAllowed: nobody needs a key, or the caller has made it.
    :raises NotFound: no key of this name waits.
    :raises NotSent: the keys cannot be written; it waits as before.
    """
    keys = _managed(store)
    await _require(keys, name, "waiting")
    try:
        await asyncio.to_thread(keys.approve, name, current().name)
    except KeyFileFault as fault:
        raise NotSent(f"{fault} {name} was not approved.") from None
    except KeyFault as fault:
        raise NotAllowed(f"{fault} It was not approved.") from None
    approved = await _told(keys, name)
    plant.events.publish("gateway.key.approved", SUBJECT, approved)
    await plant.security.keep(entries.KEY_APPROVED, name, **_of(approved), expires_at=_ending(approved))
    return approved


async def _require(keys: KeyStore, name: str, state: State) -> None:
    """Refuse what cannot be done to a key in another state.

    :raises NotFound: no key of this name is in it.
    :raises NotSent: the keys cannot be read.
    """
    try:
        infos = await asyncio.to_thread(keys.infos)
    except KeyFault as fault:
        raise NotSent(str(fault)) from None
    if not any(it.name == name and it.state == state for it in infos):
        raise NotFound(f"There is no {state} key {as_given(name)}; nothing was changed.")


@needs(Right.ADMIN, whole_plant=True)
async def revoke(plant: Plant, store: KeyStore | None, name: str) -> KeyInfo:
    """Let no key of this name be used any more.

    :raises NotAllowed: nobody needs a key, or it is the caller's own.
    :raises NotFound: there is no good key of this name.
    :raises NotSent: the keys cannot be written; it is as good as before.
    """
    keys = _managed(store)
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
    plant.events.publish("gateway.key.revoked", SUBJECT, revoked)
    await plant.security.keep(entries.KEY_REVOKED, name, **_of(revoked))
    return revoked


def _managed(store: KeyStore | None) -> KeyStore:
    """The keys, where somebody needs one."""
    if store is None:
        raise NotAllowed(
            "This gateway lets everybody in (access.mode is open), so nobody manages keys over HTTP; "
            "nothing was changed.",
            'Set access.mode = "keys", or use `motion-gateway keys` on its machine.',
        )
    return store


async def _told(keys: KeyStore, name: str) -> KeyInfo:
    """The newest key of a name."""
    return next(it for it in reversed(await asyncio.to_thread(keys.infos)) if it.name == name)


def _of(key: KeyInfo) -> dict[str, object]:
    return {"role": key.role, "scope": key.scope}


def _ending(key: KeyInfo) -> str | None:
    return None if key.expires_at is None else key.expires_at.isoformat()
