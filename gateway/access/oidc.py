"""Tokens of an OpenID provider: signed statements of a person's identity and roles.

The provider's keys are fetched in the background and kept, so that no request, and no stop, waits for it.
"""

import asyncio
import logging
import time
from collections.abc import Callable, Mapping
from hashlib import sha256
from typing import Any, Final, Protocol

import httpx
import jwt

from gateway.access.errors import NotPermitted
from gateway.access.grants import Grant
from gateway.access.principal import Principal
from gateway.access.roles import Role
from gateway.config import Oidc

log = logging.getLogger(__name__)

FETCH_S: Final = 3600.0
"""The keys are fetched again this often."""
RETRY_S: Final = 10.0
"""Seconds between fetches of the keys, when a token names an unknown one or the last fetch failed."""
TIMEOUT_S: Final = 10.0
MOST_BYTES: Final = 262_144
MOST_KEPT: Final = 1024
LEEWAY_S: Final = 30
"""Seconds by which the two clocks may differ."""
MOST_TOKEN: Final = 12_000
MOST_SUBJECT: Final = 255
"""Longest subject that a provider gives (OpenID Connect Core 2)."""
MOST_NAME: Final = 64


class Fetch(Protocol):
    """Reads a document from the provider."""

    async def __call__(self, url: str) -> Mapping[str, Any]:
        """Read a JSON object.

        :raises httpx.HTTPError: it cannot be had.
        :raises ValueError: it is none.
        """


async def fetch_json(url: str) -> Mapping[str, Any]:
    """Read a JSON object over HTTP, without following redirections."""
    async with httpx.AsyncClient(timeout=TIMEOUT_S) as client, client.stream("GET", url) as answer:
        answer.raise_for_status()
        content = b""
        async for chunk in answer.aiter_bytes():
            content += chunk
            if len(content) > MOST_BYTES:
                raise ValueError(f"it is over {MOST_BYTES} bytes")
    document = httpx.Response(200, content=content).json()
    if not isinstance(document, dict):
        raise ValueError("it is no JSON object")  # noqa: TRY004  # a fault of the document
    return document


class OidcVerifier:
    """Checks signature, algorithm, issuer, audience and times of tokens."""

    def __init__(
        self, settings: Oidc, fetch: Fetch = fetch_json, clock: Callable[[], float] = time.time
    ) -> None:
        self._settings = settings
        self._fetch = fetch
        self._clock = clock
        self._keys: dict[str | None, jwt.PyJWK] = {}
        self._known: dict[bytes, Grant] = {}
        self._wanted = asyncio.Event()

    async def run(self) -> None:
        """Keep the provider's keys fresh until it is cancelled."""
        while True:
            self._wanted.clear()
            fetched = await self._fetched()
            await asyncio.sleep(RETRY_S)
            if fetched:
                await _first(self._wanted, FETCH_S - RETRY_S)

    def verify(self, token: str) -> Grant | None:
        """Find the holder of a token; None if it is not good, or its key is not known (yet).

        :raises NotPermitted: it is good, and gives no role here.
        """
        if len(token) > MOST_TOKEN:
            return None
        digest = sha256(token.encode("utf-8", "surrogateescape")).digest()
        grant = self._known.get(digest)
        if grant is None:
            grant = self._read(token)
            if grant is None:
                return None
            if len(self._known) >= MOST_KEPT:
                self._known.clear()
            self._known[digest] = grant
        return grant if grant.expires is not None and self._clock() < grant.expires else None

    def _read(self, token: str) -> Grant | None:
        settings = self._settings
        try:
            kid = jwt.get_unverified_header(token).get("kid")
            key = self._keys.get(kid)
            if key is None:
                self._wanted.set()
                return None
            claims = jwt.decode(
                token,
                key,
                algorithms=list(settings.algorithms),
                audience=settings.audience,
                issuer=settings.issuer,
                leeway=LEEWAY_S,
                options={"require": ["exp", "iat", "iss", "aud", "sub"]},
            )
        except jwt.PyJWTError as error:
            log.info("a token was refused: %s", error)
            return None
        return Grant(self._principal(claims), expires=float(claims["exp"]) + LEEWAY_S)

    def _principal(self, claims: Mapping[str, Any]) -> Principal:
        settings = self._settings
        subject, name = str(claims["sub"]), str(claims.get(settings.name_claim) or claims["sub"])
        given = _words(_claim(claims, settings.role_claim))
        roles = [role for word, role in settings.roles.items() if word in given]
        if not roles:
            raise NotPermitted(
                f"The token of {name[:64]!a} has no role here; nothing was sent.",
                f"Its claim {settings.role_claim} must have one of: {', '.join(settings.roles)}.",
            )
        scope = frozenset(_words(_claim(claims, settings.scope_claim))) if settings.scope_claim else None
        return Principal(_written(subject, name), max(roles, key=list(Role).index), scope, f"oidc {subject}")

    async def _fetched(self) -> bool:
        issuer = self._settings.issuer
        try:
            about = await self._fetch(f"{issuer.rstrip('/')}/.well-known/openid-configuration")
            if about.get("issuer") != issuer:
                raise ValueError(f"it calls itself {about.get('issuer')!a}")  # noqa: TRY301
            place = str(about["jwks_uri"])
            if place.partition(":")[0] != issuer.partition(":")[0]:
                raise ValueError(f"its keys are at {place!a}")  # noqa: TRY301
            keys = jwt.PyJWKSet.from_dict(dict(await self._fetch(place))).keys
        except (httpx.HTTPError, httpx.InvalidURL, ValueError, KeyError, jwt.PyJWTError) as error:
            log.warning("the keys of %s cannot be fetched: %s", issuer, error)
            return False
        self._keys = {key.key_id: key for key in keys}
        self._known.clear()
        return True


def _written(subject: str, name: str) -> str:
    """Write a person's identity so that no key has that name: the subject, and the name where it differs.

    The subject comes first: people can choose a name, and change it.
    """
    of = f"oidc:{_in_print(subject, MOST_SUBJECT).replace(' ', '?')}"
    return of if name == subject else f"{of} ({_in_print(name, MOST_NAME)})"


def _in_print(text: str, most: int) -> str:
    return "".join(letter if letter.isprintable() else "?" for letter in text[:most])


async def _first(event: asyncio.Event, seconds: float) -> None:
    try:
        async with asyncio.timeout(seconds):
            await event.wait()
    except TimeoutError:
        return


def _claim(claims: Mapping[str, Any], path: str) -> object:
    """Find a claim, or one inside: `realm_access.roles`."""
    found: object = claims
    for name in path.split("."):
        found = found.get(name) if isinstance(found, Mapping) else None
    return found


def _words(value: object) -> list[str]:
    """Read a list of words, or words with blanks between them."""
    if isinstance(value, str):
        return value.split()
    return [word for word in value if isinstance(word, str)] if isinstance(value, list) else []
