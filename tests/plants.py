"""A plant whose lines lead into simulated link masters, on virtual time."""

import asyncio
import functools
import re
from collections.abc import AsyncIterator, Callable, Coroutine, Mapping, Sequence
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from random import Random
from typing import Any, NamedTuple, ParamSpec

from gateway.config import parse
from gateway.core.events import Event
from gateway.core.move_record import Move
from gateway.rorze.bodies import Body
from protocols.rorze.row import RorzeCommand
from protocols.table import Ack
from simulator.faults import Direction, Fault, Switch
from simulator.rorze.controller import Rc420
from simulator.rorze.line import Rc400Line, build_line
from simulator.rorze.rc400 import LinkSettings
from simulator.truth import Fact, TruthLog
from tests.open_access import OPEN
from tests.simulated_line import SimulatedLine
from tests.tested_plant import TestedPlant
from tests.virtual_time import run_virtual

P = ParamSpec("P")

SET_UP_S = 1.0
"""More than a line needs to be ready, at 9600 baud, too."""
BODIES = (0x00, 0x01, 0x3F)
GROUPS: Mapping[str, Sequence[str]] = {"80": ("00", "01")}


def in_virtual_time(story: Callable[P, Coroutine[Any, Any, None]]) -> Callable[P, None]:
    """Run an asynchronous test in virtual time."""

    @functools.wraps(story)
    def test(*args: P.args, **kwargs: P.kwargs) -> None:
        run_virtual(story(*args, **kwargs))

    return test


class Sent(NamedTuple):
    """A frame that the gateway has handed to the wire."""

    at: float
    frame: str


class Wire(SimulatedLine):
    """The simulated cable, with a clerk who notes when each frame began and that none began in another."""

    def __init__(self, machine: Rc400Line, baud: int | None = None) -> None:
        super().__init__(machine, baud)
        self.sent: list[Sent] = []
        self.heard: list[tuple[float, bytes]] = []
        self.deaf_to: re.Pattern[bytes] | None = None
        """Frames that are lost on their way to the gateway."""
        self.tx_free_at = 0.0
        self._awaited: tuple[str, asyncio.Future[None]] | None = None

    def write(self, data: bytes) -> None:
        now = asyncio.get_running_loop().time()
        assert now >= self.tx_free_at, f"{data!r} began {self.tx_free_at - now} s before the last frame's end"
        super().write(data)
        self.tx_free_at = now + len(data) * self.byte_time_s
        self.sent.append(Sent(now, data.decode("ascii").rstrip("\r")))
        if self._awaited and self._awaited[0] == self.sent[-1].frame and not self._awaited[1].done():
            self._awaited[1].set_result(None)

    def _deliver(self, data: bytes) -> None:
        self.heard.append((asyncio.get_running_loop().time(), data))
        super()._deliver(self.deaf_to.sub(b"", data) if self.deaf_to else data)

    def turn(self) -> None:
        """Let the machine say what it has to say, after it was touched by hand."""
        self._turn()

    async def begun(self, frame: str) -> None:
        """Wait for the moment in which a frame is handed to the wire."""
        self._awaited = frame, asyncio.get_running_loop().create_future()
        await self._awaited[1]

    def frames(self, after: int = 0) -> list[str]:
        """The frames sent, without CR, from a number on."""
        return [sent.frame for sent in self.sent[after:]]


class TerminalServer(Wire):
    """A box on the network that takes frames at once, and passes them on at the speed of its serial port."""

    is_bridged = True

    def __init__(self, machine: Rc400Line, baud: int | None = None) -> None:
        super().__init__(machine, baud)
        self.byte_time_s = 0.0
        self._passed_on_at = 0.0
        self.reached_again_at = 0.0
        """Time until which the network holds everything back, both ways."""

    def write(self, data: bytes) -> None:
        loop = asyncio.get_running_loop()
        self.sent.append(Sent(loop.time(), data.decode("ascii").rstrip("\r")))
        begins_at = max(loop.time(), self._passed_on_at, self.reached_again_at)
        self._passed_on_at = begins_at + len(data) * self._byte_time_s
        loop.call_at(self._passed_on_at, self._arrive, data)

    def _deliver(self, data: bytes) -> None:
        loop = asyncio.get_running_loop()
        if loop.time() < self.reached_again_at:
            loop.call_at(self.reached_again_at, self._deliver, data)
        else:
            super()._deliver(data)


