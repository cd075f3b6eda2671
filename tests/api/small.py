"""A gateway of one body on no line, with rows of a test besides its own, and a client that asks it."""

from collections.abc import Iterable

from starlette.testclient import TestClient

from api.app import create_app
from gateway.config import Config
from gateway.core.operation import Operation
from gateway.plant import Plant

LINE = {"id": "arm", "address": "tcp://127.0.0.1:1", "bodies": [{"id": "3F"}]}
HERE = "http://127.0.0.1"


def small_plant(**access: object) -> Plant:
    """A plant that was not started."""
    return Plant(Config.model_validate({"access": access, "lines": [LINE]}))


def client_of(rows: Iterable[Operation]) -> TestClient:
    """A client of a gateway that has these rows, too, and lets everybody in."""
    app = create_app(small_plant(mode="open"), besides=rows)
    return TestClient(app, base_url=HERE, raise_server_exceptions=False)
