"""Every route has a right, and none is used without asking the access hook for it."""

import gc
import re
import subprocess
import sys
from collections.abc import Iterable, Iterator
from time import thread_time
from typing import Final

import httpx2
import pytest
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Mount, Route
from starlette.types import Scope

from api.app import create_app
from api.common.routes import Guarded, PageRoute, SocketRoute, unguarded
from api.front.stop_paths import is_stop
from api.walker import ServedRow, Walker
from gateway.config import Config
from gateway.core.errors import NotAllowed
from gateway.core.rights import RIGHT_OF, Right
from gateway.door.admission import AuthorizedRequest
from gateway.plant import Plant
from protocols.fics.commands import ROWS
from protocols.rorze.commands import COMMANDS
from tests.api.stand import RELATIVE, Stand, on_stand, socket
from tests.open_access import AnyAccess


class Denying(AnyAccess):
    """Grants no right, and notes the rights that were asked for."""

    def __init__(self) -> None:
        super().__init__()
        self.asked: list[Right] = []

    def require(self, scope: Scope, right: Right, **_: object) -> AuthorizedRequest:  # type: ignore[override]
        assert scope["type"] in ("http", "websocket")
        self.asked.append(right)
        raise NotAllowed("You may not; nothing was sent.")


def every(routes: Iterable[BaseRoute]) -> Iterator[BaseRoute]:
    """All routes, those of mounted applications too."""
    for route in routes:
        if not isinstance(route, Walker):
            yield route
        yield from every(getattr(route, "routes", None) or ())


@pytest.fixture(scope="module")
def routes() -> list[BaseRoute]:
    line = {"id": "arm", "address": "tcp://127.0.0.1:1", "bodies": [{"id": "3F"}]}
    return list(every(create_app(Plant(Config.model_validate({"lines": [line]}))).routes))


async def page(_: Request) -> Response:
    return Response("secret")


class FilesMount(Guarded, Mount):
    """Files, or an application, under one path and one right."""


# the table


def test_every_route_of_the_application_has_a_right(routes: list[BaseRoute]) -> None:
    assert len(routes) > 450
    assert [route for route in routes if not isinstance(route, Guarded)] == []
    kinds = {type(route) for route in routes}
    assert {ServedRow, PageRoute, SocketRoute} <= kinds


def test_a_route_that_was_forgotten_is_found_wherever_it_hides() -> None:
    forgotten = Route("/deep", page)
    outer = FilesMount("/files", routes=[Mount("/more", routes=[forgotten])], right=Right.VIEW)
    inside = outer.routes[0]
    assert list(unguarded([PageRoute("/", page, right=Right.OPEN), outer])) == [inside, forgotten]


@pytest.mark.parametrize("kind", [PageRoute, SocketRoute])
def test_no_route_can_be_built_without_a_right(kind: type[Guarded]) -> None:
    with pytest.raises(TypeError, match="right"):
        kind("/page", page)  # type: ignore[call-arg]  # that is the point
    with pytest.raises(ValueError, match="everything"):
        kind("/page", page, right="everything")  # type: ignore[arg-type]  # a right that there is not


def test_what_stops_takes_the_right_to_stop_and_nothing_else_does(routes: list[BaseRoute]) -> None:
    for route in routes:
        if isinstance(route, ServedRow):
            method = next(iter(route.methods or ()))
            assert is_stop(method, route.path) is (route.right is Right.STOP), route.path


def test_a_command_takes_the_right_that_its_effect_says(routes: list[BaseRoute]) -> None:
    effects = {row.name(): row.effect for row in (*COMMANDS.values(), *ROWS)}
    commands = [route for route in routes if isinstance(route, ServedRow) and "/commands/" in route.path]
    assert len(commands) > 400
    for route in commands:
        assert route.right is RIGHT_OF[effects[route.path.rpartition("/")[2]]], route.path


def test_nothing_but_health_and_version_is_open(routes: list[BaseRoute]) -> None:
    open_to_all = [route for route in routes if isinstance(route, Guarded) and route.right is Right.OPEN]
    paths = {getattr(route, "path", "") for route in open_to_all}
    assert paths == {"/livez", "/readyz", "/version", "/sign-in", "/sign-in/{claim}", "/pendant"}


def test_who_may_view_changes_nothing(routes: list[BaseRoute]) -> None:
    questions = {row.name() for row in (*COMMANDS.values(), *ROWS) if RIGHT_OF[row.effect] is Right.VIEW}
    calculations = {"curve", "forward", "inverse"}
    readings = {"backups", "current", "finish", "readings", "recordings"}
    for route in routes:
        if isinstance(route, ServedRow) and route.right is Right.VIEW and route.methods != {"GET"}:
            assert route.path.rpartition("/")[2] in {*questions, *calculations, *readings, "tickets"}, (
                route.path
            )


