"""WebSockets that tell something until the client leaves; what it says is not read."""

import asyncio
from collections.abc import Coroutine
from typing import Any, Final

from starlette.websockets import WebSocket, WebSocketDisconnect

from gateway.door.problems import GatewayError

CLOSE_GOING_AWAY: Final = 1001
CLOSE_SLOW_CONSUMER: Final = 4008
CLOSE_INVALID: Final = 4400
MAX_REASON_BYTES: Final = 123
"""The reason of a close is no longer (RFC 6455, 5.5)."""


async def refuse(websocket: WebSocket, error: GatewayError) -> None:
    """Close, because what was asked for is not there or not understood."""
    await websocket.close(CLOSE_INVALID, error.detail.encode()[:MAX_REASON_BYTES].decode(errors="ignore"))


async def tell(websocket: WebSocket, telling: Coroutine[Any, Any, None]) -> None:
    """Tell beside a task that listens, or a client that has gone would be noticed only at the next news."""
    listener = asyncio.create_task(_listen(websocket), name="socket listener")
    teller = asyncio.create_task(_until_it_leaves(telling), name="socket teller")
    try:
        await asyncio.wait((listener, teller), return_when=asyncio.FIRST_COMPLETED)
    finally:
        listener.cancel()
        teller.cancel()
        await asyncio.gather(listener, teller, return_exceptions=True)


async def _listen(websocket: WebSocket) -> None:
    message = await websocket.receive()
    while message["type"] != "websocket.disconnect":
        message = await websocket.receive()


async def _until_it_leaves(telling: Coroutine[Any, Any, None]) -> None:
    try:
        await telling
    except WebSocketDisconnect:
        return
