"""Lines over HTTP: their state, scans of them, and the record of every byte."""

import asyncio
import re
from collections.abc import AsyncIterator, Sequence
from typing import Annotated

from fastapi import Header, Query, Request, Response, WebSocket
from pydantic import AwareDatetime, BaseModel
from starlette.datastructures import QueryParams
from starlette.responses import StreamingResponse

from api.common.query_params import require_known
from api.common.requests import (
    new_router,
    plant_of,
)
from api.common.sockets import CLOSE_GOING_AWAY, refuse, tell
from gateway.core.aside import aside
from gateway.core.errors import GatewayError, InvalidRequest
from gateway.core.rights import Right
from gateway.door import traces
from gateway.door.names import LineId
from gateway.door.traces import AT_ONCE, MAX_TRACE_ENTRIES, Trace, TracedBodies, TracedRequest, split

KEEP_ALIVE_S = 15.0
"""A silent stream carries a comment this often, so that dead clients are noticed."""
router = new_router("lines")


@router.get("/lines/{line_id}/trace", Right.VIEW, response_model=Trace)
async def get_trace(
    request: Request,
    line_id: LineId,
    limit: Annotated[int, Query(ge=1, le=MAX_TRACE_ENTRIES, description="How many records.")] = 1000,
    last: Annotated[
        int | None,
        Query(ge=1, le=MAX_TRACE_ENTRIES, deprecated=True, description="Another word for `limit`."),
    ] = None,
    since: Annotated[AwareDatetime | None, Query(description="Only records not before this time.")] = None,
    bodies: TracedBodies = None,
    request_id: TracedRequest = None,
) -> Response:
    """Give the newest bytes of the line, a robot's too, both ways, with their times."""
    plant = plant_of(request)
    passing = traces.filter_of(plant, line_id, split(bodies), request_id)
    entries = await traces.newest(plant, line_id, passing, last or limit, since)
    # Writing thousands of records as text takes milliseconds, in which no stop may wait.
    told = [
        await aside(_records, entries[first : first + AT_ONCE]) for first in range(0, len(entries), AT_ONCE)
    ]
    content = f'{{"line_id":"{line_id}","entries":[{",".join(told)}]}}'
    return Response(content, media_type="application/json")


# A stream has no end, which the schema of a response cannot say: it stays out of the OpenAPI document.
@router.get("/lines/{line_id}/trace/stream", Right.VIEW, include_in_schema=False)
async def follow_trace(
    request: Request,
    line_id: LineId,
    bodies: TracedBodies = None,
    request_id: TracedRequest = None,
    last: Annotated[int, Query(ge=0, le=MAX_TRACE_ENTRIES)] = 0,
    last_event_id: Annotated[str | None, Header(pattern="^[0-9]{1,18}$")] = None,
) -> Response:
    """Send the line's records as they come (text/event-stream), after the `last` that there are.

    `gap` tells how many were missed.
    """
    plant = plant_of(request)
    passing = traces.filter_of(plant, line_id, split(bodies), request_id)
    after = None if last_event_id is None else int(last_event_id)
    return StreamingResponse(
        _server_sent(traces.follow(plant, line_id, passing, after, last)),
        media_type="text/event-stream",
        headers={"Cache-Control": "no-cache", "X-Accel-Buffering": "no"},
    )


async def _server_sent(news: AsyncIterator[traces.News | None]) -> AsyncIterator[bytes]:
    loop = asyncio.get_running_loop()
    told_at = loop.time()
    yield b": the trace from now on\n\n"
    async for it in news:
        if it is not None:
            told_at = loop.time()
            yield await aside(_frames, it)
        elif loop.time() - told_at >= KEEP_ALIVE_S:
            told_at = loop.time()
            yield b": still here\n\n"


def _frames(news: traces.News) -> bytes:
    gap = f'event: gap\ndata: {{"missed":{news.missed}}}\n\n' if news.missed else ""
    data = "".join(f"event: trace\ndata: {entry.model_dump_json()}\n\n" for entry in news.entries)
    return f"{gap}{data}id: {news.number}\n\n".encode()


@router.websocket("/lines/{line_id}/trace/stream", Right.VIEW)
async def follow_trace_by_socket(websocket: WebSocket) -> None:
    """Send the line's records as they come, hundreds in one text frame, with how many were missed."""
    plant, query, line_id = plant_of(websocket), websocket.query_params, websocket.path_params["line_id"]
    await websocket.accept()
    try:
        require_known(websocket, ("bodies", "request_id", "last", "after"))
        passing = traces.filter_of(plant, line_id, split(query.get("bodies")), query.get("request_id"))
        after, last = _whole(query, "after"), _whole(query, "last") or 0
        news = traces.follow(plant, line_id, passing, after, min(last, MAX_TRACE_ENTRIES))
    except GatewayError as error:
        await refuse(websocket, error)
        return
    await tell(websocket, _send(websocket, news))


async def _send(websocket: WebSocket, news: AsyncIterator[traces.News | None]) -> None:
    async for it in news:
        if it is not None:
            await websocket.send_text(await aside(_message, it))
    await websocket.close(CLOSE_GOING_AWAY, "the gateway is shutting down")


def _message(news: traces.News) -> str:
    return f'{{"number":{news.number},"missed":{news.missed},"entries":[{_records(news.entries)}]}}'


def _whole(query: QueryParams, name: str) -> int | None:
    """Read a whole number from 0.

    :raises InvalidRequest: it is none.
    """
    text = query.get(name)
    if text is None:
        return None
    if not re.fullmatch("[0-9]{1,18}", text):
        raise InvalidRequest(f"{name}: {text!r} is no whole number from 0.", "Give one, or leave it out.")
    return int(text)


def _records(entries: Sequence[BaseModel]) -> str:
    return ",".join(entry.model_dump_json() for entry in entries)
