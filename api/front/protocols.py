"""The protocols that a server speaks with clients, with its limits."""

from api.front.connections import ConnectionLimit, ConnectionLimits
from api.front.http_protocol import HttpProtocol
from api.front.intake import Intake
from api.front.turnstile import Turnstile
from api.front.websocket_protocol import WebSocketProtocol

DEFAULT = ConnectionLimits()


def protocols(max_connections: int, bounds: ConnectionLimits = DEFAULT) -> type[HttpProtocol]:
    """Make the protocol of one server, whose connections share one limit; it hands WebSockets over."""
    entering = Turnstile()
    shared = Intake(bounds, entering)

    class WebSocket(WebSocketProtocol):
        limits = bounds
        intake = shared

    class Http(HttpProtocol):
        limits = bounds
        connection_limit = ConnectionLimit(max_connections)
        turnstile = entering
        intake = shared
        websocket = WebSocket

    return Http
