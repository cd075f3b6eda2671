"""Every route and every kind of front end, for every role, in and out of scope: who gets in."""

import asyncio
import json
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any, Final

import pytest
from httpx2 import ASGITransport, AsyncClient
from starlette.routing import BaseRoute
from starlette.types import Message, Scope

from api.app import Application, create_app
from api.common.access import Access
from api.common.routes import SocketRoute
from api.walker import Walker
from gateway.access.roles import Role
from gateway.core.errors import GatewayError
from gateway.core.rights import RIGHT_OF, Right
from gateway.door.admission import AuthorizedRequest
from protocols.fics.commands import ROWS
from protocols.rorze.commands import COMMANDS
from tests.api.access.guarded import Keys
from tests.api.stand import HOST
from tests.api.whole_plant import THERE, whole_plant

MAY: Final = {
    Role.VIEWER: "view stop",
    Role.OPERATOR: "view stop operate",
    Role.SETUP: "view stop operate setup",
    Role.ADMIN: "view stop operate setup admin",
}
TABLE: Final = """
GET       /bodies                                        view     any
GET       /bodies/{body_id}                              view     body
GET       /bodies/{body_id}/position                     view     body
GET       /bodies/{body_id}/status                       view     body
PUT       /bodies/{body_id}/position                     setup    body
POST      /bodies/{body_id}/speed                        operate  body
POST      /bodies/{body_id}/power-cycle/acknowledge      operate  body
POST      /bodies/{body_id}/moves                        operate  body
GET       /bodies/{body_id}/moves                        view     body
GET       /bodies/{body_id}/moves/{move_id}              view     body
POST      /bodies/{body_id}/jogs                         operate  body
POST      /bodies/{body_id}/jogs/{jog_id}/heartbeat      operate  body
POST      /bodies/{body_id}/jogs/{jog_id}/stop           stop     body
POST      /bodies/{body_id}/moves/{move_id}/speed        operate  body
GET       /bodies/{body_id}/positions                    view     body
PUT       /bodies/{body_id}/positions                    setup    body
PUT       /bodies/{body_id}/positions/{number}/name      setup    body
POST      /bodies/{body_id}/positions/readings           view     body
GET       /bodies/{body_id}/positions/readings/{reading_id}     view     body
DELETE    /bodies/{body_id}/positions/readings/current   view     body
POST      /bodies/{body_id}/positions/uploads            setup    body
GET       /bodies/{body_id}/positions/uploads/{upload_id}      view     body
DELETE    /bodies/{body_id}/positions/uploads/current    setup    body
GET       /bodies/{body_id}/positions.csv                view     body
POST      /bodies/{body_id}/positions.csv                setup    body
PUT       /bodies/{body_id}/positions.csv                setup    body
GET       /bodies/{body_id}/inputs                       view     body
GET       /bodies/{body_id}/outputs                      view     body
PUT       /bodies/{body_id}/outputs/{output}             operate  body
POST      /bodies/{body_id}/outputs/{output}/pulses      operate  body
GET       /bodies/{body_id}/sensors                      view     body
GET       /bodies/{body_id}/error-outputs                view     body
PUT       /bodies/{body_id}/error-outputs/{cause}        setup    body
POST      /bodies/{body_id}/error-outputs/reset          operate  body
GET       /bodies/{body_id}/captures                     view     body
GET       /bodies/{body_id}/captures/{port}              view     body
PUT       /bodies/{body_id}/captures/{port}              operate  body
DELETE    /bodies/{body_id}/captures/{port}              operate  body
GET       /bodies/{body_id}/moves/{move_id}/samples      view     body
GET       /bodies/{body_id}/moves/{move_id}/samples.csv  view     body
POST      /bodies/{body_id}/raw                          setup    body
POST      /bodies/{body_id}/stop                         stop     body
GET       /bodies/{body_id}/program                      view     body
PUT       /bodies/{body_id}/program                      setup    body
GET       /bodies/{body_id}/program/uploads/{upload_id}  view     body
DELETE    /bodies/{body_id}/program/uploads/current      setup    body
POST      /bodies/{body_id}/program/runs                 operate  body
GET       /bodies/{body_id}/program/runs/current         view     body
GET       /bodies/{body_id}/program/runs/{run_id}        view     body
GET       /bodies/{body_id}/memories                     view     body
PUT       /bodies/{body_id}/memories                     operate  body
PUT       /bodies/{body_id}/memories/{name}              operate  body
GET       /bodies/{body_id}/settings                     view     body
PATCH     /bodies/{body_id}/settings                     setup    body
GET       /bodies/{body_id}/encoder                      view     body
PATCH     /bodies/{body_id}/encoder                      setup    body
PUT       /bodies/{body_id}/encoder/resolution           setup    body
GET       /bodies/{body_id}/homing                       view     body
GET       /bodies/{body_id}/noise-filters                view     body
PATCH     /bodies/{body_id}/noise-filters                setup    body
PATCH     /bodies/{body_id}/homing                       setup    body
GET       /bodies/{body_id}/speed-sets                   view     body
GET       /bodies/{body_id}/speed-sets/{n}               view     body
PUT       /bodies/{body_id}/speed-sets/{n}               setup    body
PATCH     /bodies/{body_id}/speed-sets/{n}               setup    body
GET       /bodies/{body_id}/patterns                     view     body
GET       /bodies/{body_id}/patterns/{n}                 view     body
PUT       /bodies/{body_id}/patterns/{n}                 setup    body
PATCH     /bodies/{body_id}/patterns/{n}                 setup    body
GET       /bodies/{body_id}/patterns/{n}/curve           view     body
POST      /bodies/{body_id}/patterns/{n}/curve           view     body
GET       /bodies/{body_id}/backup                       view     body
POST      /bodies/{body_id}/backups                      view     body
GET       /bodies/{body_id}/backups/{backup_id}          view     body
DELETE    /bodies/{body_id}/backups/current              view     body
POST      /bodies/{body_id}/restores                     setup    body
GET       /bodies/{body_id}/restores/{restore_id}        view     body
DELETE    /bodies/{body_id}/restores/current             setup    body
POST      /bodies/{body_id}/comparisons                setup    body
GET       /bodies/{body_id}/comparisons/{comparison_id}     view     body
DELETE    /bodies/{body_id}/comparisons/current        setup    body
GET       /lines/{line_id}/backup                        view     line
POST      /lines/{line_id}/backups                       view     line
GET       /lines/{line_id}/backups/{backup_id}           view     line
DELETE    /lines/{line_id}/backups/current               view     line
POST      /lines/{line_id}/restores                      setup    line
GET       /lines/{line_id}/restores/{restore_id}         view     line
DELETE    /lines/{line_id}/restores/current              setup    line
POST      /lines/{line_id}/comparisons                 setup    line
GET       /lines/{line_id}/comparisons/{comparison_id} view     line
DELETE    /lines/{line_id}/comparisons/current         setup    line
POST      /stop                                          stop     plant
GET       /alarms                                        view     any
GET       /alarms/{alarm_id}                             view     any
POST      /alarms/{alarm_id}/reset                       operate  any
GET       /audit                                         view     any
GET       /shift                                         view     any
GET       /shift.csv                                     view     any
GET       /moment                                        view     plant
GET       /backups/nightly                               view     plant
GET       /backups/nightly/{target}/{night}              view     plant
GET       /backups/nightly/{target}/{night}/changes      view     plant
GET       /security                                      admin    plant
GET       /access/sessions                               admin    plant
DELETE    /access/sessions                               admin    plant
DELETE    /access/sessions/{session_id}                  admin    plant
GET       /groups                                        view     any
GET       /groups/{group_id}                             view     group
PUT       /groups/{group_id}                             setup    group
POST      /groups/{group_id}/moves                       operate  group
POST      /groups/{group_id}/stop                        stop     group
GET       /scaras                                        view     any
GET       /scaras/{scara_id}                             view     scara
GET       /scaras/{scara_id}/coordinates                 view     scara
POST      /scaras/{scara_id}/kinematics/forward          view     scara
POST      /scaras/{scara_id}/kinematics/inverse          view     scara
GET       /scaras/{scara_id}/geometry                    view     scara
POST      /scaras/{scara_id}/geometry/apply              setup    scara
GET       /scaras/{scara_id}/paths/{path}                view     scara
PUT       /scaras/{scara_id}/paths/{path}                setup    scara
POST      /scaras/{scara_id}/moves                       operate  scara
GET       /scaras/{scara_id}/moves                       view     scara
GET       /scaras/{scara_id}/moves/{move_id}             view     scara
GET       /scaras/{scara_id}/moves/{move_id}/samples     view     scara
POST      /scaras/{scara_id}/stop                        stop     scara
GET       /lines                                         view     any
POST      /lines                                         admin    plant
POST      /lines/{line_id}/bodies                        admin    line
GET       /lines/{line_id}                               view     line
POST      /lines/{line_id}/scans                         setup    line
POST      /lines/{line_id}/take-over                     setup    line
GET       /lines/{line_id}/scans/{scan_id}               view     line
POST      /commissionings                                admin    plant
GET       /commissionings/{commissioning_id}             admin    plant
DELETE    /commissionings/{commissioning_id}             admin    plant
POST      /commissionings/{commissioning_id}/settings    admin    plant
GET       /lines/{line_id}/trace                         view     line
GET       /lines/{line_id}/trace/stream                  view     line
WEBSOCKET /lines/{line_id}/trace/stream                  view     line
GET       /lines/{line_id}/positions                     view     line
GET       /lines/{line_id}/statuses                      view     line
GET       /robots                                        view     any
GET       /robots/{robot_id}                             view     robot
GET       /robots/{robot_id}/units/{unit}                view     robot
GET       /robots/{robot_id}/units/{unit}/position       view     robot
GET       /robots/{robot_id}/units/{unit}/status         view     robot
GET       /robots/{robot_id}/errors                      view     robot
POST      /robots/{robot_id}/errors/reset                operate  robot
POST      /robots/{robot_id}/power-cycle/acknowledge     operate  robot
POST      /robots/{robot_id}/stop                        stop     robot
PUT       /robots/{robot_id}/mode                        setup    robot
POST      /robots/{robot_id}/raw                         setup    robot
POST      /robots/{robot_id}/units/{unit}/raw            setup    robot
POST      /robots/{robot_id}/units/{unit}/stop           stop     robot
POST      /robots/{robot_id}/units/{unit}/moves          operate  robot
GET       /robots/{robot_id}/units/{unit}/moves          view     robot
GET       /robots/{robot_id}/units/{unit}/moves/{move_id} view    robot
GET       /robots/{robot_id}/macros                      view     robot
GET       /robots/{robot_id}/units/{unit}/moves/{move_id}/samples view robot
GET       /robots/{robot_id}/units/{unit}/moves/{move_id}/samples.csv view robot
POST      /robots/{robot_id}/macros/{name}/runs          operate  robot
POST      /robots/{robot_id}/jogs                        operate  robot
POST      /robots/{robot_id}/jogs/{jog_id}/heartbeat     operate  robot
POST      /robots/{robot_id}/jogs/{jog_id}/stop          stop     robot
GET       /robots/{robot_id}/units/{unit}/positions      view     robot
PUT       /robots/{robot_id}/units/{unit}/positions      setup    robot
PUT       /robots/{robot_id}/units/{unit}/positions/{number}/name   setup    robot
GET       /robots/{robot_id}/units/{unit}/positions.csv  view     robot
PUT       /robots/{robot_id}/units/{unit}/positions.csv  setup    robot
GET       /robots/{robot_id}/units/{unit}/settings       view     robot
PATCH     /robots/{robot_id}/units/{unit}/settings       setup    robot
GET       /robots/{robot_id}/inputs                      view     robot
GET       /robots/{robot_id}/outputs                     view     robot
PUT       /robots/{robot_id}/outputs/{channel}/{bit}     operate  robot
GET       /robots/{robot_id}/variables                   view     robot
PUT       /robots/{robot_id}/variables/{number}          operate  robot
GET       /robots/{robot_id}/backup                      view     robot
POST      /robots/{robot_id}/backups                     view     robot
GET       /robots/{robot_id}/backups/{backup_id}         view     robot
DELETE    /robots/{robot_id}/backups/current             view     robot
POST      /robots/{robot_id}/restores                    setup    robot
GET       /robots/{robot_id}/restores/{restore_id}       view     robot
DELETE    /robots/{robot_id}/restores/current            setup    robot
POST      /robots/{robot_id}/comparisons               setup    robot
GET       /robots/{robot_id}/comparisons/{comparison_id}    view     robot
DELETE    /robots/{robot_id}/comparisons/current       setup    robot
GET       /events                                        view     events
GET       /events/stream                                 view     events
WEBSOCKET /events                                        view     events
GET       /commands                                      view     any
GET       /translations                                  view     any
GET       /numbers                                       view     any
GET       /metrics                                       view     plant
GET       /leases                                        view     any
POST      /leases                                        operate  any
GET       /leases/{lease_id}                             view     any
POST      /leases/{lease_id}/renew                       operate  any
DELETE    /leases/{lease_id}                             operate  any
POST      /tickets                                       view     any
GET       /system/posture                                view     any
GET       /system/identity                               view     any
POST      /system/reload                                 admin    plant
GET       /system/ports                                  admin    plant
POST      /system/scans                                  admin    plant
GET       /system/scans/{scan_id}                        admin    plant
DELETE    /system/scans/current                          admin    plant
POST      /recordings                                    view     any
GET       /recordings                                    view     any
GET       /recordings/{recording_id}                     view     any
POST      /recordings/{recording_id}/finish              view     any
DELETE    /recordings/{recording_id}                     setup    plant
GET       /recordings/{recording_id}/content             view     any
GET       /access/keys                                   admin    plant
POST      /access/keys                                   admin    plant
DELETE    /access/keys/{name}                            admin    plant
POST      /access/keys/{name}/rotate                     admin    plant
POST      /access/keys/{name}/approve                    admin    plant
GET       /livez                                         open     any
GET       /readyz                                        open     any
GET       /version                                       open     any
GET       /sign-in                                       open     any
POST      /sign-in                                       open     any
POST      /sign-in/{claim}                               open     any
GET       /pendant                                       open     any
POST      /pendant/{target}                              operate  any
POST      /sign-out                                      view     any
GET       /                                              view     any
GET       /assets/{name}                                 view     any
GET       /manual                                        view     any
GET       /manual/{name:path}                            view     any
GET       /docs                                          view     any
GET       /docs/resources                                view     any
GET       /docs/all                                      view     any
GET       /redoc                                         view     any
GET       /openapi.json                                  view     any
GET       /openapi/resources.json                        view     any
GET       /openapi/core.json                             view     any
GET       /static-offline-docs/swagger-ui-bundle.js      view     any
GET       /static-offline-docs/swagger-ui.css            view     any
GET       /static-offline-docs/redoc.standalone.js       view     any
GET       /static-offline-docs/favicon.png               view     any
"""
"""The right of each route, and the part it is about; command routes follow from the command tables."""

