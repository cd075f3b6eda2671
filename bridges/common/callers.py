"""Callers of the gateway, each with a key of its own: rights, scopes and leases are the gateway's."""

import ssl
import sys
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from functools import partial
from importlib.util import find_spec
from typing import Any, Final

import httpx
from motion_gateway_client import Answer, AsyncGateway, NoAnswer
from motion_gateway_client.async_gateway import LIMITS, STOP_TRIES, TIMEOUT_S

from bridges.common.settings import CallerTable, GatewayTable, key_in

UNAUTHORIZED: Final = 401
if find_spec("sniffio") is None:  # httpcore looks for it in all folders at each request: a third of its time
    sys.modules["sniffio"] = None  # type: ignore[assignment]

ReadKey = Callable[[], str | None]


class Doors:
    """Opens connections to the gateway of the file."""

    def __init__(self, gateway: GatewayTable) -> None:
        self._url = gateway.url
        # Without a file those that the system, or SSL_CERT_FILE, names. To make it takes 20 ms: once for all.
        self._context = ssl.create_default_context(cafile=gateway.ca_file)

    def open(self, key: str | None, language: str | None = None) -> AsyncGateway:
        """Make a client that asks with a key, and is answered in a language; nothing is sent."""
        http = httpx.AsyncClient(
            base_url=self._url,
            headers={"Accept-Language": language} if language else None,
            timeout=TIMEOUT_S,
            limits=LIMITS,
            verify=self._context,
            trust_env=False,
        )
        gateway = AsyncGateway(self._url, key=key, http=http)
        if key is None:  # nobody acts with a key that happens to stand in the environment
            http.headers.pop("Authorization", None)
        return gateway


class Caller:
    """One who asks. Its key is read again where the gateway does not know it: keys are rotated."""

    def __init__(self, doors: Doors, read_key: ReadKey, language: str | None = None) -> None:
        self._doors, self._read_key, self._language = doors, read_key, language
        self._key = read_key()
        self._gateway = doors.open(self._key, language)

    async def ask(
        self,
        method: str,
        path: str,
        *,
        query: dict[str, Any] | None = None,
        body: Any = None,
        idempotency_key: str | None = None,
        lease_tokens: Iterable[str] = (),
    ) -> Answer:
        """Send a request once, and give the answer; a refusal is one, too.

        :raises NoAnswer: there is none; `moved` is `no` only where nothing can have been sent.
        """
        asking = partial(
            AsyncGateway.ask,
            method=method,
            path=path,
            query=query,
            body=body,
            idempotency_key=idempotency_key,
            lease_tokens=tuple(lease_tokens),
        )
        answer = await asking(self._gateway)
        if answer.status == UNAUTHORIZED and await self._has_new_key():
            answer = await asking(self._gateway)  # nothing was done: it was not let in
        return answer

    async def stop(self, path: str, body: Any = None) -> Answer:
        """Ask for a stop, again where the connection breaks: one that comes twice does no harm.

        :raises NoAnswer: none of the tries has an answer.
        """
        for _ in range(STOP_TRIES - 1):
            with suppress(NoAnswer):
                return await self.ask("POST", path, body=body)
        return await self.ask("POST", path, body=body)

    async def _has_new_key(self) -> bool:
        try:
            key = self._read_key()
        except ValueError:
            return False
        if key == self._key:
            return False
        before, self._key, self._gateway = self._gateway, key, self._doors.open(key, self._language)
        await before.aclose()
        return True

    async def aclose(self) -> None:
        """Close its connections; what moves goes on."""
        await self._gateway.aclose()


class Callers:
    """The callers of the file by their names, and others that bring their own keys."""

    def __init__(self, doors: Doors, named: Mapping[str, CallerTable]) -> None:
        self._doors = doors
        self._callers = {
            name: Caller(doors, partial(key_in, table.key_file)) for name, table in named.items()
        }

    def get(self, name: str) -> Caller | None:
        """Give the caller of a name, if there is one."""
        return self._callers.get(name)

    def bringing(self, key: str, language: str | None = None) -> Caller:
        """Give a caller who has brought a key; the one who asks for it closes it."""
        return Caller(self._doors, lambda: key, language)

    async def aclose(self) -> None:
        """Close all connections of those in the file."""
        for caller in self._callers.values():
            await caller.aclose()
