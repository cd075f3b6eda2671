"""Requests are read as FastAPI reads them by the same signature, and found wrong at the same places."""

import asyncio
from collections.abc import Awaitable, Callable, Sequence
from typing import Annotated, Any, Final

import pytest
from fastapi import Body, FastAPI, Header, Path, Query, Request, Response
from fastapi.exceptions import RequestValidationError
from httpx2 import ASGITransport, AsyncClient
from pydantic import BaseModel, ConfigDict

from api.common.calling import NOTHING, Call
from api.common.faults import InvalidParts
from tests.api.stand import Stand, on_stand

Number = Annotated[int, Path(ge=1)]


class Wish(BaseModel):
    model_config = ConfigDict(strict=True, extra="forbid")
    amount: int = 1


async def plain(request: Request, name: str) -> Response:
    return Response(f"{request.scope['path']} {name}")


async def numbered(unit: Number, wait: Annotated[float | None, Query()] = None) -> Response:
    return Response(f"{unit + 1} {wait}")


async def wishing(name: str, wish: Wish) -> Response:
    return Response(f"{name} {wish.amount}")


async def perhaps_wishing(wish: Annotated[Wish, Body(default_factory=Wish)]) -> Response:
    return Response(f"{wish.amount}")


async def needing_query(name: str, amount: Annotated[int, Query()]) -> Response:
    return Response(f"{name} {amount}")


async def heeding_header(last_name: Annotated[str | None, Header(pattern="^[a-z]+$")] = None) -> Response:
    return Response(f"{last_name}")


def said(
    path: str,
    endpoint: Callable[..., Awaitable[Response]],
    names: dict[str, str],
    content: object = NOTHING,
    query: str = "",
    headers: Sequence[tuple[bytes, bytes]] = (),
) -> str:
    scope = {"type": "http", "path": "/asked", "query_string": query.encode(), "headers": [*headers]}
    values = Call(endpoint, path).read(Request(scope), names, content)

    async def answer() -> Response:
        return await endpoint(**values)

    return bytes(asyncio.run(answer()).body).decode()


def test_path_and_body_are_taken() -> None:
    assert said("/{name}", plain, {"name": "3F"}) == "/asked 3F"
    assert said("/{unit}", numbered, {"unit": "6"}) == "7 None"
    assert said("/{name}", wishing, {"name": "a"}, {"amount": 3}) == "a 3"
    assert said("/", perhaps_wishing, {}) == "1"
    assert said("/", perhaps_wishing, {}, None) == "1"
    assert said("/", perhaps_wishing, {}, {"amount": 2}) == "2"


def test_headers_and_query_are_taken() -> None:
    assert said("/{unit}", numbered, {"unit": "6"}, query="wait=2.5") == "7 2.5"
    assert said("/{unit}", numbered, {"unit": "6"}, query="wait=%31") == "7 1.0"
    assert said("/{unit}", numbered, {"unit": "6"}, query="wait=1&wait=2") == "7 2.0"
    assert said("/{name}", needing_query, {"name": "a"}, query="amount=3") == "a 3"
    assert said("/", heeding_header, {}, headers=[(b"last-name", b"bohr")]) == "bohr"
    assert said("/", heeding_header, {}) == "None"


WRONG: Final[list[tuple[str, Any, dict[str, str], object, str, dict[Any, str]]]] = [
    ("/{unit}", numbered, {"unit": "0"}, NOTHING, "", {("path", "unit"): "greater_than_equal"}),
    ("/{unit}", numbered, {"unit": "six"}, NOTHING, "", {("path", "unit"): "int_parsing"}),
    ("/{unit}", numbered, {"unit": "6"}, NOTHING, "wait=soon", {("query", "wait"): "float_parsing"}),
    ("/{name}", needing_query, {"name": "a"}, NOTHING, "", {("query", "amount"): "missing"}),
    ("/{name}", wishing, {"name": "a"}, NOTHING, "", {("body",): "missing"}),
    ("/{name}", wishing, {"name": "a"}, None, "", {("body",): "missing"}),
    ("/{name}", wishing, {"name": "a"}, {"amount": "3"}, "", {("body", "amount"): "int_type"}),
    ("/", perhaps_wishing, {}, {"amuont": 3}, "", {("body", "amuont"): "extra_forbidden"}),
    (
        *("/{unit}", numbered, {"unit": "x"}, NOTHING, "wait=x"),
        {("path", "unit"): "int_parsing", ("query", "wait"): "float_parsing"},
    ),
]


@pytest.mark.parametrize(("path", "endpoint", "names", "content", "query", "wrong"), WRONG)
def test_all_that_is_wrong_is_told_with_its_place(
    path: str, endpoint: Any, names: dict[str, str], content: object, query: str, wrong: dict[Any, str]
) -> None:
    with pytest.raises(InvalidParts) as told:
        said(path, endpoint, names, content, query)
    assert {it["loc"]: it["type"] for it in told.value.errors()} == wrong
    assert told.value.body == (None if content is NOTHING else content)


def test_fastapi_says_the_same() -> None:
    """It describes the operations: what it would refuse is refused, at the same places."""
    app = FastAPI(telemetry={"tracing": False, "metrics": False, "logs": False})
    told: list[list[tuple[Any, str]]] = []

    @app.exception_handler(RequestValidationError)
    async def note(_request: Request, error: RequestValidationError) -> Response:
        told.append([(it["loc"], it["type"]) for it in error.errors()])
        return Response(status_code=422)

    for number, (path, endpoint, *_) in enumerate(WRONG):
        app.add_api_route(f"/{number}{path}", endpoint, methods=["POST"])

    async def ask() -> None:
        async with AsyncClient(transport=ASGITransport(app), base_url="http://test") as client:
            for number, (path, _, names, content, query, _) in enumerate(WRONG):
                at = f"/{number}{path.format(**names)}?{query}"
                await client.post(at, json=None if content is NOTHING else content)

    asyncio.run(ask())
    assert told == [list(wrong.items()) for *_, wrong in WRONG]


@on_stand()
async def test_a_wrong_body_is_answered_once_it_was_read(stand: Stand) -> None:
    before = stand.frames()
    answer = await stand.post("/bodies/3F/commands/set-homing-retries", {"retries": "many"})
    assert answer.status_code == 422
    assert "retries" in answer.json()["detail"]
    missing = await stand.client.post("/bodies/3F/commands/set-homing-retries")
    assert missing.status_code == 422
    assert stand.frames() == before


@on_stand()
async def test_an_empty_object_is_read_once_also_where_something_else_is_wrong(stand: Stand) -> None:
    for method, path in (("DELETE", "/bodies/3F/captures/1"), ("POST", "/bodies/3F/backups?wait=-1")):
        async with asyncio.timeout(1):
            answer = await stand.client.request(method, path, json={})
        assert answer.status_code == 422


@on_stand()
async def test_a_query_is_heeded_as_before(stand: Stand) -> None:
    assert (await stand.get("/bodies/3F/moves?limit=0")).status_code == 422
    assert (await stand.get("/bodies/3F/moves?limit=1")).status_code == 200