IN: Final = {
    "body": (("arm",), ("arm.3F",), ("arm.80",)),
    "group": (("arm",), ("arm.01", "arm.3F"), ("80",)),
    "scara": (("leg",), ("leg.00", "leg.70"), ("wafer",), ("leg.82",)),
    "line": (("arm",), ("leg", "arm")),
    "robot": (("cell",), ("r1",)),
    "events": (("arm",), ("arm.3F",)),
    "plant": (),
    "any": (("arm",), ("r1",), ("leg.00",)),
}
OUT: Final = {
    "body": (("leg",), ("arm.01",), ("r1",), ("00",), ("leg.81",), ("nowhere",)),
    "group": (("leg",), ("arm.01",), ("arm.3F", "leg"), ("nowhere",)),
    "scara": (("arm",), ("leg.70",), ("leg.00", "r1"), ("nowhere",)),
    "line": (("leg",), ("arm.00", "arm.01", "arm.3F", "arm.80"), ("r1",)),
    "robot": (("arm", "leg"), ("r2",), ("nowhere",)),
    "events": (("leg",), ("arm.01",), ("r1",)),
    "plant": (("arm", "leg", "cell", "rail"),),
    "any": (),
}
PASSED: Final = 409


@dataclass(frozen=True)
class Row:
    method: str
    path: str
    right: Right
    about: str

    @property
    def target(self) -> str:
        """The route's path with names in it."""
        path = re.sub("{([a-z_]+)(?::path)?}", lambda name: THERE.get(name[1], "1"), self.path)
        return path + "?bodies=arm.3F" * (self.about == "events")

    def expected(self, role: Role, scope: tuple[str, ...] | None) -> int:
        if self.right is Right.OPEN:
            return PASSED
        if self.right.value not in MAY[role].split():
            return 403
        out = scope in OUT[self.about] and self.right is not Right.STOP
        return 403 if out else PASSED


