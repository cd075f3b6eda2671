"""WebSockets of a gateway through the plant process, in the caller's name."""

import asyncio
import logging
from typing import Final

from starlette.websockets import WebSocket, WebSocketDisconnect
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed, InvalidHandshake

log = logging.getLogger(__name__)

TRY_LATER: Final = 1013
_NEVER_SENT: Final = frozenset({1005, 1006, 1015})
"""Codes that say how a connection has ended, and are written into none."""


async def pass_on(websocket: WebSocket, opening: connect) -> None:
    """Connect to the gateway, and hand messages on in both directions until one side ends."""
    try:
        async with opening as gateway:
            await websocket.accept(gateway.subprotocol)
            await _hand_on(websocket, gateway)
            code = gateway.close_code or TRY_LATER
            await websocket.close(TRY_LATER if code in _NEVER_SENT else code, gateway.close_reason or "")
    except (OSError, TimeoutError, InvalidHandshake) as error:
        log.info("a stream of a gateway is not reached: %s", error)
        await websocket.close(TRY_LATER, "the gateway is not reached, or refuses the stream")
    except (RuntimeError, WebSocketDisconnect):  # the client has closed it itself
        return


async def _hand_on(websocket: WebSocket, gateway: ClientConnection) -> None:
    ways = [
        asyncio.create_task(way, name="stream")
        for way in (_inward(websocket, gateway), _outward(websocket, gateway))
    ]
    try:
        await asyncio.wait(ways, return_when=asyncio.FIRST_COMPLETED)
    finally:
        for task in ways:
            task.cancel()
        await asyncio.gather(*ways, return_exceptions=True)


async def _inward(websocket: WebSocket, gateway: ClientConnection) -> None:
    while (message := await websocket.receive())["type"] == "websocket.receive":
        await gateway.send(message.get("text") or message.get("bytes") or b"")


async def _outward(websocket: WebSocket, gateway: ClientConnection) -> None:
    try:
        async for message in gateway:
            await (
                websocket.send_text(message) if isinstance(message, str) else websocket.send_bytes(message)
            )
    except ConnectionClosed:
        return
