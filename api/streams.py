"""Streams: events, and the record of every byte of a line, over WebSockets and as server-sent events."""

import asyncio
import re
from collections.abc import AsyncIterator, Awaitable, Callable, Coroutine, Mapping, Sequence
from math import nan
from typing import Any, Final

from starlette.datastructures import QueryParams
from starlette.requests import Request
from starlette.responses import Response, StreamingResponse
from starlette.websockets import WebSocket, WebSocketDisconnect

from api.common.calling import require_known
from api.common.requests import plant_of
from api.common.routes import SocketRoute
from api.front.websocket_protocol import EVENTS, SINGLY, TOGETHER
from gateway.door import traces
from gateway.door.calls import aside
from gateway.door.events import (
    FASTEST_HZ,
    SLOWEST_HZ,
    Event,
    SlowConsumer,
    Subscription,
    addresses_of,
    types_of,
)
from gateway.door.problems import GatewayError, InvalidRequest
from gateway.door.table import Right
from gateway.door.traces import MAX_TRACE_ENTRIES

LAST_EVENT_ID: Final = "last-event-id"
CLOSE_GOING_AWAY: Final = 1001
CLOSE_SLOW_CONSUMER: Final = 4008
CLOSE_INVALID: Final = 4400
MAX_REASON_BYTES: Final = 123
"""The reason of a close is no longer (RFC 6455, 5.5)."""
_FLAGS: Final = {"true": True, "1": True, "false": False, "0": False}

SUBPROTOCOLS = (TOGETHER, SINGLY)
"""The first that a client offers is spoken; to one that offers none of them events are sent singly."""
KEEP_ALIVE_S = 15.0
"""A silent stream of server-sent events carries a comment this often, so that dead clients are noticed."""


async def stream_events(
    request: Request,
    after: str | None,
    bodies: str | None,
    types: str | None,
    sample: float | None,
    snapshot: bool,
) -> Response:
    """Send events as they happen (text/event-stream); a browser resumes with Last-Event-ID."""
    plant = plant_of(request)
    wanted = addresses_of(plant, bodies), types_of(types)
    begin = request.headers.get(LAST_EVENT_ID) or after
    return _sent(_server_sent(plant.events.subscribe(begin, *wanted, sample, snapshot=snapshot)))


def _sent(stream: AsyncIterator[bytes]) -> Response:
    headers = {"Cache-Control": "no-cache", "X-Accel-Buffering": "no"}
    return StreamingResponse(stream, media_type="text/event-stream", headers=headers)


async def _server_sent(events: Subscription) -> AsyncIterator[bytes]:
    yield f": events after {events.cursor}\n\n".encode()
    with events.watching():
        while True:
            try:
                async with asyncio.timeout(KEEP_ALIVE_S):
                    batch = await events.next_batch()
            except TimeoutError:
                yield b": still here\n\n"
                continue
            except SlowConsumer:
                return
            if batch is None:
                return
            yield batch.written(_frames)


def _frames(events: Sequence[Event]) -> bytes:
    return "".join(
        f"id: {event.cursor}\nevent: {event.type}\ndata: {event.json}\n\n" for event in events
    ).encode()


async def follow_events(websocket: WebSocket) -> None:
    """Send events as they happen, in a text frame each or in one; what the client sends is not read."""
    plant = plant_of(websocket)
    query = websocket.query_params
    offered = websocket.scope.get("subprotocols", ())
    await websocket.accept(next((protocol for protocol in SUBPROTOCOLS if protocol in offered), None))
    try:
        require_known(websocket, ("after", "bodies", "types", "sample", "snapshot"))
        wanted = addresses_of(plant, query.get("bodies")), types_of(query.get("types"))
        sample, snapshot = _rate(query.get("sample")), _flag(query, "snapshot")
        events = plant.events.subscribe(query.get("after"), *wanted, sample, snapshot=snapshot)
    except InvalidRequest as error:
        await _refuse(websocket, error)
        return
    await _tell(websocket, _send(websocket, events))


async def _send(websocket: WebSocket, events: Subscription) -> None:
    try:
        await events.deliver(websocket.scope["extensions"][EVENTS]["outlet"])
        await websocket.close(CLOSE_GOING_AWAY, "the gateway is shutting down")
    except SlowConsumer as slow:
        await websocket.close(CLOSE_SLOW_CONSUMER, f"slow consumer; go on after {slow.cursor}")


