"""A plant whose line leads into a simulated Fics, on virtual time."""

import asyncio
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass
from random import Random

from gateway.config import parse
from gateway.core.events import Event
from gateway.core.move_record import START_WITHIN_S
from gateway.fics.move_record import RobotMove
from gateway.fics.robot import Robot
from protocols.fics.row import FicsCommand
from protocols.table import Ack
from simulator.faults import Direction, Fault, Switch
from simulator.fics.layout import Layout
from simulator.fics.line import LineSettings, SimulatedFics, build_line
from simulator.fics.robot import Robot as SimulatedRobot
from simulator.truth import Fact
from tests.open_access import OPEN
from tests.simulated_line import SimulatedCable
from tests.tested_plant import TestedPlant

SET_UP_S = 1.0
"""More than a line needs to be ready."""

COPY_GAP_S = 0.01
"""Seconds from a copy of an earlier answer to the answer itself."""

SCARA = '{number = 1, axes = ["X", "Y", "Z"], motor_axes = ["A", "B", "Z"]}'
CARTESIAN = '{number = 2, axes = ["X", "Y", "Z"]}'


class Cable(SimulatedCable):
    """The wire to a simulated Fics."""

    machine: SimulatedFics

    def __init__(self, machine: SimulatedFics, baud: int | None = None) -> None:
        super().__init__(machine, baud)
        self.lost_command = self.lost_answer = ""
        """Beginning of the texts that are lost on the way, every time."""
        self.lost_once = ""
        """Beginning of the text that is lost on its way to the robot, the next time."""
        self._awaited: tuple[str, asyncio.Future[None]] | None = None
        self._arrived = 0
        self._then: dict[int, Callable[[], object]] = {}
        self.damaged: dict[str, str] = {}
        """Text that arrives in the place of a command."""
        self.misread: dict[str, str] = {}
        """Text that arrives in the place of an answer, the next time it comes."""
        self.copies: list[bytes] = []
        """Come right before the next answers, one before each."""
        self.stuck = False
        """The far end takes nothing more, as a full dual-port RAM."""
        self.broken = False
        """Nothing arrives either way, and neither port notices: a serial cable that was pulled."""

    async def written_from(self, beginning: str) -> None:
        """Wait until a frame is written that begins so."""
        self._awaited = beginning, asyncio.get_running_loop().create_future()
        await self._awaited[1]

    def after(self, frames: int, deed: Callable[[], object]) -> None:
        """Do something when `frames` more frames have arrived, and their answers are on the way."""
        if frames:
            self._then[self._arrived + frames] = deed
        else:
            deed()

    def write(self, data: bytes) -> None:
        super().write(data)
        if self._awaited and data.startswith(self._awaited[0].encode()) and not self._awaited[1].done():
            self._awaited[1].set_result(None)

    def _arrive(self, data: bytes) -> None:
        if self.broken:
            return
        if self.lost_once and data.startswith(self.lost_once.encode()):
            self.lost_once = ""
        elif not self.lost_command or not data.startswith(self.lost_command.encode()):
            text = data.decode("ascii").rstrip("\r")
            super()._arrive(self.damaged[text].encode("ascii") + b"\r" if text in self.damaged else data)
        self._arrived += 1
        self._then.pop(self._arrived, int)()

    def _deliver(self, data: bytes) -> None:
        if self.broken:
            return
        if self.copies:
            super()._deliver(self.copies.pop(0))
            asyncio.get_running_loop().call_later(COPY_GAP_S, self._deliver, data)
            return
        for text in [answer for answer in self.misread if answer.encode("ascii") in data]:
            data = data.replace(text.encode("ascii"), self.misread.pop(text).encode("ascii"))
        if not self.lost_answer or not data.startswith(self.lost_answer.encode()):
            super()._deliver(data)

    def unsent(self) -> int:
        return int(self.stuck)

    def say(self, text: str) -> None:
        """Let a line come without a question."""
        super()._deliver(text.encode("ascii") + b"\r")

    def turn(self) -> None:
        """Let the machine say what it has to say, after it was touched by hand."""
        self._turn()

    def frames(self, after: int = 0) -> list[str]:
        """The frames sent, without CR, from a number on."""
        return [data.decode("ascii").rstrip("\r") for data in self.written[after:]]


