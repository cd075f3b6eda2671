"""A SCARA robot's kinematics: the positions of its axes, and where its finger ends (RC-420 manual 13.10).

Lengths are micrometres. Angles are radians, counterclockwise from X; the manual's are thousandths of a
degree. Two links of the same length carry the finger, which ends at the wafer's centre.
"""

from abc import ABC, abstractmethod
from cmath import phase, rect
from collections.abc import Sequence
from dataclasses import dataclass
from math import asin, pi, radians, sin
from typing import ClassVar, NamedTuple

TURN = 2 * pi

DIGITS = 6
"""Decimals of a pulse that count before it is cut: enough to get over the rounding of angles."""

SLACK_UM = 1e-6
"""Micrometres by which rounding may overstretch the arm."""


class OutOfReach(ValueError):
    """The links are too short, or too long, for a place: error 63."""


class FingerPlace(NamedTuple):
    """Where the finger ends, in micrometres, and its direction in thousandths of a degree."""

    x: float
    y: float
    direction: float


class Pose(NamedTuple):
    """The pose of the arm: the wrist is `reach` micrometres from the origin along `heading`.

    A reach below 0 is behind the origin: the other bend of the elbow.
    """

    reach: float
    heading: float
    finger: float
    """The direction of the finger."""


@dataclass(frozen=True, slots=True)
class Mechanics(ABC):
    """The mechanics that HTS, HAS, HFS and HZS describe."""

    link: int
    """Micrometres, as the finger."""
    finger: int
    pulses_per_turn: tuple[float, ...]
    """Pulses per turn of each axis, from axis 0 on."""

    axes: ClassVar[int]

    @property
    @abstractmethod
    def ahead(self) -> int:
        """Micrometres from the wrist, on the line of the arm, to the point that a path leads."""

    @abstractmethod
    def angles(self, pose: Pose) -> tuple[float, ...]:
        """The axes' angles for a pose.

        :raises OutOfReach: the links are too short.
        """

    @abstractmethod
    def pose(self, pulses: Sequence[float]) -> Pose:
        """The pose at these positions of the axes.

        :raises OutOfReach: the arm is turned beyond its longest reach.
        """

    @abstractmethod
    def pulses(self, place: FingerPlace) -> tuple[float, ...]:
        """The axes' positions for a place, each within half a turn: HLS.

        :raises OutOfReach: there are none.
        """

    def whole_pulses(self, place: FingerPlace) -> tuple[int, ...]:
        """The pulses that HLS answers: cut towards zero.

        :raises OutOfReach: the arm cannot reach the place.
        """
        return self.cut(self.pulses(place))

    @staticmethod
    def cut(counts: Sequence[float]) -> tuple[int, ...]:
        """Whole pulses, cut towards zero."""
        return tuple(int(round(count, DIGITS)) for count in counts)

    def place(self, pulses: Sequence[float]) -> FingerPlace:
        """Where the finger ends at these positions of the axes: HLD.

        :raises OutOfReach: the arm is turned beyond its longest reach.
        """
        reach, heading, finger = self.pose(pulses)
        end = rect(reach, heading) + rect(self.finger, finger)
        return FingerPlace(end.real, end.imag, finger / TURN * 360_000)

    def lead(self, pose: Pose) -> float:
        """Micrometres from the origin, along its heading, to the point that a path leads; negative behind."""
        return pose.reach + self.ahead

    def guide(self, end: complex, finger: float) -> complex:
        """Where that point is when the finger ends at `end`."""
        return end - rect(self.finger - self.ahead, finger)

    def turned(self, pulses: Sequence[float]) -> tuple[float, ...]:
        """The angles of the axes at these positions."""
        return tuple(count / turn * TURN for count, turn in zip(pulses, self.pulses_per_turn, strict=True))

    def counted(self, angles: Sequence[float]) -> tuple[float, ...]:
        """The positions of the axes at these angles."""
        return tuple(angle / TURN * turn for angle, turn in zip(angles, self.pulses_per_turn, strict=True))

    def _bend(self, reach: float) -> float:
        """Half the angle between the links that brings the wrist so far."""
        longest = 2 * self.link
        if abs(reach) > longest + SLACK_UM:
            raise OutOfReach(f"The wrist comes {longest} um from the origin, but not {abs(reach):.0f} um.")
        return asin(max(-1.0, min(1.0, reach / longest)))


