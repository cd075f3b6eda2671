"""An axis under way on an interpolated path (RC-420 manual 13.10).

Every controller of a virtual body calculates the whole path, and begins to turn its own axis along it at the
same command. From then on nothing connects them; the link master may, which the manual leaves open.
"""

from bisect import bisect_right
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import ceil, floor
from operator import attrgetter
from typing import NamedTuple

from protocols.rorze.path import CLOSE_UM, Knot
from protocols.rorze.profile import Profile, SpeedParameters, first_moment
from simulator.rorze.motion import Direction, PulseTrain


class Stretch(NamedTuple):
    """A part of a path, from and to a place along it in micrometres, on which an axis turns one way."""

    first: float
    last: float
    direction: Direction


class Track:
    """The pulses of an axis along a path, which is taken to be a whole number of micrometres long."""

    def __init__(self, knots: Sequence[Knot]) -> None:
        length = knots[-1].along
        self.length = ceil(length - CLOSE_UM)
        scale = self.length / length if length else 0.0
        self._knots = [knot._replace(along=knot.along * scale) for knot in knots]
        self.stretches = tuple(self._turning())
        """Parts of the path on which the axis turns one way; empty for an axis that never turns."""

    def count(self, along: float) -> int:
        """Pulses from the start, CW positive, at a place `along` the path in micrometres."""
        place = bisect_right(self._knots, along, key=attrgetter("along"))
        before = self._knots[place - 1]
        if place == len(self._knots):
            return _whole(before.pulses)
        after = self._knots[place]
        share = (along - before.along) / (after.along - before.along)
        return _whole(before.pulses + share * (after.pulses - before.pulses))

    @property
    def pulses(self) -> int:
        """Pulses from the start to the end, CW positive."""
        return _whole(self._knots[-1].pulses)

    def _turning(self) -> Iterator[Stretch]:
        first, direction = 0.0, 0
        for before, after in pairwise(self._knots):
            step = _whole(after.pulses) - _whole(before.pulses)
            if step * direction < 0:
                yield Stretch(first, before.along, 1 if direction > 0 else -1)
                first = before.along
            direction = step or direction
        if direction:
            yield Stretch(first, self.length, 1 if direction > 0 else -1)


def _whole(pulses: float) -> int:
    return floor(pulses + 0.5)


class Prepared(NamedTuple):
    """A move that waits for HMM; its speed is that of the point on the path, in micrometres a second."""

    track: Track
    profile: Profile

    @property
    def direction(self) -> Direction | None:
        """The direction in which the axis turns first; None for an axis that does not turn."""
        return self.track.stretches[0].direction if self.track.stretches else None


@dataclass
class Course:
    """A move along a path, under way."""

    track: Track
    profile: Profile
    """Speed over the time, on the clock of the controller; a stop changes it."""


class PathTrain(PulseTrain):
    """The pulses of one stretch of a course."""

    def __init__(self, course: Course, stretch: Stretch) -> None:
        self._course = course
        self._stretch = stretch
        self.direction = stretch.direction
        self._begun = course.track.count(stretch.first)
        self._passed = stretch.first
        """Micrometres that no stop can take back."""
        self._ends_at = self._end()

    @property
    def profile(self) -> Profile:
        """That of the whole course: a stop on one stretch is one of the course."""
        return self._course.profile

    @profile.setter
    def profile(self, profile: Profile) -> None:
        self._course.profile = profile
        self._ends_at = self._end()

    @property
    def final(self) -> bool:
        """Tell whether the course ends here."""
        return self._last() < self._stretch.last or self._stretch.last == self._course.track.length

    @property
    def ends_at(self) -> float:
        """The moment at which the axis turns back, or the course ends."""
        return self._ends_at

    def running(self, now: float) -> bool:
        """Tell whether pulses are still to come."""
        return now < self._ends_at

    def emitted(self, now: float) -> int:
        """Pulses given to the motor since the start of the stretch, 0 or more."""
        last = self._last()
        along = min(self.profile.position(now), last) if self.running(now) else last
        return self.direction * (self._course.track.count(max(self._passed, along)) - self._begun)

    def time_when(self, pulses: int) -> float | None:
        """The first moment at which `pulses` have been emitted; None if the stretch ends before that."""
        if self.emitted(self._ends_at) < pulses:
            return None
        curve = self.profile.curve
        earliest = max(curve.phases[0].start_s, curve.time_of(self._passed))
        if self.emitted(earliest) >= pulses:
            return earliest
        return first_moment(lambda now: self.emitted(now) >= pulses, earliest, self._ends_at)

    def decelerate_to_stop(self, now: float, parameters: SpeedParameters | None = None) -> None:
        """Ramp down to OL on the path, and end there: 5SS."""
        self._passed = max(self._passed, min(self.profile.position(now), self._last()))
        super().decelerate_to_stop(now, parameters)

    def _last(self) -> float:
        """The end of the stretch along the path, in micrometres: nearer after a stop."""
        distance = self.profile.distance
        return self._stretch.last if distance is None else min(distance, self._stretch.last)

    def _end(self) -> float:
        return self.profile.curve.time_of(self._last())
