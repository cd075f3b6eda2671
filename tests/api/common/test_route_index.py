"""The index of routes finds what the router's search would find, and leaves the rest to it."""

import re
from collections.abc import Sequence

import pytest
from starlette.routing import BaseRoute, Match
from starlette.types import Receive, Scope, Send

from api.app import create_app
from api.common.route_index import RouteIndex
from api.common.routes import HttpRoute
from gateway.config import Config
from gateway.plant import Plant
from tests.api.stand import Stand, on_stand


@pytest.fixture(scope="module")
def routes() -> list[BaseRoute]:
    line = {"id": "arm", "address": "tcp://127.0.0.1:1", "bodies": [{"id": "3F"}]}
    return list(create_app(Plant(Config.model_validate({"lines": [line]}))).routes)


def asked(method: str, path: str) -> Scope:
    return {"type": "http", "method": method, "path": path, "query_string": b"", "headers": []}


def searched(routes: Sequence[BaseRoute], scope: Scope) -> BaseRoute | None:
    return next((it for it in routes if it.matches(scope)[0] is Match.FULL), None)


async def nowhere(_scope: Scope, _receive: Receive, _send: Send) -> None:
    raise LookupError


def test_every_route_is_found_as_a_search_finds_it(routes: list[BaseRoute]) -> None:
    index = RouteIndex(routes, nowhere)
    own = [route for route in routes if isinstance(route, HttpRoute)]
    assert len(own) > 450
    for route in own:
        method = min(route.methods or ())
        for word in ("1", "line1", "positions"):
            scope = asked(method, re.sub(r"{\w+}", word, route.path))
            found = index.find(dict(scope))
            assert found is searched(routes, scope), (method, scope["path"])
            assert found is not None


@pytest.mark.parametrize(
    ("method", "path"),
    [
        ("GET", "/nowhere"),
        ("GET", "/bodies/"),
        ("GET", "//"),
        ("GET", ""),
        ("DELETE", "/bodies"),
        ("GET", "/bodies/3F/{x"),
    ],
)
def test_what_is_not_there_is_left_to_the_search(routes: list[BaseRoute], method: str, path: str) -> None:
    assert RouteIndex(routes, nowhere).find(asked(method, path)) is None


@on_stand()
async def test_a_wrong_method_and_a_wrong_path_are_answered_as_ever(stand: Stand) -> None:
    wrong = await stand.client.request("DELETE", "/bodies/3F")
    assert (wrong.status_code, wrong.headers["allow"]) == (405, "GET")
    assert (await stand.get("/bodies/3F/nothing")).status_code == 404
