"""The mechanics of one axis: where along its travel the sensors answer, and which are held by hand."""

from dataclasses import dataclass, field
from typing import NamedTuple

from simulator.rorze.motion import Direction

STALL, ORIGIN, CW_LIMIT, CCW_LIMIT, IN_POSITION, EMS = range(6)
"""The sensors in the bit order of CLD."""

SENSORS, INPUTS = 6, 10
"""Numbers of sensors and of general inputs."""

CW: Direction = 1
CCW: Direction = -1


class Span(NamedTuple):
    """The pulses, first and last included, over which a sensor is covered."""

    first: int
    last: int

    def covers(self, at: int) -> bool:
        """Tell whether the sensor is covered there."""
        return self.first <= at <= self.last


class Slits(NamedTuple):
    """A disc that covers the STALL sensor for the first half of every `period` pulses, from `phase` on."""

    phase: int
    period: int

    def covers(self, at: int) -> bool:
        """Tell whether the sensor is covered there."""
        return (at - self.phase) % self.period < self.period // 2

    def around(self, at: int) -> tuple[Span, ...]:
        """The covered stretches next to a place: the one it is in or has left, and its neighbours."""
        start = at - (at - self.phase) % self.period
        return tuple(
            Span(first, first + self.period // 2 - 1)
            for first in (start - self.period, start, start + self.period)
        )


DOG, CW_END, CCW_END = Span(-1_000, -800), Span(1_000_000, 1_001_000), Span(-1_001_000, -1_000_000)
DISC = Slits(-1_210, 2_048)
"""The disc as delivered: a short way CW of the origin sensor, far from the limits, as QIS expects it."""

ENCODER = 4.0
"""The encoder as delivered: one count a pulse with the factory's multiplier and ratio."""


@dataclass
class World:
    """The mechanics of one axis, in pulses from where it stood when it was built, CW positive.

    Neither 6PS nor a loss of power moves them. `slipped` pulses (CW positive) were given to a motor that did
    not follow them: the shaft stands short by that much.
    """

    origin: Span = DOG
    cw_limit: Span = CW_END
    ccw_limit: Span = CCW_END
    slits: Slits = DISC
    encoder: float = ENCODER
    """Motor pulses to a line of the encoder."""
    slipped: int = 0
    inputs: int = 0
    """Raw levels of the ten general inputs, a bit an input."""
    forced: dict[int, bool] = field(default_factory=dict)

    def shaft(self, pulses: int) -> int:
        """Give the place of the shaft when its driver has been given `pulses`."""
        return pulses - self.slipped

    def levels(self, pulses: int) -> int:
        """The sensors' raw levels, a bit a sensor; EMS and INP are only ever on by hand."""
        at = self.shaft(pulses)
        levels = (
            self.slits.covers(at) << STALL
            | self.origin.covers(at) << ORIGIN
            | self.cw_limit.covers(at) << CW_LIMIT
            | self.ccw_limit.covers(at) << CCW_LIMIT
        )
        for sensor, on in self.forced.items():
            levels = levels | 1 << sensor if on else levels & ~(1 << sensor)
        return levels

    def next_edge(self, pulses: int, direction: Direction) -> int | None:
        """The nearest pulse count ahead at which a sensor changes."""
        at = self.shaft(pulses)
        spans = (self.origin, self.cw_limit, self.ccw_limit, *self.slits.around(at))
        places = [place for span in spans for place in (span.first, span.last + 1)]
        if direction == CW:
            ahead = [place for place in places if place > at]
            return min(ahead) + self.slipped if ahead else None
        ahead = [place - 1 for place in places if place - 1 < at]
        return max(ahead) + self.slipped if ahead else None