# the hook


@on_stand()
async def test_every_kind_of_route_honours_a_refusal(stand: Stand) -> None:
    stand.app.routes.append(FilesMount("/files", app=Starlette(routes=[Route("/a", page)]), right=Right.VIEW))
    stand.app.access = denying = Denying()
    before = stand.frames()
    asked = {
        "/bodies/3F/position": Right.VIEW,
        "/bodies": Right.VIEW,
        "/events/stream": Right.VIEW,
        "/metrics": Right.VIEW,
        "/docs": Right.VIEW,
        "/redoc": Right.VIEW,
        "/openapi.json": Right.VIEW,
        "/commands": Right.VIEW,
        "/static-offline-docs/favicon.png": Right.VIEW,
        "/files/a": Right.VIEW,
        "/": Right.VIEW,
        "/livez": Right.OPEN,
    }
    for path, right in asked.items():
        refused_as(await stand.get(path), path)
        assert denying.asked.pop() is right
    for path, right in {"/bodies/3F/moves": Right.OPERATE, "/stop": Right.STOP}.items():
        refused_as(await stand.post(path, RELATIVE), path)
        assert denying.asked.pop() is right
    assert stand.frames() == before


def refused_as(answer: httpx2.Response, path: str) -> None:
    assert (answer.status_code, answer.json()["detail"]) == (403, "You may not; nothing was sent."), path
    assert answer.json()["request_id"] == answer.headers["x-request-id"]


@on_stand()
async def test_no_route_at_all_is_used_past_the_hook(stand: Stand) -> None:
    stand.app.access = denying = Denying()
    before = stand.frames()
    operations = [route for route in every(stand.app.routes) if isinstance(route, ServedRow | PageRoute)]
    for route in operations:
        path = re.sub(r"{\w+}", "1", route.path)
        method = min(route.methods or ())
        refused_as(await stand.client.request(method, path, content=b"\xff{"), path)
    assert denying.asked == [route.right for route in operations]
    assert stand.frames() == before


@on_stand()
async def test_a_refused_body_is_not_even_read(stand: Stand) -> None:
    stand.app.access = Denying()
    messages: list[str] = []

    async def receive() -> dict[str, object]:
        raise AssertionError("the body was read")

    async def send(message: dict[str, object]) -> None:
        messages.append(f"{message['type']} {message.get('status', '')}".strip())

    scope = {
        "type": "http",
        "method": "POST",
        "path": "/bodies/3F/moves",
        "query_string": b"",
        "headers": [(b"host", b"127.0.0.1"), (b"content-type", b"application/json")],
    }
    await stand.app(scope, receive, send)  # type: ignore[arg-type]  # two names for the same dictionaries
    assert messages == ["http.response.start 403", "http.response.body"]


@on_stand()
async def test_a_refused_websocket_is_never_opened(stand: Stand) -> None:
    stand.app.access = denying = Denying()
    async with socket(stand, "/events", headers={"x-request-id": "mine"}) as client:
        head, body = await client.message(), await client.message()
    assert (head["type"], head["status"]) == ("websocket.http.response.start", 403)
    assert (b"x-request-id", b"mine") in head["headers"]
    assert b"You may not" in body["body"]
    assert denying.asked == [Right.VIEW]


# what is built


def test_stops_are_ready_and_fastapi_is_not_even_imported() -> None:
    """In a process of its own: rows are made once for all applications of one."""
    told = subprocess.run([sys.executable, "-c", UNUSED], capture_output=True, text=True, check=True)  # noqa: S603
    assert told.stdout == "{<Right.STOP: 'stop'>} False\n"


UNUSED: Final = """
import sys
from api.app import create_app
from gateway.config import Config
from gateway.plant import Plant
line = {"id": "arm", "address": "tcp://127.0.0.1:1", "bodies": [{"id": "3F"}]}
app = create_app(Plant(Config.model_validate({"lines": [line]})))
print({row.right for row in app.rows.routes if "call" in vars(row)}, "fastapi" in sys.modules)
"""


def test_the_first_use_of_no_route_holds_the_loop_for_long(routes: list[BaseRoute]) -> None:
    took_s: dict[str, float] = {}
    gc.disable()  # the heap of all tests is none of a gateway
    try:
        for route in routes:
            if isinstance(route, ServedRow):
                begun_s = thread_time()
                route.call.prepare()
                took_s[route.path] = thread_time() - begun_s
    finally:
        gc.enable()
    longest = max(took_s, key=lambda path: took_s[path])
    assert took_s[longest] < 0.05, longest
