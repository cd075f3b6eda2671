"""Which browsers and host names may talk to the gateway: whatever key they send."""

from collections.abc import Iterable
from typing import Final
from urllib.parse import quote

from starlette.responses import Response
from starlette.types import Scope

from api.common.problems import TYPE_PREFIX, plain_problem, response_to

LOOPBACK: Final = frozenset({"127.0.0.1", "localhost", "[::1]"})


class SameSite:
    """Refuses requests that a foreign web page makes a browser send, WebSocket handshakes included.

    The Host header must name this machine, or a page could reach it by a name of its own (DNS rebinding). An
    Origin, where there is one, must be that of the gateway itself or one of the configuration.
    """

    def __init__(self, allowed_hosts: Iterable[str], allowed_origins: Iterable[str]) -> None:
        self._hosts = LOOPBACK | {host.lower() for host in allowed_hosts}
        self._origins = {origin.lower() for origin in allowed_origins}

    def reason_against(self, scope: Scope) -> str | None:
        """Say why a request or a WebSocket is refused; None where it is not."""
        host = origin = site = ""
        for name, value in scope["headers"]:
            if name == b"host":
                host = value.decode("latin-1").lower()
            elif name == b"origin":
                origin = value.decode("latin-1").lower()
            elif name == b"sec-fetch-site":
                site = value.decode("latin-1").lower()
        if _without_port(host) not in self._hosts:
            return "The Host header is not a name of this gateway; see allowed_hosts in the configuration."
        if origin and not self._is_allowed(origin, host):
            return "Pages of this Origin may not use the gateway; see allowed_origins in the configuration."
        if site == "cross-site" and not origin:
            return "Pages of other sites may not use the gateway."
        return None

    def _is_allowed(self, origin: str, host: str) -> bool:
        return origin in self._origins or origin in (f"http://{host}", f"https://{host}")


def _without_port(host: str) -> str:
    name, colon, port = host.rpartition(":")
    return name if colon and port.isdecimal() else host


def refusal(scope: Scope, reason: str) -> Response:
    """Answer with a problem; a WebSocket that is not open yet, too."""
    problem = plain_problem(403, f"{reason} Nothing was sent.", quote(scope["path"]))
    problem.type, problem.title, problem.remedy = f"{TYPE_PREFIX}not-from-there", "Not from there", ""
    return response_to(problem)
