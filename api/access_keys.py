"""Keys over HTTP: listed without their secret, made and shown once, revoked."""

from typing import Annotated

from fastapi import Path, Request, Response
from pydantic import BaseModel, Field

from api.common.requests import access_of, json_response, new_router, origin, plant_of
from gateway.access.keys import LONGEST_S, OVERLAP_S, KeyInfo
from gateway.access.roles import Role
from gateway.core.records import RequestModel, example
from gateway.core.rights import Right
from gateway.operations import access_keys

router = new_router("access keys")

_SECRET = {"Cache-Control": "no-store"}
KeyName = Annotated[str, Path(max_length=64, description="The name of a key.", examples=["mes"])]


class NewKey(
    RequestModel, json_schema_extra=example(name="mes", role="operator", scope=["line1"], expires_s=7_776_000)
):
    """A key to be made."""

    name: str = Field(
        max_length=64, description="Who or what it is for: letters, digits and . _ @ -; records name it."
    )
    # A word in JSON is no member of an enumeration, where nothing is converted.
    role: Annotated[Role, Field(strict=False, description="What it may do; every role may stop.")]
    scope: list[str] | None = Field(
        default=None,
        min_length=1,
        max_length=200,
        description="The addresses of lines, bodies, groups and robots that it is for; left out: all.",
    )
    expires_s: float | None = Field(
        default=None,
        gt=0,
        le=LONGEST_S,
        description="In seconds from now; left out: `access.key_lifetime_d`, a year if nothing else is said.",
    )


class Rotation(RequestModel, json_schema_extra=example(overlap_s=604_800)):
    """How a key is rotated."""

    overlap_s: float = Field(
        default=OVERLAP_S, ge=0, le=LONGEST_S, description="Seconds for which the old key is good yet."
    )


class MadeKey(KeyInfo):
    """A key that was made, with its secret."""

    key: str = Field(
        description="What its owner sends. It is told this once: the gateway keeps its hash only."
    )


class KeyList(BaseModel):
    """All keys, those that cannot be used any more too, oldest first."""

    keys: list[KeyInfo]


@router.get("/access/keys", Right.ADMIN, response_model=KeyList)
async def list_keys(request: Request) -> Response:
    """List the keys, without what is secret of them."""
    found = await access_keys.listed(plant_of(request), origin(), access_of(request).keys)
    return json_response(KeyList(keys=list(found)))


@router.post("/access/keys", Right.ADMIN, status_code=201, response_model=MadeKey)
async def make_key(request: Request, new: NewKey) -> Response:
    """Make a key and tell it once. The header Idempotency-Key is refused: it would have the secret kept."""
    key, made = await access_keys.make(
        plant_of(request),
        origin(),
        access_of(request).keys,
        new.name,
        new.role,
        new.scope,
        new.expires_s,
    )
    return _made(key, made)


@router.post("/access/keys/{name}/rotate", Right.ADMIN, status_code=201, response_model=MadeKey)
async def rotate_key(request: Request, name: KeyName, rotation: Rotation) -> Response:
    """Make a new key in the place of a good one and tell it once; the old one is good for the overlap yet."""
    key, made = await access_keys.rotate(
        plant_of(request), origin(), access_of(request).keys, name, rotation.overlap_s
    )
    return _made(key, made)


@router.post("/access/keys/{name}/approve", Right.ADMIN, response_model=KeyInfo)
async def approve_key(request: Request, name: KeyName) -> Response:
    """Let a key of an admin be good that another admin has made (`access.four_eyes`)."""
    store = access_of(request).keys
    return json_response(await access_keys.approve(plant_of(request), origin(), store, name))


def _made(key: str, made: KeyInfo) -> Response:
    headers = {**_SECRET, "Location": f"/access/keys/{made.name}"}
    return json_response(MadeKey(**made.model_dump(), key=key), 201, headers)


@router.delete("/access/keys/{name}", Right.ADMIN, response_model=KeyInfo)
async def revoke_key(request: Request, name: KeyName) -> Response:
    """Let a key never be used again: its next request is refused, and its event streams end within 5 s."""
    store = access_of(request).keys
    return json_response(await access_keys.revoke(plant_of(request), origin(), store, name))
