"""The way to the gateway through a proxy: whose word counts for clients, and the path at which it is."""

from functools import lru_cache
from ipaddress import ip_address, ip_network
from urllib.parse import quote

from starlette.types import ASGIApp, Message, Receive, Scope, Send
from uvicorn.middleware.proxy_headers import ProxyHeadersMiddleware

from api.common.problems import plain_problem, response_to
from api.common.request_ids import RequestIds
from gateway.door.opening import Server


class Proxies:
    """Takes X-Forwarded-For and -Proto from trusted proxies, and lets no client past them in plain text."""

    def __init__(self, app: ASGIApp, server: Server) -> None:
        self._app = app
        self._root_path = server.root_path.encode()
        self._networks = [ip_network(network) for network in server.trusted_proxies]
        self._only_proxies = not (server.is_local or server.tls_certificate)
        self._forwarded = ProxyHeadersMiddleware(app, list(server.trusted_proxies))  # type: ignore[arg-type]
        self._refused = RequestIds(_refuse)
        self._is_trusted = lru_cache(1024)(self._find_trusted)

    @staticmethod
    def concern(server: Server) -> bool:
        """Tell if there may be any, or a path of theirs."""
        return bool(server.trusted_proxies or server.root_path)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on as its client has sent it."""
        peer = scope["client"][0] if scope.get("client") else ""
        if self._is_trusted(peer):
            await self._forwarded(scope, receive, self._answering(send))  # type: ignore[arg-type]
        elif self._only_proxies and not _is_here(peer):
            await self._refused(scope, receive, send)
        else:
            await self._app(scope, receive, self._answering(send))

    def _answering(self, send: Send) -> Send:
        """Put the proxy's path before that of a Location."""
        if not self._root_path:
            return send

        async def answer(message: Message) -> None:
            if message["type"] == "http.response.start":
                message["headers"] = [
                    (name, self._root_path + value if name == b"location" and value[:1] == b"/" else value)
                    for name, value in message["headers"]
                ]
            await send(message)

        return answer

    def _find_trusted(self, peer: str) -> bool:
        try:
            address = ip_address(peer)
        except ValueError:
            return False
        return any(address in network for network in self._networks)


def _is_here(peer: str) -> bool:
    try:
        return ip_address(peer).is_loopback
    except ValueError:
        return False


async def _refuse(scope: Scope, receive: Receive, send: Send) -> None:
    detail = "The gateway is reached by way of its proxy only, which keeps TLS for it. Nothing was sent."
    problem = plain_problem(403, detail, quote(scope["path"]))
    problem.remedy = "Use the proxy's address."
    await response_to(problem)(scope, receive, send)
