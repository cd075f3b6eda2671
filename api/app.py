"""The web application: all routes over one plant."""

from collections.abc import Iterable
from functools import partial
from typing import Any, Final
from warnings import catch_warnings, simplefilter

from fastapi import FastAPI, HTTPException
from pydantic.warnings import UnsupportedFieldAttributeWarning
from starlette.types import ASGIApp, Receive, Scope, Send

from api import by_hand, manual, sign_in, streams, walker
from api.common import problems, schemas
from api.common.access import Access
from api.common.documentation import place_of
from api.common.entrance import Entrance, open_to
from api.common.idempotent_requests import IdempotentRequests
from api.common.proxies import Proxies
from api.common.request_ids import RequestIds
from api.common.route_index import RouteIndex
from api.common.routes import HttpRoute, unguarded
from api.common.security import SameSite
from api.common.strict_json import StrictRoute
from api.console import pages as console
from api.front import documents
from gateway.door.admission import Credentials
from gateway.door.keys import Keys
from gateway.door.metrics import metrics_of
from gateway.door.opening import Plant
from gateway.door.remedies import calls_for
from gateway.door.system import VERSION
from gateway.door.table import FAMILIES, Operation, Right, operations_of
from gateway.door.traffic import Traffic

DESCRIPTION = f"""\
{", and ".join(family.controllers for family in FAMILIES.values() if family.controllers)}.

Bodies are addressed by two hex digits where only one line has them (`3F`), and always with their line
(`arm.3F`); robots by their names, and their axes by unit. Errors are problem details (RFC 9457); `moved`
says whether the motor did anything. Statuses that clients repeat by themselves are sent only where nothing
was sent to a controller. A software stop does not replace a hardware stop.
"""


class Application(FastAPI):
    """An application that gives each request an id before anything can go wrong with it."""

    plant: Plant
    access: Access

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer without FastAPI's telemetry, which is off."""
        scope["app"] = self
        if self.middleware_stack is None or scope["type"] == "lifespan":
            await super().__call__(scope, receive, send)
        else:
            await self.middleware_stack(scope, receive, send)

    def build_middleware_stack(self) -> ASGIApp:
        """Put the ids around everything, the answer to a fault of the gateway itself included."""
        plant, server = self.plant, self.plant.config.server
        origins, journal = server.allowed_origins, plant.journal
        routes = RouteIndex(self.router.routes, self.router)
        keys = Keys(plant, journal) if journal else None
        idempotent = partial(IdempotentRequests, keys, self.access, routes) if keys else None
        entrance = Entrance(
            SameSite(server.names, origins, server.client_networks),
            routes,
            self.exception_handlers,
            for_pages=open_to(origins) if origins else None,
            idempotent=idempotent,
        )
        stack = RequestIds(entrance, self.state.traffic)
        return Proxies(stack, server) if Proxies.concern(server) else stack

    def openapi(self) -> dict[str, Any]:
        """Describe the routes, once, as generators of clients need it, and the key that they take."""
        made = self.openapi_schema is not None
        for route in self.routes if not made else ():
            if isinstance(route, HttpRoute):
                route.build()
        with catch_warnings():  # FastAPI does so where models are built at once
            simplefilter("ignore", UnsupportedFieldAttributeWarning)
            schema = super().openapi()
        if not made:
            schemas.complete(schema)
            schema["paths"] = dict(sorted(schema["paths"].items(), key=place_of))
            schema["components"]["securitySchemes"] = {"key": _KEY}
            schema["security"] = [{"key": []}]
        return schema


_KEY: Final = {
    "type": "http",
    "scheme": "bearer",
    "description": "A key of `motion-gateway keys create`, or a token of the OpenID provider in the "
    "configuration. Browsers that have signed in need none.",
}


def create_app(
    plant: Plant, credentials: Credentials | None = None, besides: Iterable[Operation] = ()
) -> Application:
    """Make the application, with operations of its own `besides`. The server starts and closes the plant.

    Without credentials no caller gets in, unless the configuration lets every caller in.
    """
    root_path = plant.config.server.root_path
    app = Application(
        title="motion-gateway",
        version=VERSION,
        description=DESCRIPTION,
        # Its own would be made anew at every request.
        openapi_url=None,
        docs_url=None,
        redoc_url=None,
        separate_input_output_schemas=False,
        redirect_slashes=False,
        servers=[{"url": root_path}] if root_path else None,
        # What matters is counted and recorded at the lines.
        telemetry={"tracing": False, "metrics": False, "logs": False},
    )
    app.plant = plant
    plant.access.credentials = credentials or plant.access.credentials
    app.access = Access(plant)
    app.state.traffic = traffic = Traffic()
    app.state.metrics = metrics_of(plant, traffic)
    problems.install(app, partial(calls_for, plant))
    written = [route for router in (*by_hand.ROUTERS, streams.router) for route in router.routes]
    operations = [*operations_of(map(type, plant.packages.registered)), *besides]
    rows = walker.routes(operations, [route for route in written if isinstance(route, HttpRoute)])
    # Side by side instead of included, so that one index finds them all; and before the docs.
    app.router.routes[:0] = [*rows, *(route for route in written if not isinstance(route, HttpRoute))]
    documents.install(app, root_path)
    console.install(app)
    manual.install(app)
    app.routes.extend(sign_in.routes())
    app.router.default = _nowhere
    for route in app.routes:
        if isinstance(route, StrictRoute) and route.right is Right.STOP:
            route.call.prepare()  # no stop waits for it
    if bare := list(unguarded(app.routes)):
        raise TypeError(f"Routes without a right: {bare}")
    return app


async def _nowhere(scope: Scope, _receive: Receive, _send: Send) -> None:
    """Answer as to every request, where a WebSocket would only be closed; without a good key 401 says all."""
    access: Access = scope["app"].access
    with access.require(scope, Right.VIEW, any_scope=True):
        raise HTTPException(404)
