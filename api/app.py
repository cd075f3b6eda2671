"""The web application: the route of all rows over one plant, and what stands beside it."""

from collections.abc import Iterable
from functools import partial
from typing import Any

from starlette.applications import Starlette
from starlette.exceptions import HTTPException
from starlette.types import ASGIApp, Receive, Scope, Send

from api import manual, sign_in, streams
from api.common.access import Access
from api.common.entrance import Entrance, open_to
from api.common.idempotent_requests import IdempotentRequests
from api.common.problems import tellings
from api.common.proxies import Proxies
from api.common.request_ids import RequestIds
from api.common.routes import unguarded
from api.common.security import SameSite
from api.console import pages as console
from api.front import documents
from api.walker import Walker
from gateway.door.admission import Credentials
from gateway.door.keys import Keys
from gateway.door.opening import Plant
from gateway.door.remedies import calls_for
from gateway.door.system import VERSION
from gateway.door.table import Operation, Right, operations_of
from gateway.door.traffic import Traffic


class Application(Starlette):
    """An application that gives each request an id before anything can go wrong with it."""

    def __init__(self, plant: Plant, rows: Walker) -> None:
        super().__init__(routes=[rows, *streams.SOCKETS])
        self.plant, self.rows = plant, rows
        self.access = Access(plant)
        self.traffic = Traffic()
        self.router.redirect_slashes = False
        self.router.default = _nowhere

    def build_middleware_stack(self) -> ASGIApp:
        """Put the ids around everything, the answer to a fault of the gateway itself included."""
        plant, server = self.plant, self.plant.config.server
        origins = server.allowed_origins
        keys = Keys(plant, plant.journal) if plant.journal else None
        entrance = Entrance(
            SameSite(server.names, origins, server.client_networks),
            self.rows,
            self.router,
            tellings(partial(calls_for, plant)),
            for_pages=open_to(origins) if origins else None,
            idempotent=partial(IdempotentRequests, keys, self.access, self.rows) if keys else None,
        )
        stack = RequestIds(entrance, self.traffic)
        return Proxies(stack, server) if Proxies.concern(server) else stack

    def openapi(self) -> dict[str, Any]:
        """Describe all rows; what is served was described when the gateway was built."""
        from api.described import document

        rows = [row.operation for row in self.rows.routes]
        return document(rows, VERSION, self.plant.config.server.root_path)


def create_app(
    plant: Plant, credentials: Credentials | None = None, besides: Iterable[Operation] = ()
) -> Application:
    """Make the application, with operations of its own `besides`. The server starts and closes the plant.

    Without credentials no caller gets in, unless the configuration lets every caller in.
    """
    plant.access.credentials = credentials or plant.access.credentials
    rows = Walker([*operations_of(map(type, plant.packages.registered)), *besides])
    rows.prepare()
    app = Application(plant, rows)
    documents.install(app, plant.config.server.root_path)
    console.install(app)
    manual.install(app)
    app.routes.extend(sign_in.routes())
    if bare := list(unguarded(app.routes[1:])):
        raise TypeError(f"Routes without a right: {bare}")
    return app


async def _nowhere(scope: Scope, _receive: Receive, _send: Send) -> None:
    """Answer as to every request, where a WebSocket would only be closed; without a good key 401 says all."""
    access: Access = scope["app"].access
    with access.require(scope, Right.VIEW, any_scope=True):
        raise HTTPException(404)
