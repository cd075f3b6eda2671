"""HTTP from the plant to its gateways, always with the key of the caller: the plant has none of its own."""

import asyncio
import logging
import ssl
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Final

import httpx
from websockets.asyncio.client import connect
from websockets.typing import Subprotocol

from fleet.errors import AnswerLost, GatewayUnreached
from fleet.registry import Gateway, Registry

log = logging.getLogger(__name__)

BEAT_S: Final = 2.0
"""Seconds between health checks of each gateway: they keep a connection open for a stop."""
CONNECT_S: Final = 2.0
WITHIN_S: Final = 2.0
"""Longest wait in seconds for each gateway's part of a list of the plant."""
LONGEST_S: Final = 90.0
"""A command may wait for the end of its move."""
PASSED_ON: Final = frozenset(
    {
        *("accept", "accept-language", "authorization", "content-type", "idempotency-key", "if-match"),
        *("if-none-match", "last-event-id", "owner-epoch", "prefer", "traceparent", "x-request-id"),
    }
)
"""Headers that mean at the gateway what they mean at the plant; lease tokens are shared out."""
_KEY: Final = "mg_"


@dataclass(frozen=True)
class Caller:
    """A client of the plant, by the headers that are passed on to the gateways."""

    authorization: str = ""
    language: str = ""
    request_id: str = ""

    @property
    def id(self) -> str:
        """A hash that tells callers apart, and is no key."""
        return sha256(self.authorization.encode()).hexdigest()

    @property
    def headers(self) -> dict[str, str]:
        """Headers of a request in this caller's name, in lower case."""
        told = {
            "authorization": self.authorization,
            "accept-language": self.language,
            "x-request-id": self.request_id,
        }
        return {name: value for name, value in told.items() if value}

    def key_digest(self) -> tuple[str, str]:
        """The prefix and the hash of the key; empty where it is none."""
        token = self.authorization.removeprefix("Bearer ").strip()
        if not token.startswith(_KEY):
            return "", ""
        return token[len(_KEY) :].partition("_")[0], sha256(token.encode()).hexdigest()


class Upstream:
    """The connections to all gateways."""

    def __init__(self, registry: Registry, ca: Path | None = None) -> None:
        self._registry = registry
        self._context = ssl.create_default_context(cafile=ca)
        self._client = httpx.AsyncClient(
            verify=self._context,
            timeout=httpx.Timeout(LONGEST_S, connect=CONNECT_S, pool=CONNECT_S),
            limits=httpx.Limits(max_connections=None, max_keepalive_connections=1000, keepalive_expiry=4.0),
            follow_redirects=False,
            trust_env=False,
        )

    async def aclose(self) -> None:
        """Close all connections."""
        await self._client.aclose()

    async def keep_warm(self) -> None:
        """Ask each gateway again and again whether it lives."""
        while True:
            beats = [asyncio.ensure_future(self._beat(gateway)) for gateway in self._registry.all()]
            await asyncio.sleep(BEAT_S)
            for beat in beats:
                beat.cancel()
            await asyncio.gather(*beats, return_exceptions=True)

    async def _beat(self, gateway: Gateway) -> None:
        try:
            answer = await self._client.get(f"{gateway.url}/livez", timeout=BEAT_S)
        except httpx.HTTPError:
            return
        if answer.is_success:
            self._registry.heard(gateway.name)

    async def ask(
        self,
        gateway: Gateway,
        method: str,
        path: str,
        headers: Mapping[str, str],
        content: bytes = b"",
        within_s: float = LONGEST_S,
    ) -> httpx.Response:
        """Ask a gateway, and read its whole answer.

        :raises GatewayUnreached: nothing was sent.
        :raises AnswerLost: it may have been carried out.
        """
        response = await self.begin(gateway, method, path, headers, content, within_s)
        try:
            await response.aread()
        except httpx.HTTPError as error:
            raise _lost(gateway, error) from error
        finally:
            await response.aclose()
        return response

    async def begin(
        self,
        gateway: Gateway,
        method: str,
        path: str,
        headers: Mapping[str, str],
        content: bytes = b"",
        within_s: float | None = LONGEST_S,
    ) -> httpx.Response:
        """Ask a gateway, and leave the answer's body to the caller to read. Errors as of `ask`."""
        timeout = httpx.Timeout(within_s, connect=CONNECT_S, pool=CONNECT_S)
        request = self._client.build_request(
            method, f"{gateway.url}{path}", headers=dict(headers), content=content or None, timeout=timeout
        )
        try:
            response = await self._client.send(request, stream=True)
        except (httpx.ConnectError, httpx.ConnectTimeout, httpx.PoolTimeout) as error:
            raise GatewayUnreached(
                f"Gateway {gateway.name} is not reached at {gateway.url}: {_why(error)}. Nothing was sent.",
                "Check its network and whether it runs; its own console may still work.",
            ) from error
        except httpx.HTTPError as error:
            raise _lost(gateway, error) from error
        self._registry.heard(gateway.name)
        return response

    def open_socket(
        self, gateway: Gateway, path: str, headers: Mapping[str, str], subprotocols: Sequence[str]
    ) -> connect:
        """Make a WebSocket to a gateway; entering it as a context connects."""
        return connect(
            f"ws{gateway.url.removeprefix('http')}{path}",
            additional_headers=headers,
            subprotocols=[Subprotocol(name) for name in subprotocols],
            ssl=self._context if gateway.url.startswith("https:") else None,
            proxy=None,
            open_timeout=CONNECT_S,
            max_size=None,
        )


def _lost(gateway: Gateway, error: Exception) -> AnswerLost:
    return AnswerLost(
        f"Gateway {gateway.name} was asked, and its answer did not come: {_why(error)}. What was asked for "
        "may have been carried out.",
        "Read status and position before anything else; the same Idempotency-Key does nothing twice.",
    )


def _why(error: Exception) -> str:
    return (str(error) or type(error).__name__).rstrip(".")