def _rate(text: str | None) -> float | None:
    """Read how often live values are wanted.

    :raises InvalidRequest: it is no number, or too large or too small.
    """
    if text is None:
        return None
    try:
        rate = float(text)
    except ValueError:
        rate = nan
    if not SLOWEST_HZ <= rate <= FASTEST_HZ:
        raise InvalidRequest(
            f"sample: {text!r} is no number from {SLOWEST_HZ:g} to {FASTEST_HZ:g}.",
            "Give how many values a second are wanted.",
        )
    return rate


async def follow_trace(
    request: Request, line_id: str, bodies: str | None, request_id: str | None, polls: bool, last: int
) -> Response:
    """Send the line's records as they come (text/event-stream), after the `last` that there are.

    `gap` tells how many were missed.
    """
    plant = plant_of(request)
    passing = traces.filter_of(plant, line_id, bodies, request_id, polls=polls)
    after = _whole(request.headers, LAST_EVENT_ID)
    return _sent(_trace_sent(traces.follow(plant, line_id, passing, after, last)))


async def _trace_sent(news: AsyncIterator[traces.News | None]) -> AsyncIterator[bytes]:
    loop = asyncio.get_running_loop()
    told_at = loop.time()
    yield b": the trace from now on\n\n"
    async for records in news:
        if records is not None:
            told_at = loop.time()
            yield await aside(_trace_frames, records)
        elif loop.time() - told_at >= KEEP_ALIVE_S:
            told_at = loop.time()
            yield b": still here\n\n"


def _trace_frames(news: traces.News) -> bytes:
    gap = f'event: gap\ndata: {{"missed":{news.missed}}}\n\n' if news.missed else ""
    data = "".join(f"event: trace\ndata: {entry.model_dump_json()}\n\n" for entry in news.entries)
    return f"{gap}{data}id: {news.number}\n\n".encode()


async def follow_trace_by_socket(websocket: WebSocket) -> None:
    """Send the line's records as they come, hundreds in one text frame, with how many were missed."""
    plant, query, line_id = plant_of(websocket), websocket.query_params, websocket.path_params["line_id"]
    await websocket.accept()
    try:
        require_known(websocket, ("bodies", "request_id", "polls", "last", "after"))
        passing = traces.filter_of(
            plant,
            line_id,
            query.get("bodies"),
            query.get("request_id"),
            polls=_flag(query, "polls", left_out="true"),
        )
        after, last = _whole(query, "after"), _whole(query, "last") or 0
        news = traces.follow(plant, line_id, passing, after, min(last, MAX_TRACE_ENTRIES))
    except GatewayError as error:
        await _refuse(websocket, error)
        return
    await _tell(websocket, _send_trace(websocket, news))


async def _send_trace(websocket: WebSocket, news: AsyncIterator[traces.News | None]) -> None:
    async for values in news:
        if values is not None:
            await websocket.send_text(await aside(_message, values))
    await websocket.close(CLOSE_GOING_AWAY, "the gateway is shutting down")


def _message(news: traces.News) -> str:
    return f'{{"number":{news.number},"missed":{news.missed},"entries":[{traces.written(news.entries)}]}}'


def _flag(query: QueryParams, name: str, left_out: str = "false") -> bool:
    """Read true or false.

    :raises InvalidRequest: it is neither.
    """
    text = query.get(name, left_out)
    if text not in _FLAGS:
        raise InvalidRequest(f"{name}: {text!r} is neither true nor false.", "Give one, or leave it out.")
    return _FLAGS[text]


def _whole(query: Mapping[str, str], name: str) -> int | None:
    """Read a whole number from 0.

    :raises InvalidRequest: it is none.
    """
    text = query.get(name)
    if text is None:
        return None
    if not re.fullmatch("[0-9]{1,18}", text):
        raise InvalidRequest(f"{name}: {text!r} is no whole number from 0.", "Give one, or leave it out.")
    return int(text)


async def _refuse(websocket: WebSocket, error: GatewayError) -> None:
    """Close, because what was asked for is not there or not understood."""
    await websocket.close(CLOSE_INVALID, error.detail.encode()[:MAX_REASON_BYTES].decode(errors="ignore"))


async def _tell(websocket: WebSocket, telling: Coroutine[Any, Any, None]) -> None:
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


ANSWERS: Final[Mapping[str, Callable[..., Awaitable[Response]]]] = {
    "streamEvents": stream_events,
    "followTrace": follow_trace,
}
"""The functions that answer, by the operations' names."""
SOCKETS: Final = (
    SocketRoute("/events", follow_events, right=Right.VIEW),
    SocketRoute("/lines/{line_id}/trace/stream", follow_trace_by_socket, right=Right.VIEW),
)
