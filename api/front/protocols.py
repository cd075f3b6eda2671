"""The protocols that a server speaks with clients, with its limits."""

from api.front.connections import ConnectionLimit
from api.front.http_protocol import HttpProtocol, Limits
from api.front.turnstile import Turnstile
from api.front.websocket_protocol import WebSocketProtocol

DEFAULT = Limits()


def protocols(
    max_connections: int, bounds: Limits = DEFAULT
) -> tuple[type[HttpProtocol], type[WebSocketProtocol]]:
    """Make the protocols of one server, whose connections share one limit."""

    class Http(HttpProtocol):
        limits = bounds
        connection_limit = ConnectionLimit(max_connections)
        turnstile = Turnstile()

    class WebSocket(WebSocketProtocol):
        limits = bounds

    return Http, WebSocket
