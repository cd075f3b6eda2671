"""Where a SCARA robot's wafer is for the positions of its three axes, and back (RC-420 manual 13.10)."""

from cmath import phase, rect
from dataclasses import dataclass
from math import asin, degrees, radians

TURN = 360.0

DIGITS = 6
"""Decimals of a pulse that count before it is cut: enough to get over the rounding of angles."""


@dataclass(frozen=True, slots=True)
class Scara:
    """Two links of the same length and a finger, each turned by its own axis.

    With the axes' angles b, a and w, the first link points to b, the second to b + 180 - a and the finger to
    b - a - w, counterclockwise from X. That is an assumption; the one worked example fits it (13.10.7).
    """

    link: int
    """Micrometres, as the finger."""
    finger: int
    pulses_per_turn: tuple[float, ...]
    """Of the axes 0, 1 and 2."""

    def place(self, pulses: tuple[int, ...]) -> tuple[int, int, int]:
        """X and Y in micrometres, and the finger's direction in thousandths of a degree."""
        turns = zip(pulses, self.pulses_per_turn, strict=True)
        base, arm, wrist = (count / turn * TURN for count, turn in turns)
        direction = base - arm - wrist
        point = (
            rect(self.link, radians(base))
            - rect(self.link, radians(base - arm))
            + rect(self.finger, radians(direction))
        )
        return round(point.real), round(point.imag), round(1000 * direction)

    def pulses(self, x: int, y: int, direction: int) -> tuple[int, ...] | None:
        """The axes' positions, cut towards zero; None where the links are too short.

        Of the two ways to bend the elbow it takes that of the example.
        """
        finger = direction / 1000
        wrist = complex(x, y) - rect(self.finger, radians(finger))
        if abs(wrist) > 2 * self.link:
            return None
        arm = -2 * degrees(asin(abs(wrist) / (2 * self.link)))
        base = _within_turn(degrees(phase(wrist)) + TURN / 4 + arm / 2)
        angles = (base, arm, _within_turn(base - arm - finger))
        turns = zip(angles, self.pulses_per_turn, strict=True)
        return tuple(int(round(angle / TURN * turn, DIGITS)) for angle, turn in turns)


def _within_turn(angle: float) -> float:
    """The same direction between -180 and 180 degrees."""
    return (angle + TURN / 2) % TURN - TURN / 2
