"""Faults at the entrance: each is told once, as far as it still can be, and an unforeseen one is logged."""

import asyncio
from typing import Any

import pytest
from starlette.requests import Request
from starlette.responses import Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from api.common.entrance import Entrance
from api.common.request_ids import RequestIds
from api.common.security import SameSite
from api.walker import Walker
from gateway.core.errors import GatewayError, NotSent

HERE = [(b"host", b"127.0.0.1")]


async def _tell_known(_: Request, error: GatewayError) -> Response:
    return Response(error.detail, 503)


async def _tell_fault(_: Request, _error: Exception) -> Response:
    return Response("a fault", 500)


def asked(app: ASGIApp, headers: list[tuple[bytes, bytes]] = HERE, kind: str = "http") -> list[Message]:
    """The messages of an answer where all requests go to `app`; its own faults come through."""
    tellings = {GatewayError: _tell_known, Exception: _tell_fault}
    entrance = Entrance(SameSite([], []), Walker([]), app, tellings)
    said: list[Message] = []

    async def send(message: Message) -> None:
        said.append(message)

    scope = {"type": kind, "method": "GET", "path": "/", "query_string": b"", "headers": headers}

    async def story() -> None:
        try:
            await RequestIds(entrance)(scope, asyncio.Event().wait, send)  # type: ignore[arg-type]  # nothing comes
        except ZeroDivisionError:
            said.append({"type": "raised"})

    asyncio.run(story())
    return said


def raising(error: Exception, *before: Message) -> ASGIApp:
    async def app(_scope: Scope, _receive: Receive, send: Send) -> None:
        for message in before:
            await send(message)
        raise error

    return app


def status_of(said: list[Message]) -> Any:
    return said[0]["status"]


def test_a_known_error_is_told_and_forgets_where_it_was_raised() -> None:
    error = NotSent("the line is down")
    for _ in range(2):
        assert status_of(asked(raising(error))) == 503
    assert error.__traceback__ is None


def test_a_fault_is_answered_and_reaches_the_server_too() -> None:
    said = asked(raising(ZeroDivisionError()))
    assert status_of(said) == 500
    assert said[-1] == {"type": "raised"}


def test_after_the_head_of_an_answer_there_is_no_other_one() -> None:
    begun = {"type": "http.response.start", "status": 200, "headers": []}
    said = asked(raising(ZeroDivisionError(), begun))
    assert [it["type"] for it in said] == ["http.response.start", "raised"]


def test_a_websocket_is_refused_with_an_answer_of_its_own() -> None:
    said = asked(raising(NotSent("the line is down")), kind="websocket")
    assert (said[0]["type"], status_of(said)) == ("websocket.http.response.start", 503)


@pytest.mark.parametrize("kind", ["http", "websocket"])
def test_a_stranger_comes_no_further(kind: str) -> None:
    assert status_of(asked(raising(ZeroDivisionError()), [(b"host", b"evil.example")], kind)) == 403


def test_the_begin_and_the_end_of_a_server_need_no_headers() -> None:
    async def app(scope: Scope, _receive: Receive, send: Send) -> None:
        await send({"type": f"{scope['type']}.startup.complete"})

    assert asked(app, kind="lifespan") == [{"type": "lifespan.startup.complete"}]
