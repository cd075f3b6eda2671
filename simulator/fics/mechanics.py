"""The motors of a unit: where they stand, and how they make its user axes move."""

from collections.abc import Sequence

from simulator.fics.axes import Motor
from simulator.fics.geometry import Geometry, Places
from simulator.truth import TruthLog


class Mechanics:
    """The moving part of a unit, for a command, a program or a JOG."""

    def __init__(
        self, number: int, geometry: Geometry, motors: Sequence[Motor], truth: TruthLog | None = None
    ) -> None:
        self.number = number
        self.geometry = geometry
        self.motors = tuple(motors)
        self.truth = truth or TruthLog()

    def at_rest(self) -> Places:
        """The coordinates of the motors, as they last stood."""
        return tuple(motor.at for motor in self.motors)

    def put(self, places: Places) -> None:
        """Let the motors stand there."""
        for motor, at in zip(self.motors, places, strict=True):
            motor.at = at
