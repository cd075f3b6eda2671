"""Where units of robots stand, and how inputs and outputs of robots are, for their watchers."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import ClassVar

from gateway.core.event_types import IO, Signal, Signals
from gateway.core.exchange import Lane
from gateway.core.live import Live
from gateway.core.sampler import IO_HZ, LiveSource
from gateway.fics.event_types import LiveAxis, RobotPosition
from gateway.fics.robot import Robot
from gateway.fics.units import RobotUnit
from protocols.fics.inputs_outputs import GetInputChannel, GetOutputChannel

CHANNEL = 1
"""The channel whose inputs and outputs are told. An assumption: no command tells the number of channels."""


@dataclass(eq=False)
class UnitSource(LiveSource):
    """Where a unit stands (APS).

    Another unit is not selected just to be watched: the terminal would show it (C-HOST manual 2-1).
    """

    robot: Robot
    unit: RobotUnit
    live: Live
    samples_hz: float = 0.0
    """Rate of the questions during a move, in Hz."""
    subject: str = field(init=False)
    type: ClassVar = "robot.position"

    def __post_init__(self) -> None:
        self.subject = f"/robots/{self.unit.address}"

    @property
    def own_hz(self) -> float:
        """While it moves, that of the samples which are kept with the move."""
        return 0.0 if self.unit.trajectory is None else self.samples_hz

    async def read(self, _: Sequence[LiveSource]) -> list[LiveSource]:
        """Ask, and put what was told."""
        if len(self.robot.units) > 1 and self.robot.known.unit.number != self.unit.number:
            return []
        places, at = await self.unit.position_at(lane=Lane.BACKGROUND)
        axes = {axis: LiveAxis(value=place, unit=self.unit.systems[axis]) for axis, place in places.items()}
        told = RobotPosition(unit=self.unit.number, coordinates="user", axes=axes)
        self.live.put(self.type, self.subject, told, at)
        return [self]


@dataclass(eq=False)
class ChannelSource(LiveSource):
    """The inputs and outputs of a robot (IDI, IDO)."""

    robot: Robot
    live: Live
    edges_hz: float = 0.0
    """Rate of the questions for the inputs while no client watches them, in Hz."""
    subject: str = field(init=False)
    type: ClassVar = IO
    most_hz: ClassVar = IO_HZ
    _inputs: int | None = field(default=None, init=False)
    """The inputs as they were last told."""

    def __post_init__(self) -> None:
        self.subject = f"/robots/{self.robot.id}"

    @property
    def own_hz(self) -> float:
        """That of the changes that are told as events."""
        return self.edges_hz

    async def read(self, _: Sequence[LiveSource]) -> list[LiveSource]:
        """Ask, put what was told, and tell what has changed; outputs only for watchers."""
        asking = self.robot.conversation
        asked = await asking.ask(GetInputChannel(channel=CHANNEL), lane=Lane.BACKGROUND)
        inputs = asked.replies[0].bits
        self._tell_edges(inputs)
        if not self.live.rate(self.type, self.subject):
            return [self]
        outputs = (await asking.ask(GetOutputChannel(channel=CHANNEL), lane=Lane.BACKGROUND)).replies[0].bits
        told = Signals(inputs=_signals(inputs), outputs=_signals(outputs))
        self.live.put(self.type, self.subject, told, asked.at)
        return [self]

    def _tell_edges(self, bits: int) -> None:
        """Publish the edges of the inputs; the first reading is no edge."""
        changed = 0 if self._inputs is None else self._inputs ^ bits
        self._inputs = bits
        for number in (bit for bit in range(8) if changed >> bit & 1):
            edge = {"channel": CHANNEL, "number": number, "on": bool(bits >> number & 1)}
            self.robot.publish("robot.input.changed", edge)


def _signals(bits: int) -> list[Signal]:
    return [Signal(channel=CHANNEL, number=bit, on=bool(bits >> bit & 1)) for bit in range(8)]
