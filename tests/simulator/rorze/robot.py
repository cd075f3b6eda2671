"""A SCARA robot on the test bench: a controller an axis, one clock, commands to all of them at once."""

from collections.abc import Iterator, Sequence

from protocols.rorze.link import MoveEnded
from protocols.rorze.profile import TICK_S
from protocols.rorze.scara import BeltLinked, FingerPlace, Mechanics, ThreeAxes
from simulator.rorze.controller import Rc420
from simulator.truth import TruthLog

THREE_AXES = ThreeAxes(215_000, 330_000, (121_791.045, 60_000.0, 100_000.0))
"""The robot of RC-420 manual 13.10.7."""
BELTS = BeltLinked(156_000, 208_000, (98_765.0, 99_000.0))
"""The robot of RC-420 manual 13.10.11."""

SPEEDS = (
    "OLSS[3],1000",
    "OHSS[3],1000000",
    "OSSS[3],5000000",
    "OASS[3],50",
    "OBSS[3],50",
    "SPSA[3],A:S[3],D:S[3]",
)
"""Speeds of RC-420 manual 13.10.3, as pattern 3."""


class RobotBench:
    def __init__(
        self, robot: Mechanics = THREE_AXES, at: Sequence[int] = (-10_149, -10_000, -16_666)
    ) -> None:
        self.now = 0.0
        self.robot = robot
        self.truth = TruthLog()
        self.axes = [Rc420(body, 0.0, self.truth) for body in range(2, 2 + robot.axes)]
        self.sent(f"HTS{int(robot.axes == 2)}", f"HAS{robot.link}", f"HFS{robot.finger}", *SPEEDS)
        for number, (axis, pulses) in enumerate(zip(self.axes, at, strict=False)):
            self.sent(f"HZS{number},{robot.pulses_per_turn[number]:.3f}")
            axis.execute(f"HCS{number}", self.now)
            axis.execute(f"6PS{pulses}", self.now)

    def send(self, text: str) -> list[str]:
        """A command to all controllers; what follows the code in their replies."""
        return [axis.execute(text, self.now).payload for axis in self.axes]

    def sent(self, *texts: str) -> None:
        """Commands that all must accept."""
        for text in texts:
            assert self.send(text) == [""] * len(self.axes), text

    def tell_positions(self) -> None:
        """As a host does before each move: 6PD and HPS."""
        for number, pulses in enumerate(self.positions()):
            self.sent(f"HPS{number},{pulses}")

    def positions(self) -> tuple[int, ...]:
        """Where the axes stand."""
        return tuple(axis.position(self.now) for axis in self.axes)

    def place(self) -> FingerPlace:
        """Where the finger ends."""
        return self.robot.place(self.positions())

    def end(self) -> complex:
        return complex(*self.place()[:2])

    def start(self, preparation: str) -> None:
        """A move, as the manual says: positions, preparation, HMM."""
        self.tell_positions()
        self.sent(preparation, "HMM")

    def wait(self, seconds: float) -> None:
        self.now += seconds
        for axis in self.axes:
            axis.advance(self.now)

    def ticks(self) -> Iterator[float]:
        """Let time go on tick by tick until nothing moves: the moments, from now on."""
        yield self.now
        while any(axis.motor.moving for axis in self.axes):
            self.wait(TICK_S)
            yield self.now

    def until_end(self) -> list[int]:
        """Let the moves end: the end causes of the axes that have moved."""
        for _ in self.ticks():
            pass
        return [ended.cause for ended in self.ends()]

    def ends(self) -> list[MoveEnded]:
        """The moves that have ended since the last call, in the order of the axes."""
        frames = [message.frame for axis in self.axes for message in axis.take_messages()]
        return [frame for frame in frames if isinstance(frame, MoveEnded)]

    def pulse_um(self) -> float:
        """Micrometres by which a pulse of the coarsest axis moves the finger's end here."""
        here = self.positions()
        end = self.end()
        steps = []
        for number in range(len(here)):
            moved = [*here]
            moved[number] += 1
            place = self.robot.place(moved)
            steps.append(abs(complex(place.x, place.y) - end))
        return max(steps)