class Passed(GatewayError):
    """The hook let it pass."""


class Probing(Access):
    """Lets nothing happen behind the hook."""

    def require(
        self, scope: Scope, right: Right, *, any_scope: bool = False, cookie_suffices: bool = False
    ) -> AuthorizedRequest:
        super().require(scope, right, any_scope=any_scope, cookie_suffices=cookie_suffices)
        raise Passed("It would be done.")


def rows() -> Iterator[Row]:
    for line in TABLE.strip().splitlines():
        method, path, right, about = line.split()
        yield Row(method, path, Right(right), about)


def written() -> dict[tuple[str, str], Row]:
    return {(row.method, row.path): row for row in rows()}


EFFECTS: Final = {row.name(): row.effect for row in (*COMMANDS.values(), *ROWS)}


def row_of(method: str, path: str) -> Row:
    """The row of a route; a command's from the command's own table."""
    if "/commands/" not in path:
        return written()[method, path]
    about = re.match("/(bod|group|line|robot)", path)
    assert about, path
    kind = {"bod": "body"}.get(about[1], about[1])
    return Row(method, path, RIGHT_OF[EFFECTS[path.rpartition("/")[2]]], kind)


def every(routes: list[BaseRoute]) -> Iterator[BaseRoute]:
    for route in routes:
        if isinstance(route, Walker):
            yield from route.routes
        else:
            yield route


