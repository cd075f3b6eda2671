"""Events over WebSocket, as a list and as server-sent events: the same events with the same cursor."""

import asyncio
from collections.abc import AsyncIterator, Collection, Sequence
from functools import cache
from math import nan
from typing import Annotated

from fastapi import Header, Query, Request, Response, WebSocket
from starlette.responses import StreamingResponse

from api.common.query_params import require_known
from api.common.requests import new_router, plant_of
from api.common.sockets import CLOSE_GOING_AWAY, CLOSE_SLOW_CONSUMER, refuse, tell
from api.event_models import EventList
from api.front.websocket_protocol import EVENTS, SINGLY, TOGETHER
from gateway.access.principal import current
from gateway.core.addresses import canonical_address, there_are
from gateway.core.errors import InvalidRequest
from gateway.core.events import FASTEST_HZ, SLOWEST_HZ, Event, SlowConsumer, Subscription
from gateway.core.rights import Right
from gateway.event_types import EVENT_TYPES
from gateway.plant import Plant
from protocols.wording import shown, unknown

router = new_router("events")

SUBPROTOCOLS = (TOGETHER, SINGLY)
"""The first that a client offers is spoken; to one that offers none of them events are sent singly."""
KEEP_ALIVE_S = 15.0
"""A silent stream of server-sent events carries a comment this often, so that dead clients are noticed."""

After = Annotated[str | None, Query(description="Only events after this cursor.")]
Bodies = Annotated[
    str | None,
    Query(
        description="Only events of these bodies, groups, SCARA robots and robots: addresses joined by "
        "commas, such as 3F,arm.02,wafer,r1,r2/units/1. A robot's address means its units too."
    ),
]
Types = Annotated[
    str | None,
    Query(description="Only events of these types, joined by commas, such as body.move.*,line.down."),
]


Sample = Annotated[
    float | None,
    Query(
        ge=SLOWEST_HZ,
        le=FASTEST_HZ,
        description="Live values too (body.position, robot.position, io): each so many times a second at "
        "most. They are no events: a new value takes the place of one that was not sent yet.",
    ),
]


@router.get("/events", Right.VIEW, response_model=EventList)
async def list_events(
    request: Request,
    after: After = None,
    bodies: Bodies = None,
    types: Types = None,
    limit: Annotated[int, Query(ge=1, le=1000)] = 100,
    sample: Sample = None,
) -> Response:
    """List what has happened after a cursor, or from the oldest event that is kept.

    Ask again after the answer's `cursor` to go on. The event `stream.gap` stands for events no longer kept.
    With `sample` the values that are watched follow the events, as read within a second.
    """
    plant = plant_of(request)
    wanted = _addresses(plant, bodies), _types(types)
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
    wanted = _addresses(plant, bodies), _types(types)
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
        wanted = _addresses(plant, query.get("bodies")), _types(query.get("types"))
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


def _addresses(plant: Plant, text: str | None) -> list[str] | None:
    """Read addresses of what there is.

    :raises InvalidRequest: one of them is no address, or of nothing in the configuration.
    """
    wanted = _split(text)
    known = plant.addresses()
    for address in map(canonical_address, wanted or ()):
        if address not in known:
            # Who may see a part only is not told the names of the rest.
            listed = f"; {there_are(sorted(known))}" if current().scope is None else ""
            raise InvalidRequest(
                f"bodies: there is no {address}{listed}.",
                "GET /bodies, /groups, /scaras, /robots list what there is.",
            )
    return wanted


def _types(text: str | None) -> list[str] | None:
    """Read types of events that there are.

    :raises InvalidRequest: one of them is none, so nothing would ever come.
    """
    wanted = _split(text)
    kinds, known = _known_types()
    for given in wanted or ():
        if given not in known:
            raise InvalidRequest(
                f"types: there is no {shown(given)} ({unknown(given, known, kinds)}).",
                "Give types such as line.down or body.move.*; docs/events.md has all of them.",
            )
    return wanted


@cache
def _known_types() -> tuple[Collection[str], Collection[str]]:
    """The kinds of types, such as `body.*`, and all that types can be asked for by."""
    names = [name.split(".") for name in EVENT_TYPES]
    beginnings = [(*words[:most], "*") for words in names for most in range(1, len(words))]
    known = dict.fromkeys(map(".".join, (*beginnings, *names)))
    return sorted(it for it in known if it.count(".") < 2 and it.endswith("*")), known


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


def _split(text: str | None) -> list[str] | None:
    return [part.strip() for part in text.split(",")] if text else None
