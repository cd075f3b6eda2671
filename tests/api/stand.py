"""A gateway over a simulated line in virtual time, with an HTTP and a WebSocket client in front of it."""

import asyncio
import json
from collections.abc import AsyncIterator, Callable, Coroutine, Mapping, Sequence
from contextlib import asynccontextmanager
from dataclasses import dataclass
from typing import Any, Final, Protocol

import httpx2
from httpx2 import ASGITransport, AsyncClient

from api.app import Application, create_app
from api.front.websocket_protocol import EVENTS
from gateway.access.credentials import Credentials
from gateway.config import Config
from gateway.core.events import Event
from simulator.rorze.line import build_line
from tests.open_access import OPEN_TABLE
from tests.plants import is_known
from tests.simulated_line import SimulatedLine, Unplugged
from tests.tested_plant import TestedPlant
from tests.virtual_time import run_virtual

HOST = "127.0.0.1:8420"
BODIES: Final[Sequence[Mapping[str, object]]] = [
    {"id": "00"},
    {"id": "01", "units": {"unit": "mm", "pulses_per_unit": 1000.0}},
    {"id": "3F"},
]
Bodies = Sequence[Mapping[str, object]]
NO_GROUPS: Final[Mapping[str, Bodies]] = {}
RELATIVE = {"kind": "relative", "direction": "cw", "distance": {"value": 50_000, "unit": "pulse"}}


@dataclass
class Stand:
    """All that a story needs."""

    plant: TestedPlant
    app: Application
    client: AsyncClient
    ports: dict[str, SimulatedLine]

    @property
    def port(self) -> SimulatedLine:
        return self.ports["arm"]

    def frames(self) -> list[str]:
        """Frames that were written to the line arm, without the bytes that clear it at its opening."""
        return [frame.decode("ascii").rstrip("\r") for frame in self.port.written if frame[:1] == b"&"]

    def moved(self) -> list[str]:
        """The motion commands that were written."""
        return [frame for frame in self.frames() if frame[5:6] == "M"]

    async def post(self, path: str, content: object = None, **headers: str) -> httpx2.Response:
        return await self.client.post(path, json=content, headers=headers)

    async def get(self, path: str, **headers: str) -> httpx2.Response:
        return await self.client.get(path, headers=headers)

    async def send(self, body: str, name: str, **parameters: object) -> dict[str, Any]:
        """Send a command that must be accepted."""
        answer = await self.post(f"/bodies/{body}/commands/{name}", parameters)
        assert answer.status_code in (200, 202), answer.text
        return dict(answer.json())

    async def teach_speeds(self, body: str) -> None:
        """Set the standard speed parameters, so that the body can move."""
        await self.send(body, "set-start-speed", speed=5_000)
        await self.send(body, "set-maximum-speed", speed=50_000)
        await self.send(body, "set-maximum-acceleration", acceleration=100_000)


Story = Callable[[Stand], Coroutine[Any, Any, None]]


@asynccontextmanager
async def build_stand(
    lines: Mapping[str, Bodies],
    server: Mapping[str, object],
    access: Mapping[str, object] = OPEN_TABLE,
    credentials: Credentials | None = None,
    groups: Mapping[str, Bodies] = NO_GROUPS,
    scaras: Sequence[Mapping[str, object]] = (),
) -> AsyncIterator[Stand]:
    """Start a plant of these lines and wait until they are ready."""
    now = asyncio.get_running_loop().time()
    addresses = {line: f"tcp://127.0.0.1:{number}" for number, line in enumerate(lines, start=1)}
    ports = {
        line: SimulatedLine(build_line([int(str(body["id"]), 16) for body in bodies], now))
        for line, bodies in lines.items()
    }
    tables = [
        {"id": line, "address": addresses[line], "bodies": lines[line], "groups": groups.get(line, [])}
        for line in lines
    ]
    made = {"scaras": scaras} if scaras else {}
    config = Config.model_validate({"server": server, "access": access, "lines": tables, **made})
    by_address = {addresses[line]: port for line, port in ports.items()}
    plant = TestedPlant(config, open_transport=lambda address: by_address.get(address) or Unplugged(address))
    ups = plant.events.subscribe(types=["line.up"])
    await plant.start()
    for _ in lines:
        await anext(ups)
    while any(body.online and not is_known(body) for body in plant.bodies()):  # noqa: ASYNC110  # no event tells it
        await asyncio.sleep(0.01)
    app = create_app(plant, credentials)
    transport = ASGITransport(app, raise_app_exceptions=False)
    async with AsyncClient(transport=transport, base_url=f"http://{HOST}") as client:
        yield Stand(plant, app, client, ports)
    await plant.close()


