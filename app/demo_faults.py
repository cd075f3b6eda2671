"""Troubles of the demo, to be met before a plant has them: each lasts until all are ended."""

import errno
import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Final, Literal, get_args

from pydantic import BaseModel, Field

from gateway.core.errors import NotFound
from gateway.core.journal.disk import NotWritable, SqliteDisk
from gateway.core.journal.writes import Write
from gateway.core.operation import Rows
from gateway.core.records import RequestModel, example
from gateway.core.rights import Right
from simulator.control import Touchable
from simulator.fics.line import SimulatedFics
from simulator.fics.troubles import OF_ROBOTS, break_robot
from simulator.rorze.line import Rc400Line
from simulator.rorze.troubles import OF_BODIES, break_body, pull_cable

Kind = Literal["ems", "limit", "power", "cable", "driver", "dead", "disk"]
Mend = Callable[[], object]
GATEWAY: Final = "gateway"
"""The target of a full disk."""
_TITLES: Final[dict[Kind, str]] = {
    "ems": "The stop circuit is open (EMS, stop input): what moves stops, and no move begins.",
    "limit": "The CW limit sensor is on: a move that way stops, or does not begin.",
    "power": "The power is cut; it returns when the fault is ended.",
    "cable": "The cable to the controllers is pulled.",
    "driver": "The motor has lost steps (STALL), or its driver reports an error.",
    "dead": "The controller is silent: it lives on, and nothing reaches it.",
    "disk": "The disk of the journal is full.",
}


class FaultKind(BaseModel):
    """A fault that the demo can have, and its possible targets."""

    kind: Kind
    title: str
    targets: list[str] = Field(description="Addresses of bodies, lines and robots, or `gateway`.")


class DemoFault(BaseModel):
    """Something that is broken now."""

    kind: Kind
    target: str
    since: datetime


class Faults(BaseModel):
    """Faults that the demo can have, and the present ones."""

    kinds: list[FaultKind]
    faults: list[DemoFault]


class FaultRequest(RequestModel, json_schema_extra=example(kind="ems", target="line1.3F")):
    """A fault to cause, and its target."""

    kind: Kind
    target: str | None = Field(
        default=None, max_length=64, description="One of the kind's targets; left out, the first."
    )


class FillableDisk(SqliteDisk):
    """The journal's disk, which has no room while `is_full`: what is written then fails as on a full disk."""

    is_full = False

    def commit(self, writes: Sequence[Write], *, durable: bool) -> None:
        """Write all or nothing."""
        if self.is_full:
            raise NotWritable(f"{self.path}: {os.strerror(errno.ENOSPC)}")
        super().commit(writes, durable=durable)


@dataclass(frozen=True)
class SimulatedPlant:
    """The machines of the demo, and where each can be touched while it runs."""

    line: Rc400Line
    line_port: Touchable
    robot: SimulatedFics
    robot_port: Touchable


class DemoFaults:
    """All that can be broken in the demo."""

    def __init__(self, plant: SimulatedPlant, line_id: str, robot_id: str) -> None:
        self._places = dict(self._listed(plant, line_id, robot_id))
        self._standing: dict[tuple[Kind, str], tuple[DemoFault, Mend]] = {}
        self._disk: FillableDisk | None = None

    def open_disk(self, directory: Path) -> SqliteDisk:
        """Open the journal's disk of a directory as one that can be filled; errors as of `SqliteDisk`."""
        self._disk = FillableDisk(directory)
        return self._disk

    def rows(self) -> Rows:
        """Give the operations of the demo, which no other gateway has."""
        rows = Rows("demo")

        @rows.get("/demo/faults")
        async def list_demo_faults() -> Faults:
            """List what can be broken in the demo, and what is broken now."""
            return self.all()

        @rows.post("/demo/faults", Right.OPERATE, leased=False)
        async def begin_demo_fault(wanted: FaultRequest) -> DemoFault:
            """Break something in the demo until all faults are ended. One that stands goes on as it is."""
            return self.begin(wanted.kind, wanted.target)

        @rows.delete("/demo/faults", Right.OPERATE, leased=False)
        async def end_demo_faults() -> Faults:
            """End all faults of the demo. Their consequences, such as an alarm, are left to be seen to."""
            self.end()
            return self.all()

        return rows

    def all(self) -> Faults:
        """Tell what can be broken, and what is."""
        kinds = [
            FaultKind(kind=kind, title=_TITLES[kind], targets=self._targets(kind)) for kind in get_args(Kind)
        ]
        return Faults(kinds=kinds, faults=[fault for fault, _ in self._standing.values()])

    def begin(self, kind: Kind, target: str | None) -> DemoFault:
        """Break something, unless it is broken so already.

        :raises NotFound: there is no such target; nothing was broken.
        """
        key = kind, self._target(kind, target)
        if key not in self._standing:
            fault = DemoFault(kind=kind, target=key[1], since=datetime.now(UTC))
            self._standing[key] = fault, self._places[key]()
        return self._standing[key][0]

    def end(self) -> None:
        """Mend everything, the latest first."""
        while self._standing:
            _, (_, mend) = self._standing.popitem()
            mend()

    def _targets(self, kind: Kind) -> list[str]:
        return [target for other, target in self._places if other == kind]

    def _target(self, kind: Kind, wanted: str | None) -> str:
        """Find a target; the cable of a body is that of its line, and there is one disk."""
        targets = self._targets(kind)
        if wanted is None or kind == "disk":
            return targets[0]
        spoken = wanted.partition(".")[0] if kind == "cable" else wanted
        for target in targets:
            if target.casefold() == spoken.casefold():
                return target
        raise NotFound(
            f"Nothing was broken: {kind} is no fault of {wanted}.", f"Name one of {', '.join(targets)}."
        )

    def _listed(
        self, plant: SimulatedPlant, line_id: str, robot_id: str
    ) -> Iterator[tuple[tuple[Kind, str], Callable[[], Mend]]]:
        """Say how each fault of each target begins; what that gives ends it."""
        kinds: tuple[Kind, ...] = get_args(Kind)
        for kind in kinds:
            for body in plant.line.axes if kind in OF_BODIES else ():
                deed = partial(break_body, plant.line, body, kind)
                yield (kind, f"{line_id}.{body:02X}"), partial(_begin, plant.line_port, deed)
            if kind == "cable":
                yield (kind, line_id), partial(_begin, plant.line_port, partial(pull_cable, plant.line))
            if kind in OF_ROBOTS:
                deed = partial(break_robot, plant.robot, kind)
                yield (kind, robot_id), partial(_begin, plant.robot_port, deed)
        yield ("disk", GATEWAY), self._fill_disk

    def _fill_disk(self) -> Mend:
        if self._disk is None:
            raise NotFound("Nothing was broken: this gateway has no journal.")
        self._disk.is_full = True
        return partial(setattr, self._disk, "is_full", False)


def _begin(port: Touchable, deed: Callable[[float], Callable[[float], object]]) -> Mend:
    """Break a machine while it runs."""
    mend = port.touch(deed)
    return lambda: port.touch(mend)