@dataclass
class Rig:
    """A running plant and what stands behind its lines."""

    plant: TestedPlant
    wires: dict[str, Wire]
    machines: dict[str, Rc400Line] = field(init=False)

    def __post_init__(self) -> None:
        self.machines = {line: wire.machine for line, wire in self.wires.items()}

    @property
    def wire(self) -> Wire:
        """The wire of the first line."""
        return next(iter(self.wires.values()))

    @property
    def machine(self) -> Rc400Line:
        """The link master of the first line."""
        return next(iter(self.machines.values()))

    @property
    def truth(self) -> TruthLog:
        """The simulator's truth log of the first line."""
        return self.machine.truth

    def body(self, address: str = "3F") -> Body:
        """A body of the plant."""
        return self.plant.body(address)

    def axis(self, number: int = 0x3F) -> Rc420:
        """The simulated controller of a body of the first line."""
        return self.machine.axes[number]

    def touch(self, number: int, change: Callable[[Rc420], object]) -> None:
        """Change the world of an axis and let it look."""
        axis = self.axis(number)
        change(axis)
        axis.sense(asyncio.get_running_loop().time())
        self.machine.look_after(number)
        self.wire.turn()

    def events(self, prefix: str = "") -> list[Event]:
        """Events published so far."""
        hub = self.plant.events
        found = (hub.event(number) for number in range(hub.first, hub.last + 1))
        return [event for event in found if event.type.startswith(prefix)]

    def types(self, prefix: str = "") -> list[str]:
        """The types of what has been published so far."""
        return [event.type for event in self.events(prefix)]

    def executed(self, code: str, body: int | None = None) -> list[Fact]:
        """The commands of a code that the controllers have accepted."""
        return [
            fact
            for fact in self.truth.of("command", body)
            if str(fact.facts["text"]).startswith(code) and not str(fact.facts["reply"]).startswith("@")
        ]


def configuration(
    lines: Sequence[str] = ("line1",),
    bodies: Sequence[int] = BODIES,
    groups: Mapping[str, Sequence[str]] = GROUPS,
    options: str = "",
    body_options: str = "",
    server: str = "allow_endless_moves = true",
    more: str = "",
) -> str:
    """The TOML of a plant whose lines are all alike."""
    body_tables = ", ".join(f'{{id = "{body:02X}"{body_options and ", "}{body_options}}}' for body in bodies)
    group_tables = ", ".join(
        f'{{id = "{group}", members = {list(members)}}}' for group, members in groups.items()
    )
    tables = "\n".join(
        f'[[lines]]\nid = "{line}"\naddress = "tcp://127.0.0.1:{number + 1}"\n'
        f"bodies = [{body_tables}]\ngroups = [{group_tables}]\n{options}\n"
        for number, line in enumerate(lines)
    )
    return f"[server]\n{server}\n{tables}{OPEN}{more}"


@asynccontextmanager
async def rig(
    *,
    lines: Sequence[str] = ("line1",),
    bodies: Sequence[int] = BODIES,
    present: Sequence[int] | None = None,
    groups: Mapping[str, Sequence[str]] = GROUPS,
    baud: int | None = None,
    settings: LinkSettings | None = None,
    options: str = "",
    body_options: str = "",
    server: str = "allow_endless_moves = true",
    more: str = "",
    seed: int = 0,
    beginning: bool = False,
    wire: type[Wire] = Wire,
) -> AsyncIterator[Rig]:
    """Start a plant and wait until its lines are ready; `present` bodies answer, by default all.

    `beginning` gives it as it is at its start, when nothing is known of it yet.
    """
    config = parse(configuration(lines, bodies, groups, options, body_options, server, more), "test.toml")
    there = bodies if present is None else present
    wires = {
        line.address: wire(build_line(there, 0.0, settings=settings, seed=seed), baud)
        for line in config.lines
    }
    plant = TestedPlant(config, open_transport=wires.__getitem__, rng=Random(seed))
    running = Rig(plant, {line.id: wires[line.address] for line in config.lines})
    await plant.start()
    try:
        await asyncio.sleep(SET_UP_S)
        if beginning:
            yield running
            return
        while any(body.online and not is_known(body) for body in plant.bodies()):  # noqa: ASYNC110  # no event
            await asyncio.sleep(SET_UP_S)
        while any(line.state == "out_of_step" for line in plant.lines.values()):  # noqa: ASYNC110  # no event
            await asyncio.sleep(0.01)
        assert all(line.state == "ready" for line in plant.lines.values())
        yield running
    finally:
        await plant.close()


def is_known(body: Body) -> bool:
    """Say whether the gateway knows what the body does, and will notice a loss of its power."""
    power = body.power
    return body.told.position is not None and power.mark.is_written


# moves


async def start(rig: Rig, command: RorzeCommand[Ack], address: str = "3F") -> Move:
    """Start a move of one body."""
    [move] = await rig.plant.moves.start(rig.body(address), command)
    return move


async def finished(rig: Rig, command: RorzeCommand[Ack], address: str = "3F") -> Move:
    """Start a move of one body and wait for its end."""
    move = await start(rig, command, address)
    return await ended(rig, move)


async def ended(rig: Rig, move: Move) -> Move:
    """Wait for the end of a move."""
    over = await rig.plant.moves.wait(move.id, 120.0)
    assert over.status.final
    return over


def lose(rig: Rig, direction: Direction, frames: int = 1) -> None:
    """Lose the next frames on the wire."""
    rig.machine.faults.set(Switch(Fault.LOST, direction, next_frames=frames))


async def finished_losing(rig: Rig, command: RorzeCommand[Ack], direction: Direction) -> Move:
    """Start a move whose command or reply is lost, whatever is asked before it, and wait for its end."""
    body = rig.body()
    starting = asyncio.create_task(start(rig, command))
    await rig.wire.begun(body.line.frame_of(body.number, command).removesuffix("\\r"))
    lose(rig, direction)
    return await ended(rig, await starting)
