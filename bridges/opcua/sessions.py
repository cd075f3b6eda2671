"""Sessions and their guests: each has its own key at the gateway, a language, and addresses it may see."""

import logging
from collections.abc import Iterable
from contextvars import ContextVar
from dataclasses import dataclass, field
from typing import Any, Final

from motion_gateway_client import Answer, GatewayError

from bridges.common.callers import UNAUTHORIZED, Caller, Callers

log = logging.getLogger(__name__)

LANGUAGES: Final = ("en", "ja")
LONGEST_KEY: Final = 200


class SignInRefused(Exception):
    """The gateway does not know the key, or it is another's."""


class GatewayAway(Exception):
    """The gateway does not answer, so a key cannot be checked."""


@dataclass(eq=False)
class Guest:
    """One who is signed in, for as long as its session lasts."""

    name: str
    """Name of its key, as the gateway has it."""
    role: str
    caller: Caller
    language: str
    visible: frozenset[str] | None
    """Addresses that its key may see; None: all."""
    leases: dict[str, tuple[str, str]] = field(default_factory=dict)
    """Leases that this session has taken, by their addresses: ids and tokens.

    One that has run out stays until it is given back: what was meant to be done with it is refused.
    """

    def sees(self, address: str | None) -> bool:
        """Tell if its key may see the address of a node; nodes without one are seen by all.

        `line1/` is the way to what is on a line or a robot: who may see anything there sees it.
        """
        if address is None or self.visible is None or address in self.visible:
            return True
        name = address.removesuffix("/")
        return name != address and any(visible.partition(".")[0] == name for visible in self.visible)

    async def ask(
        self,
        method: str,
        path: str,
        body: Any = None,
        key: str | None = None,
    ) -> Answer:
        """Ask the gateway in its name, with the leases of its session.

        :raises NoAnswer: there is none.
        """
        tokens = [token for _, token in self.leases.values()]
        return await self.caller.ask(method, path, body=body, idempotency_key=key, lease_tokens=tokens)

    async def is_known(self) -> bool:
        """Tell if its key is still good; unknown counts as good, for the gateway judges each call anew."""
        try:
            answer = await self.caller.ask("GET", "/system/identity")
        except GatewayError:
            return True
        return answer.status != UNAUTHORIZED


GUEST: ContextVar[Guest | None] = ContextVar("guest", default=None)
"""The one in whose name a service is at work; None: the bridge itself."""


def language_of(locales: Iterable[str | None]) -> str:
    """Give the first language of a session's list that there are texts in."""
    for locale in locales:
        language = (locale or "").partition("-")[0].lower()
        if language in LANGUAGES:
            return language
    return LANGUAGES[0]


async def sign_in(callers: Callers, name: str | None, key: str | None, locales: Iterable[str]) -> Guest:
    """Ask the gateway whose key it is.

    :raises SignInRefused: it is not good, or not that of this name.
    :raises GatewayAway: there is no answer.
    """
    if not key or len(key) > LONGEST_KEY or not key.isascii() or not key.isprintable():
        raise SignInRefused("no key has such characters")
    language = language_of(locales)
    caller = callers.bringing(key, language)
    try:
        identity = await _identity(caller, name)
        visible = None if identity["scope"] is None else await _visible(caller)
    except GatewayError as error:
        await caller.aclose()
        raise GatewayAway(str(error)) from None
    except SignInRefused:
        await caller.aclose()
        raise
    return Guest(identity["name"], identity["role"], caller, language, visible)


async def _identity(caller: Caller, name: str | None) -> Any:
    answer = await caller.ask("GET", "/system/identity")
    if answer.status == UNAUTHORIZED:
        raise SignInRefused("the gateway does not know the key")
    if not answer.is_success:
        raise GatewayAway(answer.content.get("detail", answer.status))
    if answer.content["name"] != name:
        raise SignInRefused(f"the key is that of another, and not of {name!r}")
    return answer.content


async def _visible(caller: Caller) -> frozenset[str]:
    """Ask what a scope covers: the gateway lists it."""
    found: set[str] = set()
    for kind, id_ in (("lines", "line_id"), ("bodies", "body_id"), ("robots", "robot_id")):
        answer = await caller.ask("GET", f"/{kind}")
        if not answer.is_success:
            raise SignInRefused(f"its key may not list /{kind}")
        found.update(item[id_] for item in answer.content[kind])
    return frozenset(found)
