"""Requests are read by the rows that they are for, and found wrong where FastAPI finds them wrong."""

import asyncio
import json
from collections.abc import Awaitable, Callable
from typing import Annotated, Any, Final

import pytest
from fastapi import FastAPI
from fastapi.exceptions import RequestValidationError
from httpx2 import ASGITransport, AsyncClient
from pydantic import Field
from starlette.requests import Request
from starlette.responses import Response

from api import described
from api.common.calling import NOTHING, Call
from api.common.faults import InvalidParts
from gateway.core.operation import Operation, operation
from gateway.core.records import RequestModel
from gateway.core.rights import Right
from tests.api.stand import Stand, on_stand

Number = Annotated[int, Field(ge=1)]


class Wish(RequestModel):
    amount: int = 1


async def plain(name: str) -> None: ...


async def numbered(unit: Number, *, wait: float | None = None) -> None: ...


async def wishing(name: str, wish: Wish) -> None: ...


NO_WISH: Final = Wish()


async def perhaps_wishing(wish: Wish = NO_WISH) -> None: ...


async def needing_query(name: str, *, amount: int) -> None: ...


Run = Callable[..., Awaitable[None]]


def row(path: str, run: Run) -> Operation:
    return operation("test", "POST", path, Right.VIEW, run)


def read(path: str, run: Run, names: dict[str, str], content: object = NOTHING, query: str = "") -> Any:
    body = b"" if content is NOTHING else json.dumps(content).encode()
    scope = {
        "type": "http",
        "path": "/asked",
        "path_params": names,
        "query_string": query.encode(),
        "headers": [(b"content-type", b"application/json")],
    }

    async def receive() -> dict[str, object]:
        return {"type": "http.request", "body": body, "more_body": False}

    return asyncio.run(Call(row(path, run)).read(Request(scope, receive)))


def test_path_and_body_are_taken() -> None:
    assert read("/{name}", plain, {"name": "3F"}) == {"name": "3F"}
    assert read("/{unit}", numbered, {"unit": "6"}) == {"unit": 6, "wait": None}
    assert read("/{name}", wishing, {"name": "a"}, {"amount": 3}) == {"name": "a", "wish": Wish(amount=3)}
    assert read("/", perhaps_wishing, {}) == {"wish": Wish()}
    assert read("/", perhaps_wishing, {}, None) == {"wish": Wish()}
    assert read("/", perhaps_wishing, {}, {"amount": 2}) == {"wish": Wish(amount=2)}


@pytest.mark.parametrize(
    ("query", "wait"), [("wait=2.5", 2.5), ("wait=%31", 1.0), ("wait=1&wait=2", 2.0), ("", None)]
)
def test_the_query_is_taken(query: str, wait: float | None) -> None:
    assert read("/{unit}", numbered, {"unit": "6"}, query=query) == {"unit": 6, "wait": wait}
    assert read("/{name}", needing_query, {"name": "a"}, query="amount=3") == {"name": "a", "amount": 3}


WRONG: Final[list[tuple[str, Run, dict[str, str], object, str, dict[Any, str]]]] = [
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


@pytest.mark.parametrize(("path", "run", "names", "content", "query", "wrong"), WRONG)
def test_all_that_is_wrong_is_told_with_its_place(
    path: str, run: Run, names: dict[str, str], content: object, query: str, wrong: dict[Any, str]
) -> None:
    with pytest.raises(InvalidParts) as told:
        read(path, run, names, content, query)
    assert {it["loc"]: it["type"] for it in told.value.errors} == wrong
    assert told.value.body == (None if content is NOTHING else content)


@pytest.mark.filterwarnings("ignore::pydantic.warnings.UnsupportedFieldAttributeWarning")
def test_fastapi_says_the_same() -> None:
    """It describes the operations: what it would refuse is refused, at the same places."""
    app = FastAPI(telemetry={"tracing": False, "metrics": False, "logs": False})
    told: list[list[tuple[Any, str]]] = []

    @app.exception_handler(RequestValidationError)
    async def note(_request: Request, error: RequestValidationError) -> Response:
        told.append([(it["loc"], it["type"]) for it in error.errors()])
        return Response(status_code=422)

    for number, (path, run, *_) in enumerate(WRONG):
        app.add_api_route(f"/{number}{path}", described.endpoint_of(row(path, run)), methods=["POST"])

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