@dataclass
class FicsRig:
    """A running plant with one robot, and what stands behind its line."""

    plant: TestedPlant
    cable: Cable

    @property
    def robot(self) -> Robot:
        return self.plant.robots()[0]

    @property
    def machine(self) -> SimulatedFics:
        return self.cable.machine

    @property
    def fics(self) -> SimulatedRobot:
        return self.machine.robot

    def touch(self, change: Callable[[SimulatedRobot, float], object]) -> None:
        """Change the world of the robot and let it look."""
        now = asyncio.get_running_loop().time()
        change(self.fics, now)
        self.machine.look_after(now)
        self.cable.turn()

    def edit(self, on: bool) -> None:
        """Begin or end editing at the teaching terminal, state (b)."""
        self.touch(lambda fics, _: setattr(fics, "editing", on))

    def power_cycle(self) -> None:
        """Switch the robot off and on."""
        now = asyncio.get_running_loop().time()
        self.machine.power_off(now)
        self.machine.power_on(now)
        self.cable.turn()

    def brown_out(self, for_s: float) -> None:
        """Take the robot's power away for a while."""
        self.machine.brown_out(asyncio.get_running_loop().time(), for_s)
        self.cable.turn()

    def fail(
        self, fault: Fault, direction: Direction, frames: int = 1, delay_s: float = 0.1, after: int = 0
    ) -> None:
        """Let a fault hit the next frames, after `after` others have passed."""
        self.machine.faults.set(
            Switch(fault, direction, next_frames=frames, delay_s=delay_s, pass_frames=after)
        )

    def lose_replies(self, frames: int = 1) -> None:
        """The next answers are lost on their way."""
        self.fail(Fault.LOST, Direction.REPLIES, frames)

    def spoil(self, probability: float) -> None:
        """Let faults hit frames either way by chance; no answer is garbled, for none has a checksum."""
        for fault in (Fault.LOST, Fault.GARBLED, Fault.NOISE, Fault.LATE, Fault.DOUBLED, Fault.SPLIT):
            for direction in Direction:
                if (fault, direction) != (Fault.GARBLED, Direction.REPLIES):
                    self.machine.faults.set(Switch(fault, direction, probability=probability, delay_s=0.3))

    async def start(
        self, command: FicsCommand[Ack], unit: int = 1, start_within_s: float = START_WITHIN_S
    ) -> RobotMove:
        """Start a move."""
        moves = self.plant.robot_moves
        return await moves.start(self.robot, self.robot.unit(unit), command, start_within_s)

    async def move(self, command: FicsCommand[Ack], unit: int = 1) -> RobotMove:
        """Make a move and wait for its end."""
        started = await self.start(command, unit)
        return await self.plant.robot_moves.wait(started.id, 600.0)

    def events(self, prefix: str = "") -> list[Event]:
        """Events published so far."""
        hub = self.plant.events
        found = (hub.event(number) for number in range(hub.first, hub.last + 1))
        return [event for event in found if event.type.startswith(prefix)]

    def types(self, prefix: str = "") -> list[str]:
        """The types of what has been published so far."""
        return [event.type for event in self.events(prefix)]

    def heard(self, name: str) -> list[str]:
        """The commands of a name that the robot has heard."""
        return [text for text in self._texts() if text.startswith(name)]

    def stops(self) -> list[Fact]:
        """The ends of the robot's motions."""
        return self.machine.truth.of("motion_stop")

    def _texts(self) -> list[str]:
        return [str(fact.facts["text"]) for fact in self.machine.truth.of("command")]


@asynccontextmanager
async def fics_rig(
    *,
    units: int = 1,
    there: int | None = None,
    mode: int = 3,
    baud: int | None = None,
    settings: LineSettings | None = None,
    prepare: Callable[[SimulatedFics], object] = lambda _: None,
    options: str = "",
    bits: str = "",
    seed: int = 0,
    more: str = "",
) -> AsyncIterator[FicsRig]:
    """Start a plant and wait until its line is ready; `prepare` may touch the robot before.

    It has as many units as are configured, or those that are `there`.
    """
    tables = ", ".join([SCARA, CARTESIAN][:units])
    config = parse(
        f'[[lines]]\nid = "cell"\naddress = "tcp://127.0.0.1:1"\nprotocol = "fics"\nmode = {mode}\n'
        f'robot = {{id = "r1", units = [{tables}]{bits}}}\n{options}{OPEN}{more}',
        "test.toml",
    )
    machine = build_line(Layout(units=there or units), settings=settings, seed=seed)
    prepare(machine)
    cable = Cable(machine, baud)
    plant = TestedPlant(config, open_transport=lambda _: cable, rng=Random(0))
    await plant.start()
    try:
        await asyncio.sleep(SET_UP_S)
        yield FicsRig(plant, cable)
    finally:
        await plant.close()
