"""A gateway over a simulated robot in virtual time, with an HTTP client in front of it."""

from collections.abc import Callable, Coroutine
from dataclasses import dataclass
from typing import Any

import httpx2
from httpx2 import ASGITransport, AsyncClient

from api.app import Application, create_app
from tests.api.stand import HOST
from tests.fics_plants import FicsRig, fics_rig
from tests.virtual_time import run_virtual

UNIT = "/robots/r1/units/1"
HOME = {"kind": "home"}


def mm(**places: float) -> dict[str, object]:
    """Coordinates or amounts in millimetres."""
    return {axis: {"value": value, "unit": "mm"} for axis, value in places.items()}


@dataclass
class Cell:
    """All that a story needs."""

    rig: FicsRig
    app: Application
    client: AsyncClient

    async def post(self, path: str, content: object = None, **headers: str) -> httpx2.Response:
        return await self.client.post(path, json=content, headers=headers)

    async def get(self, path: str, **headers: str) -> httpx2.Response:
        return await self.client.get(path, headers=headers)

    async def put(self, path: str, content: object) -> httpx2.Response:
        return await self.client.put(path, json=content)

    async def move(self, content: object, unit: int = 1) -> dict[str, Any]:
        """Make a move that must succeed."""
        answer = await self.post(f"/robots/r1/units/{unit}/moves?wait=60", content)
        move = dict(answer.json())
        assert (answer.status_code, move.get("status")) == (200, "succeeded"), answer.text
        return move

    def commands(self) -> list[str]:
        """Commands that the robot has heard, without the gateway's own questions."""
        own = ("MOD", "UNT", "ACD", "ERR", "ERD", "APS", "MPS", "VER", "POF 2")
        return [text for text in self.rig.heard("") if not text.startswith(own)]


Story = Callable[[Cell], Coroutine[Any, Any, None]]


def in_cell(units: int = 2, mode: int = 3, options: str = "") -> Callable[[Story], Callable[[], None]]:
    """Turn a story about a robot into a test that runs it in virtual time."""

    def as_test(story: Story) -> Callable[[], None]:
        def test() -> None:
            async def run() -> None:
                async with fics_rig(units=units, mode=mode, options=options) as rig:
                    app = create_app(rig.plant)
                    transport = ASGITransport(app, raise_app_exceptions=False)
                    async with AsyncClient(transport=transport, base_url=f"http://{HOST}") as client:
                        await story(Cell(rig, app, client))

            run_virtual(run())

        return test

    return as_test