def on_stand(
    lines: Mapping[str, Bodies] | None = None, **server: object
) -> Callable[[Story], Callable[[], None]]:
    """Turn a story about a stand into a test that runs it in virtual time."""

    def as_test(story: Story) -> Callable[[], None]:
        def test() -> None:
            async def run() -> None:
                async with build_stand(lines or {"arm": BODIES}, server) as stand:
                    await story(stand)

            run_virtual(run())

        return test

    return as_test


class Served(Protocol):
    """Something with a gateway's app."""

    @property
    def app(self) -> Application: ...


class _Reading(asyncio.Event):
    """Set while a client reads; calls `on_set` when the client reads on."""

    on_set: Callable[[], None] = staticmethod(lambda: None)

    def set(self) -> None:
        super().set()
        self.on_set()


class Socket:
    """A WebSocket client that speaks ASGI straight to the app, with an outlet as the server has it."""

    def __init__(
        self, app: Application, target: str, subprotocols: Sequence[str], headers: Mapping[str, str]
    ) -> None:
        path, _, query = target.partition("?")
        self._scope = {
            "type": "websocket",
            "asgi": {"version": "3.0", "spec_version": "2.4"},
            "scheme": "ws",
            "path": path,
            "raw_path": path.encode(),
            "root_path": "",
            "query_string": query.encode(),
            "headers": [(name.lower().encode(), value.encode()) for name, value in headers.items()],
            "subprotocols": list(subprotocols),
            "extensions": {EVENTS: {"outlet": self}},
        }
        self._to_app: asyncio.Queue[dict[str, Any]] = asyncio.Queue()
        self._from_app: asyncio.Queue[dict[str, Any]] = asyncio.Queue()
        self._stuck = False
        self.reading = _Reading()
        self.reading.set()
        self.task = asyncio.create_task(app(self._scope, self._to_app.get, self._take))

    async def _take(self, message: Any) -> None:
        await self.reading.wait()
        await self._from_app.put(message)

    @property
    def takes(self) -> bool:
        return self.reading.is_set() or not self._stuck

    def write(self, batch: bytes) -> None:
        self._stuck = not self.reading.is_set()
        for text in batch.splitlines():
            self._from_app.put_nowait({"type": "websocket.send", "text": text.decode()})

    @staticmethod
    def writer(events: Sequence[Event]) -> bytes:
        return b"\n".join(event.json.encode() for event in events)

    @property
    def on_room(self) -> Callable[[], None]:
        return self.reading.on_set

    @on_room.setter
    def on_room(self, on_room: Callable[[], None]) -> None:
        self.reading.on_set = on_room

    async def message(self) -> dict[str, Any]:
        async with asyncio.timeout(10):
            return await self._from_app.get()

    async def event(self) -> dict[str, Any]:
        return dict(json.loads((await self.message())["text"]))

    async def say(self, message: dict[str, Any]) -> None:
        await self._to_app.put(message)


@asynccontextmanager
async def socket(
    served: Served,
    target: str,
    subprotocols: Sequence[str] = (),
    headers: Mapping[str, str] | None = None,
) -> AsyncIterator[Socket]:
    """Shake hands; the story reads what was answered to it."""
    client = Socket(served.app, target, subprotocols, {"Host": HOST, **(headers or {})})
    await client.say({"type": "websocket.connect"})
    try:
        yield client
    finally:
        client.reading.set()
        await client.say({"type": "websocket.disconnect", "code": 1000})
        await client.task