def routes_of(app: Application) -> Iterator[tuple[str, str]]:
    for route in every(app.routes):
        if isinstance(route, SocketRoute):
            yield "WEBSOCKET", route.path
        else:
            for method in sorted(getattr(route, "methods", None) or {"GET"}):
                if method != "HEAD":
                    yield method, str(getattr(route, "path", ""))


@pytest.fixture
def keys(tmp_path: Path) -> Keys:
    return Keys(tmp_path)


@pytest.fixture
def app(keys: Keys) -> Application:
    plant = whole_plant()
    app = create_app(plant, keys.credentials)
    app.access = Probing(plant)
    return app


def test_every_route_has_a_row_and_every_row_a_route(app: Application) -> None:
    there = {route for route in routes_of(app) if "/commands/" not in route[1]}
    assert there == set(written())
    assert len(list(routes_of(app))) > 450


def test_a_row_says_what_its_route_says(app: Application) -> None:
    for route in every(app.routes):
        for method, path in routes_of_one(route):
            assert row_of(method, path).right is route.right, path  # type: ignore[attr-defined]


def routes_of_one(route: BaseRoute) -> Iterator[tuple[str, str]]:
    path = str(getattr(route, "path", ""))
    methods = {"WEBSOCKET"} if isinstance(route, SocketRoute) else getattr(route, "methods", ()) or ()
    return ((method, path) for method in methods if method != "HEAD")


