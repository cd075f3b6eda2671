"""Endpoints are called directly, and what is wrong with a request is said as FastAPI says it."""

import asyncio
from typing import Annotated

import pytest
from fastapi import Body, Header, Path, Query, Request, Response
from fastapi.exceptions import RequestValidationError
from pydantic import BaseModel, ConfigDict
from starlette.datastructures import QueryParams

from api.common.fast_route import NOTHING, FastCall, NotPlain
from api.common.routes import HttpRoute
from api.common.strict_json import StrictRoute
from gateway.core.rights import Right
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


async def modelled(name: str) -> Wish:
    return Wish(amount=len(name))


async def needing_query(name: str, amount: Annotated[int, Query()]) -> Response:
    return Response(f"{name} {amount}")


async def heeding_header(name: str, lease: Annotated[str | None, Header()] = None) -> Response:
    return Response(f"{name} {lease}")


async def listed(kinds: Annotated[list[str] | None, Query()] = None) -> Response:
    return Response(f"{kinds}")


def fast_call(path: str, endpoint: object) -> FastCall | None:
    return FastCall.of(HttpRoute(path, endpoint, right=Right.VIEW))  # type: ignore[arg-type]


def said(path: str, endpoint: object, names: dict[str, str], body: object = NOTHING, query: str = "") -> str:
    call = fast_call(path, endpoint)
    assert call is not None
    request = Request({"type": "http", "path": "/asked", "headers": []})
    begun = call.begin(request, names, body, QueryParams(query))

    async def answer() -> Response:
        return await begun

    return bytes(asyncio.run(answer()).body).decode()


def test_path_and_body_are_taken() -> None:
    assert said("/{name}", plain, {"name": "3F"}) == "/asked 3F"
    assert said("/{unit}", numbered, {"unit": "6"}) == "7 None"
    assert said("/{name}", wishing, {"name": "a"}, {"amount": 3}) == "a 3"
    assert said("/", perhaps_wishing, {}) == "1"
    assert said("/", perhaps_wishing, {}, {"amount": 2}) == "2"


@pytest.mark.parametrize(
    ("path", "endpoint", "names", "body"),
    [
        ("/{unit}", numbered, {"unit": "0"}, NOTHING),
        ("/{unit}", numbered, {"unit": "six"}, NOTHING),
        ("/{name}", wishing, {"name": "a"}, NOTHING),
        ("/{name}", wishing, {"name": "a"}, None),
    ],
)
def test_what_is_wrong_is_left_to_fastapi(
    path: str, endpoint: object, names: dict[str, str], body: object
) -> None:
    with pytest.raises(NotPlain):
        said(path, endpoint, names, body)


@pytest.mark.parametrize(
    ("path", "endpoint", "names", "body", "wrong"),
    [
        ("/{name}", wishing, {"name": "a"}, {"amount": "3"}, ("body", "amount")),
        ("/", perhaps_wishing, {}, {"amuont": 3}, ("body", "amuont")),
    ],
)
def test_what_is_wrong_with_a_body_is_told_with_its_place(
    path: str, endpoint: object, names: dict[str, str], body: object, wrong: tuple[str, str]
) -> None:
    with pytest.raises(RequestValidationError) as told:
        said(path, endpoint, names, body)
    assert [it["loc"] for it in told.value.errors()] == [wrong]
    assert told.value.body == body


def test_a_query_is_taken_as_its_parameters_are() -> None:
    assert said("/{unit}", numbered, {"unit": "6"}, query="wait=2.5") == "7 2.5"
    assert said("/{unit}", numbered, {"unit": "6"}, query="wait=%31") == "7 1.0"


@pytest.mark.parametrize("query", ["wait=soon", "wait=", "wait=1&wait=2", "wiat=1", "unit=7", "kinds=a"])
def test_a_query_with_something_wrong_is_left_to_fastapi(query: str) -> None:
    with pytest.raises(NotPlain):
        said("/{unit}", numbered, {"unit": "6"}, query=query)


def test_a_query_with_a_list_is_left_to_fastapi() -> None:
    with pytest.raises(NotPlain):
        said("/", listed, {}, query="kinds=a")


def test_what_may_take_more_than_that_is_not_called_directly() -> None:
    assert fast_call("/{name}", modelled) is None
    assert fast_call("/{name}", needing_query) is None
    assert fast_call("/{name}", heeding_header) is None


@on_stand()
async def test_most_operations_are_called_directly(stand: Stand) -> None:
    routes = [route for route in stand.app.routes if isinstance(route, StrictRoute)]
    called = [route for route in routes if FastCall.of(route)]
    assert len(called) > 0.9 * len(routes)


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
