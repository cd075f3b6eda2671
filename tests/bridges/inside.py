"""A gateway that a bridge asks within its own process: an application without a network."""

import httpx
from motion_gateway_client import AsyncGateway

from api.app import Application
from bridges.common.callers import Doors
from bridges.common.settings import GatewayTable
from tests.api.stand import HOST


class DoorsInside(Doors):
    """Open to an application without a network."""

    def __init__(self, app: Application) -> None:
        super().__init__(GatewayTable(url=f"http://{HOST}"))
        self._app = app

    def open(self, key: str | None, language: str | None = None) -> AsyncGateway:
        transport = httpx.ASGITransport(self._app)
        headers = {"Accept-Language": language} if language else None
        http = httpx.AsyncClient(transport=transport, base_url=f"http://{HOST}", headers=headers)
        return AsyncGateway(key=key, http=http)
