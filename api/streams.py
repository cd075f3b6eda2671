"""Events over WebSocket, as a list and as server-sent events: the same events with the same cursor."""

import asyncio
from collections.abc import AsyncIterator, Sequence
from math import nan
from typing import Annotated

from fastapi import Header, Request, Response, WebSocket
from starlette.responses import StreamingResponse

from api.common.query_params import require_known
from api.common.requests import new_router, plant_of
from api.common.sockets import CLOSE_GOING_AWAY, CLOSE_SLOW_CONSUMER, refuse, tell
from api.front.websocket_protocol import EVENTS, SINGLY, TOGETHER
from gateway.core.errors import InvalidRequest
from gateway.core.events import FASTEST_HZ, SLOWEST_HZ, Event, SlowConsumer, Subscription
from gateway.core.rights import Right
from gateway.door.event_models import EventList
from gateway.door.events import After, Bodies, Limit, Sample, Types, addresses_of, types_of

router = new_router("events")

SUBPROTOCOLS = (TOGETHER, SINGLY)
"""The first that a client offers is spoken; to one that offers none of them events are sent singly."""
KEEP_ALIVE_S = 15.0
"""A silent stream of server-sent events carries a comment this often, so that dead clients are noticed."""


@router.get("/events", Right.VIEW, response_model=EventList)
async def list_events(
    request: Request,
    after: After = None,
    bodies: Bodies = None,
    types: Types = None,
    limit: Limit = 100,
    sample: Sample = None,
) -> Response:
    """List what has happened after a cursor, or from the oldest event that is kept.

    Ask again after the answer's `cursor` to go on. The event `stream.gap` stands for events no longer kept.
    With `sample` the values that are watched follow the events, as read within a second.
    """
    plant = plant_of(request)
    wanted = addresses_of(plant, bodies), types_of(types)
    page = await plant.events.since(after, *wanted, limit)
    values = [] if sample is None else await plant.events.values(*wanted, sample)
    events = ",".join(event.json for event in (*page.events, *values))
    return Response(f'{{"events":[{events}],"cursor":"{page.cursor}"}}', media_type="application/json")


# A stream has no end, which the schema of a response cannot say: it stays out of the OpenAPI document.
@router.get("/events/stream", Right.VIEW, include_in_schema=False)
async def stream_events(
    request: Request,
    after: After = None,
    bodies: Bodies = None,
    types: Types = None,
    sample: Sample = None,
    last_event_id: Annotated[str | None, Header()] = None,
) -> Response:
    """Send events as they happen (text/event-stream); a browser resumes with Last-Event-ID."""
    plant = plant_of(request)
    wanted = addresses_of(plant, bodies), types_of(types)
    events = plant.events.subscribe(last_event_id or after, *wanted, sample)
    return StreamingResponse(
        _server_sent(events),
        media_type="text/event-stream",
        headers={"Cache-Control": "no-cache", "X-Accel-Buffering": "no"},
    )


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


@router.websocket("/events", Right.VIEW)
async def follow_events(websocket: WebSocket) -> None:
    """Send events as they happen, in a text frame each or in one; what the client sends is not read."""
    plant = plant_of(websocket)
    query = websocket.query_params
    offered = websocket.scope.get("subprotocols", ())
    await websocket.accept(next((it for it in SUBPROTOCOLS if it in offered), None))
    try:
        require_known(websocket, ("after", "bodies", "types", "sample"))
        wanted = addresses_of(plant, query.get("bodies")), types_of(query.get("types"))
        events = plant.events.subscribe(query.get("after"), *wanted, _rate(query.get("sample")))
    except InvalidRequest as error:
        await refuse(websocket, error)
        return
    await tell(websocket, _send(websocket, events))


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