class ThreeAxes(Mechanics):
    """A robot whose links and finger are each turned by their own axis (HTS0).

    With the axes' angles b, a and w, the first link points to b, the second to b + 180 - a and the finger to
    b - a - w. That is an assumption; the one worked example fits it (RC-420 manual 13.10.7). A path leads the
    wrist, and the finger keeps its direction.
    """

    axes = 3

    @property
    def ahead(self) -> int:
        """Micrometres from the wrist to the led point, which is the wrist."""
        return 0

    def angles(self, pose: Pose) -> tuple[float, ...]:
        """Angles of base, arm and finger, in radians."""
        bend = self._bend(pose.reach)
        base = pose.heading - pi / 2 + bend
        return base, 2 * bend, base - 2 * bend - pose.finger

    def pose(self, pulses: Sequence[float]) -> Pose:
        """The arm may have turned round more than once."""
        base, arm, wrist = self.turned(pulses)
        bend = within_half_turn(arm) / 2
        return Pose(2 * self.link * sin(bend), base - bend + pi / 2, base - arm - wrist)

    def pulses(self, place: FingerPlace) -> tuple[float, ...]:
        """Pulses of the axes at a place.

        The elbow bends as in the manual's worked example, which is an assumption.
        """
        finger = radians(place.direction / 1000)
        wrist = self.guide(complex(place.x, place.y), finger)
        base, arm, turn = self.angles(Pose(-abs(wrist), phase(-wrist), finger))
        return self.counted((within_half_turn(base), arm, within_half_turn(turn)))


class BeltLinked(Mechanics):
    """A robot whose belts keep the finger on the line of the arm (HTS1, RC-420 manual 13.10.10).

    Axis 0 turns it all; axis 1 turns the first link, the second back by twice that and the finger on by as
    much. At 0 the wrist is over the origin and the finger points along X, and CW of axis 1 extends the arm:
    assumptions. A path leads the finger's end.
    """

    axes = 2

    @property
    def ahead(self) -> int:
        """Micrometres from the wrist to the led point, which is the finger's end."""
        return self.finger

    def angles(self, pose: Pose) -> tuple[float, ...]:
        """Angles of turn and arm, in radians."""
        return pose.heading, self._bend(pose.reach)

    def pose(self, pulses: Sequence[float]) -> Pose:
        """The arm bends up to a quarter turn."""
        heading, bend = self.turned(pulses)
        if abs(bend) > pi / 2:
            raise OutOfReach("The arm is turned beyond its longest reach.")
        return Pose(2 * self.link * sin(bend), heading, heading)

    def pulses(self, place: FingerPlace) -> tuple[float, ...]:
        """The direction of the place does not count."""
        end = complex(place.x, place.y)
        return self.counted(self.angles(Pose(abs(end) - self.finger, phase(end), phase(end))))

    def pulses_pointed(self, place: FingerPlace) -> tuple[float, ...]:
        """The axes' positions for a place with its direction; belts keep it on the line through the origin.

        :raises OutOfReach: the finger cannot end there and point so, by more than a pulse of the base.
        """
        end, heading = complex(place.x, place.y), within_half_turn(place.direction / 360_000 * TURN)
        along = end * rect(1.0, -heading)
        if abs(along.imag) > 1 + abs(end) * TURN / self.pulses_per_turn[0]:
            told = phase(end) / TURN * 360_000
            raise OutOfReach(
                f"angle: belts keep the finger on the line through the origin; there it points to {told:.3f} "
                f"or the opposite, not to {place.direction:.3f} mdeg."
            )
        return self.counted(self.angles(Pose(along.real - self.finger, heading, heading)))


def within_half_turn(angle: float, turn: float = TURN) -> float:
    """The least angle in the same direction, either way; `turn` is after what angle directions repeat."""
    rest = angle % turn
    return rest if rest <= turn / 2 else rest - turn
