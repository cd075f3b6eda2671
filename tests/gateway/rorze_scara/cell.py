"""A plant with the robot of RC-420 manual 13.10.7, or with that of 13.10.11, on virtual time."""

import asyncio
from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager
from dataclasses import dataclass
from typing import Any, Final

from pydantic import TypeAdapter

from gateway.rorze_scara import geometry
from gateway.rorze_scara.extension import Scaras
from gateway.rorze_scara.moves import ScaraMoves
from gateway.rorze_scara.record import ScaraMove
from gateway.rorze_scara.requests import ScaraMoveRequest
from gateway.rorze_scara.scara import Scara
from protocols.rorze.position import SetPosition
from protocols.rorze.profile import TICK_S
from protocols.rorze.scara import FingerPlace
from simulator.rorze.rc400 import LinkSettings
from tests.plants import Rig, rig
from tests.simulator.rorze.robot import SPEEDS

SCARA: Final = """
[[scaras]]
id = "wafer"
line = "line1"
group = "8A"
members = ["02", "03", "04"]
arm_um = 215000
finger_um = 330000
pulses_per_turn = [121791.045, 60000.0, 100000.0]
"""
BELTS: Final = """
[[scaras]]
id = "wafer"
line = "line1"
group = "8A"
members = ["02", "03"]
arm_um = 156000
finger_um = 208000
pulses_per_turn = [98765.0, 99000.0]
"""
START: Final = (-10_149, -10_000, -16_666)
"""The finger's end at X 0, Y 115 mm, and the finger at 90 degrees (13.10.7)."""
TURNING: Final = (
    *("OLSS[4],50", "OHSS[4],50000", "OSSS[4],100000", "OASS[4],50", "OBSS[4],50"),
    "SPSA[4],A:S[4],D:S[4]",
)
"""Pattern 4, in pps, for axes that turn alone."""
SLOW: Final = (
    *("OLSS[5],1000", "OHSS[5],30000", "OSSS[5],200000", "OASS[5],50", "OBSS[5],50"),
    "SPSA[5],A:S[5],D:S[5]",
)
"""Pattern 5: 30 mm a second."""
_REQUESTS: Final[TypeAdapter[Any]] = TypeAdapter(ScaraMoveRequest)


@dataclass
class Cell:
    """The robot, its plant, and what is behind."""

    rig: Rig
    scara: Scara

    @property
    def moves(self) -> ScaraMoves:
        return self.rig.plant.family(Scaras).moves

    @property
    def numbers(self) -> list[int]:
        return [body.number for body in self.scara.members]

    async def teach(self) -> None:
        """Give the controllers their speeds and their geometry."""
        now = asyncio.get_running_loop().time()
        for number in self.numbers:
            for text in (*SPEEDS, *TURNING, *SLOW):
                assert self.rig.axis(number).execute(text, now).payload == "", text
        await geometry.write(self.scara, flash=False)

    async def put(self, *pulses: int) -> None:
        """Call the present positions so."""
        for body, position in zip(self.scara.members, pulses, strict=True):
            await body.ask(SetPosition(position=position))

    async def start(self, kind: str, **request: Any) -> ScaraMove:
        pattern = 4 if kind in ("finger", "align") else 3
        return await self.moves.start(self.scara, read(kind, **{"pattern": pattern, **request}))

    async def finished(self, kind: str, **request: Any) -> ScaraMove:
        return await self.ended(await self.start(kind, **request))

    async def ended(self, move: ScaraMove) -> ScaraMove:
        over = await self.moves.log.wait(move.id, 120.0)
        assert over.status.final
        return over

    def positions(self) -> list[int]:
        """Where the axes really stand, as the controllers count."""
        now = asyncio.get_running_loop().time()
        return [self.rig.axis(number).position(now) for number in self.numbers]

    def place(self) -> FingerPlace:
        """Where the finger really ends."""
        return self.scara.robot.place(self.positions())

    def moving(self) -> list[bool]:
        return [self.rig.axis(number).motor.moving for number in self.numbers]

    async def until_moving(self) -> None:
        while not any(self.moving()):  # noqa: ASYNC110  # virtual time
            await asyncio.sleep(TICK_S)

    async def ticks(self) -> AsyncIterator[FingerPlace]:
        """Where the finger ends at every tick of a move, to its end."""
        await self.until_moving()
        while any(self.moving()):
            yield self.place()
            await asyncio.sleep(TICK_S)

    def pulse_um(self) -> float:
        """Micrometres by which a pulse of the coarsest axis moves the finger's end here."""
        here, end = self.positions(), self.place()
        steps = []
        for axis in range(len(here)):
            moved = [*here]
            moved[axis] += 1
            place = self.scara.robot.place(moved)
            steps.append(abs(complex(place.x - end.x, place.y - end.y)))
        return max(steps)

    def switch(self, number: int, *, on: bool) -> None:
        """Cut or give the power of an axis."""
        self.rig.machine.switch_body(number, on=on, now=asyncio.get_running_loop().time())
        self.rig.wire.turn()

    def frames_of(self, code: str) -> list[str]:
        """Frames with a code that the robot's bodies and their group were sent."""
        return [frame for frame in self.frames() if frame[3:6] == code]

    def frames(self) -> list[str]:
        return self.rig.wire.frames()


def read(kind: str, **request: Any) -> Any:
    """A request as clients write it."""
    return _REQUESTS.validate_python({"kind": kind, **request}, strict=True)


def mm(value: float) -> dict[str, object]:
    return {"value": value, "unit": "mm"}


def deg(value: float) -> dict[str, object]:
    return {"value": value, "unit": "deg"}


@asynccontextmanager
async def cell(
    table: str = SCARA,
    start: Sequence[int] = START,
    *,
    extra: str = "",
    baud: int | None = None,
    settings: LinkSettings | None = None,
    seed: int = 0,
) -> AsyncIterator[Cell]:
    """A robot that knows its geometry and its speeds, and stands where it is told."""
    bodies = (0x02, 0x03, 0x04, 0x3F)[: 4 if table is SCARA else 3]
    async with rig(
        bodies=bodies, groups={}, more=table + extra, baud=baud, settings=settings, seed=seed
    ) as running:
        scara = running.plant.family(Scaras).find("wafer")
        cell = Cell(running, scara)
        await cell.teach()
        await cell.put(*start[: scara.robot.axes])
        yield cell
