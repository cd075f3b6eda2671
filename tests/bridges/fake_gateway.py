"""Stands for a gateway: its documents by path, and its stream of events, over httpx's mock transport."""

import asyncio
import json
from collections import Counter
from collections.abc import AsyncIterator
from typing import Any

import httpx
from motion_gateway_client import AsyncGateway


def body(address: str, **more: object) -> dict[str, Any]:
    line = address.partition(".")[0]
    return {"body_id": address, "line_id": line, "online": True, "moving": False, "position": 0, **more}


def alarm(id_: str, subject: str, **more: object) -> dict[str, Any]:
    return {"id": id_, "cause": "body.offline", "subject": subject, "reset_at": None, **more}


class FakeGateway:
    """Two bodies on a line, a robot with a unit, a SCARA robot; an alarm about a body."""

    def __init__(self) -> None:
        self.documents: dict[str, dict[str, Any]] = {
            "/lines/line1": {"line_id": "line1", "state": "ready", "bodies": ["line1.00", "line1.3F"]},
            "/bodies/line1.00": body("line1.00"),
            "/bodies/line1.3F": body("line1.3F"),
            "/robots/r1": {"robot_id": "r1", "line_id": "cell1", "units": [{"robot_id": "r1", "number": 1}]},
            "/scaras/wafer": {"scara_id": "wafer", "line_id": "line1", "axes": [{"body_id": "line1.00"}]},
            "/alarms/a-1": alarm("a-1", "/bodies/line1.3F"),
        }
        self.asked: Counter[str] = Counter()
        self.queries: list[dict[str, str]] = []
        """Queries of the streams that were begun."""
        self.keys: list[str | None] = []
        self.refusal: httpx.Response | None = None
        """The answer to everything, if there is one."""
        self.refused = 0
        self._events: asyncio.Queue[str] = asyncio.Queue()

    @property
    def transport(self) -> httpx.MockTransport:
        return httpx.MockTransport(self._answer)

    def client(self, key: str | None = None) -> AsyncGateway:
        http = httpx.AsyncClient(base_url="http://gateway", transport=self.transport)
        return AsyncGateway(key=key, http=http)

    def tell(self, number: int, type_: str, subject: str = "/events", **data: object) -> dict[str, Any]:
        """Let an event happen."""
        cursor = f"e-{number}"
        event = {"id": cursor, "type": type_, "subject": subject, "cursor": cursor, "data": data}
        self._events.put_nowait(f"id: {cursor}\nevent: {type_}\ndata: {json.dumps(event)}\n\n")
        return event

    def cut(self) -> None:
        """End the stream."""
        self._events.put_nowait("")

    async def _answer(self, request: httpx.Request) -> httpx.Response:
        path = request.url.path
        self.asked[path] += 1
        self.keys.append(request.headers.get("authorization"))
        if self.refusal is not None:
            self.refused += 1
            return self.refusal
        if path == "/events/stream":
            self.queries.append(dict(request.url.params))
            return httpx.Response(200, stream=_Stream(self._events))
        if path.count("/") == 1:
            listed = [it for its, it in self.documents.items() if its.startswith(path)]
            return httpx.Response(200, json={path[1:]: listed})
        if path in self.documents:
            return httpx.Response(200, json=self.documents[path])
        problem = {"type": "urn:motion-gateway:problem:not-found", "status": 404, "detail": "There is none."}
        return httpx.Response(404, json=problem)


class _Stream(httpx.AsyncByteStream):
    def __init__(self, events: "asyncio.Queue[str]") -> None:
        self._events = events

    async def __aiter__(self) -> AsyncIterator[bytes]:
        yield b": events after e-0\n\n"
        while text := await self._events.get():
            yield text.encode()
