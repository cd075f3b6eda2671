"""The networks, browsers and host names that may talk to the gateway, with any key."""

from collections.abc import Iterable
from functools import lru_cache
from ipaddress import ip_address, ip_network
from typing import Final, NamedTuple
from urllib.parse import quote

from starlette.responses import Response
from starlette.types import Scope

from api.common.problems import plain_problem, response_to
from gateway.door.problems import TYPE_PREFIX

LOOPBACK: Final = frozenset({"127.0.0.1", "localhost", "[::1]"})


class Reason(NamedTuple):
    """Why a request is refused, and what to do about it."""

    detail: str
    remedy: str


_HOST: Final = Reason(
    "The Host header is not a name of this gateway.",
    "Use one of its names, or add this one to allowed_hosts in the configuration.",
)
_NETWORK: Final = Reason(
    "Clients of this network may not use the gateway.",
    "Ask from a network in server.client_networks of the configuration, or add this one to it.",
)
_ORIGIN: Final = Reason(
    "Pages of this Origin may not use the gateway.",
    "Use the gateway's own pages, or add this Origin to allowed_origins in the configuration.",
)
_SITE: Final = Reason("Pages of other sites may not use the gateway.", _ORIGIN.remedy)


class SameSite:
    """Refuses requests of foreign networks and of foreign pages in a browser, WebSocket handshakes included.

    The Host header must name this machine, or a page could reach it by a name of its own (DNS rebinding). An
    Origin, where there is one, must be that of the gateway itself or one of the configuration.
    """

    def __init__(
        self,
        allowed_hosts: Iterable[str],
        allowed_origins: Iterable[str],
        client_networks: Iterable[str] = (),
    ) -> None:
        self._networks = [ip_network(network) for network in client_networks]
        self._comes_from_there = lru_cache(1024)(self._find_network)
        self._hosts = LOOPBACK | {host.lower() for host in allowed_hosts}
        self._origins = {origin.lower() for origin in allowed_origins}

    def reason_against(self, scope: Scope) -> Reason | None:
        """Say why a request or a WebSocket is refused; None where it is not."""
        if self._networks and not self._comes_from_there((scope.get("client") or ("",))[0]):
            return _NETWORK
        host = origin = site = ""
        for name, value in scope["headers"]:
            if name == b"host":
                host = value.decode("latin-1").lower()
            elif name == b"origin":
                origin = value.decode("latin-1").lower()
            elif name == b"sec-fetch-site":
                site = value.decode("latin-1").lower()
        if _without_port(host) not in self._hosts:
            return _HOST
        if origin and not self._is_allowed(origin, host):
            return _ORIGIN
        if site == "cross-site" and not origin:
            return _SITE
        return None

    def _find_network(self, client: str) -> bool:
        try:
            address = ip_address(client)
        except ValueError:
            return False
        address = getattr(address, "ipv4_mapped", None) or address
        return address.is_loopback or any(address in network for network in self._networks)

    def _is_allowed(self, origin: str, host: str) -> bool:
        return origin in self._origins or origin in (f"http://{host}", f"https://{host}")


def _without_port(host: str) -> str:
    name, colon, port = host.rpartition(":")
    return name if colon and port.isdecimal() else host


def refusal(scope: Scope, reason: Reason) -> Response:
    """Answer with a problem; a WebSocket that is not open yet, too."""
    problem = plain_problem(403, f"{reason.detail} Nothing was sent.", quote(scope["path"]))
    problem.type, problem.title = f"{TYPE_PREFIX}not-from-there", "Not from there"
    problem.remedy = reason.remedy
    return response_to(problem)
