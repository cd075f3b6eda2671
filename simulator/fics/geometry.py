"""How the motors of a unit make its user axes move: directly, or as the two arms of a miniSCARA."""

from dataclasses import dataclass
from math import atan2, cos, degrees, hypot, pi, radians, sin
from typing import Protocol

Places = tuple[float, ...]
"""One value for each axis of a unit, in its order."""


class OutOfReach(Exception):
    """No position of the motors takes the arms there."""


class Geometry(Protocol):
    """The conversion between motor axes and user axes (C-HOST manual 1-6)."""

    @property
    def converted(self) -> int:
        """The number of axes, the first ones, that are converted; the others are the same in both systems."""

    def to_user(self, motors: Places) -> Places:
        """Where the tool is."""

    def to_motors(self, user: Places) -> Places:
        """Where the motors must be.

        :raises OutOfReach: there is no such place.
        """


@dataclass(frozen=True, slots=True)
class Cartesian:
    """User axes and motor axes are the same."""

    converted: int = 0

    def to_user(self, motors: Places) -> Places:
        """The places of the motors themselves."""
        return motors

    def to_motors(self, user: Places) -> Places:
        """The places of the axes themselves."""
        return user


ARM_MM, FOREARM_MM = 150.0, 150.0
ELBOW_AT_ZERO = pi / 2
"""Assumptions: no manual gives the arms. Motor A turns the arm; motor B turns the forearm, which stands at
a right angle to the arm at zero degrees and never passes the stretched or the folded arm."""

ROUNDING = 1e-9
"""Rounding, as a cosine, by which a place on the edge of the arms' reach may seem to be beyond it."""


@dataclass(frozen=True, slots=True)
class MiniScara:
    """X and Y in mm from A and B in degrees; the axes after them are not converted."""

    converted: int = 2

    def to_user(self, motors: Places) -> Places:
        """Add up the arm and the forearm."""
        arm, elbow = radians(motors[0]), radians(motors[1]) + ELBOW_AT_ZERO
        x = ARM_MM * cos(arm) + FOREARM_MM * cos(arm + elbow)
        y = ARM_MM * sin(arm) + FOREARM_MM * sin(arm + elbow)
        return (x, y, *motors[2:])

    def to_motors(self, user: Places) -> Places:
        """Close the triangle of arm, forearm and the line to the tool."""
        x, y = user[:2]
        bend = (hypot(x, y) ** 2 - ARM_MM**2 - FOREARM_MM**2) / (2 * ARM_MM * FOREARM_MM)
        if abs(bend) > 1 + ROUNDING:
            raise OutOfReach(f"X {x:.2f}, Y {y:.2f} mm is out of reach")
        bend = max(-1.0, min(bend, 1.0))
        elbow = atan2((1 - bend**2) ** 0.5, bend)
        arm = atan2(y, x) - atan2(FOREARM_MM * sin(elbow), ARM_MM + FOREARM_MM * cos(elbow))
        turn = (arm + pi) % (2 * pi) - pi
        return (degrees(turn), degrees(elbow - ELBOW_AT_ZERO), *user[2:])