async def asked(app: Application, row: Row, headers: Mapping[str, str]) -> int:
    """Ask without a client, which takes longer than the gateway; a body that is read fails the test."""
    path, _, query = row.target.partition("?")
    websocket = row.method == "WEBSOCKET"
    scope: Scope = {
        "type": "websocket" if websocket else "http",
        "method": row.method,
        "path": path,
        "query_string": query.encode(),
        "headers": [(name.encode(), value.encode()) for name, value in {"host": HOST, **headers}.items()],
        # How a server says that a handshake may be answered as a request.
        "extensions": {"websocket.http.response": {}},
    }
    told: list[Any] = []

    async def receive() -> Message:
        assert websocket, "the body was read"
        return {"type": "websocket.connect"}

    async def send(message: Message) -> None:
        told.append(message)

    await app(scope, receive, send)
    head, body = told
    problem = json.loads(body["body"])
    assert (problem["moved"], problem["status"]) == ("no", head["status"])
    assert (head["status"] == 401) == any(name == b"www-authenticate" for name, _ in head["headers"])
    return int(head["status"])


def test_the_matrix(app: Application, keys: Keys) -> None:
    """Each cell has its expected status, and no body is read before."""
    wrong: list[str] = []
    cells = 0

    async def run() -> None:
        nonlocal cells
        for row in (row_of(*route) for route in routes_of(app)):
            for headers in ({}, {"authorization": "Bearer mg_0_0"}, {"cookie": "mg-session=x"}):
                cells += 1
                if await asked(app, row, headers) != (PASSED if row.right is Right.OPEN else 401):
                    wrong.append(f"{row}: {headers}")
            most = 1 if "/commands/" in row.path else None
            scopes = (None, *IN[row.about][:most], *OUT[row.about][:most])
            for role, scope in product(Role, scopes):
                cells += 1
                status = await asked(app, row, keys.header(role, *scope or ()))
                if status != row.expected(role, scope):
                    wrong.append(f"{row}: {role} {scope}: {status}")

    asyncio.run(run())
    assert wrong == []
    assert cells > 8_000


@pytest.mark.parametrize(
    "query", ["", "?bodies=", "?bodies=arm.3F&bodies=", "?bodies=arm.3F,", "?bodies=arm.3F,leg.00"]
)
def test_events_of_more_than_the_scope_are_refused(app: Application, keys: Keys, query: str) -> None:
    async def run() -> None:
        transport = ASGITransport(app, raise_app_exceptions=False)
        async with AsyncClient(transport=transport, base_url=f"http://{HOST}") as client:
            for path in ("/events", "/events/stream"):
                answer = await client.get(path + query, headers=keys.header("viewer", "arm"))
                assert answer.status_code == 403, query

    asyncio.run(run())
