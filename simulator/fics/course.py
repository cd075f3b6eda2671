"""What is moving in one unit: strokes along straight lines in motor or user coordinates, one or many."""

from collections.abc import Generator, Mapping
from dataclasses import dataclass, replace
from math import inf, isfinite
from typing import TYPE_CHECKING

from simulator.fics.axes import Motor, Sensor
from simulator.fics.geometry import Places
from simulator.fics.motion import Glide, Ramps, glide

if TYPE_CHECKING:
    from simulator.fics.units import Unit


class Overrun(Exception):
    """A motor has run onto its limit sensor."""

    def __init__(self, motor: Motor, sensor: Sensor) -> None:
        super().__init__(f"{motor.name} is at its {sensor.name}")
        self.motor = motor
        self.sensor = sensor


@dataclass(frozen=True, slots=True)
class Span:
    """Where one axis goes in a stroke."""

    start: float
    target: float

    def place(self, share: float) -> float:
        """Where it is after a share of the way; exactly there at the end."""
        return self.target if share == 1.0 else self.start + (self.target - self.start) * share


@dataclass(frozen=True, slots=True)
class Stroke:
    """Axes, by their places in the unit, that start and arrive together on a straight line."""

    spans: Mapping[int, Span]
    glide: Glide
    """From 0 to 1, the share of the way."""
    searching: bool = False
    """Homing legs may run onto the limit sensors."""

    def place(self, axis: int, now: float) -> float:
        """Where one of its axes is."""
        return self.spans[axis].place(self.glide.place(now))

    def time_at(self, axis: int, place: float) -> float:
        """When one of its axes first comes as far as a place; infinite if it never does."""
        span = self.spans[axis]
        way = span.target - span.start
        return self.glide.time_at((place - span.start) / way) if way and isfinite(place) else inf


Route = Generator[Stroke, float, None]
"""Strokes one after the other, each answered with the moment it ended."""


def stroke(
    spans: Mapping[int, Span], ramps: Mapping[int, Ramps], now: float, searching: bool = False
) -> Stroke:
    """Plan a stroke in which no axis exceeds its ramps."""
    ways = {axis: abs(span.target - span.start) for axis, span in spans.items()}
    shares = [_in_shares(ramps[axis], way) for axis, way in ways.items() if way > 0]
    if not shares:
        return Stroke(spans, glide(1.0, 1.0, Ramps(0.0, 1.0), now), searching)
    slowest = Ramps(
        min(share.start_speed for share in shares),
        min(share.speed for share in shares),
        min(share.acceleration for share in shares),
        min(share.deceleration for share in shares),
        shares[0].s_curve,
    )
    return Stroke(spans, glide(0.0, 1.0, slowest, now), searching)


def _in_shares(ramps: Ramps, way: float) -> Ramps:
    return Ramps(
        ramps.start_speed / way,
        ramps.speed / way,
        ramps.acceleration / way,
        ramps.deceleration / way,
        ramps.s_curve,
    )


@dataclass(slots=True)
class _Track:
    """A route under way: the stroke it is at, and when that runs onto a limit sensor."""

    route: Route
    stroke: Stroke
    limit_at: float = inf
    limit: Overrun | None = None

    @property
    def next_at(self) -> float:
        return min(self.limit_at, self.stroke.glide.ends_at)


class Course:
    """The motion of one unit, until every route has come to its end.

    The strokes are in the coordinates of the motors or, if `converted`, in user coordinates that differ.
    """

    def __init__(self, unit: "Unit", *, converted: bool = False) -> None:
        self.unit = unit
        self.converted = converted
        self.braking = False
        """Nothing follows the strokes under way."""
        self._user = list(unit.geometry.to_user(unit.at_rest())) if converted else []
        self._tracks: list[_Track] = []

    @property
    def ended(self) -> bool:
        """Whether everything stands still."""
        return not self._tracks

    def next_at(self) -> float:
        """When the next stroke ends, or runs onto a limit."""
        return min((track.next_at for track in self._tracks), default=inf)

    def start(self, route: Route) -> None:
        """Begin a route, beside those under way."""
        first = next(route, None)
        if first is not None:
            self._tracks.append(_Track(route, first))
            self.sense()

    def moves(self, axis: int) -> bool:
        """Whether an axis, by its place in the unit, is on its way."""
        return any(axis in track.stroke.spans for track in self._tracks)

    def motor_places(self, now: float) -> Places:
        """The coordinates of the motors."""
        places = self._user[:] if self.converted else list(self.unit.at_rest())
        for track in self._tracks:
            for axis in track.stroke.spans:
                places[axis] = track.stroke.place(axis, now)
        return self.unit.geometry.to_motors(tuple(places)) if self.converted else tuple(places)

    def advance(self, now: float) -> None:
        """Let the strokes end that are over.

        :raises Overrun: one has run onto a limit sensor.
        """
        for track in list(self._tracks):
            if track.limit is not None and track.limit_at <= now:
                raise track.limit
            if track.stroke.glide.ends_at <= now:
                self._settle(track.stroke, now)
                self._go_on(track, now)

    def sense(self) -> None:
        """Look where the limit sensors are: somebody may have moved them."""
        for track in self._tracks:
            track.limit_at, track.limit = self._next_limit(track.stroke)

    def brake(self, now: float, axis: int | None = None) -> None:
        """Ramp down one axis, or all of them, and let nothing follow."""
        self.braking = self.braking or axis is None
        for track in self._tracks:
            if axis is None or axis in track.stroke.spans:
                track.route.close()
                track.stroke = replace(track.stroke, glide=track.stroke.glide.braked(now))
        self.sense()

    def halt(self, now: float) -> None:
        """Stop everything at this moment."""
        for track in self._tracks:
            track.route.close()
            self._settle(track.stroke, now)
        self._tracks.clear()

    def _go_on(self, track: _Track, now: float) -> None:
        try:
            track.stroke = track.route.send(now)
        except StopIteration:
            self._tracks.remove(track)
        else:
            self.sense()

    def _settle(self, stroke: Stroke, now: float) -> None:
        for axis in stroke.spans:
            if self.converted:
                self._user[axis] = stroke.place(axis, now)
            else:
                self.unit.motors[axis].at = stroke.place(axis, now)
        if self.converted:
            self.unit.put(self.unit.geometry.to_motors(tuple(self._user)))

    def _next_limit(self, stroke: Stroke) -> tuple[float, Overrun | None]:
        """When a stroke runs onto a limit sensor; converted ones keep within the soft limits."""
        limit: tuple[float, Overrun | None] = (inf, None)
        if self.converted or stroke.searching:
            return limit
        for axis, span in stroke.spans.items():
            motor = self.unit.motors[axis]
            sensor = Sensor.PLUS_LIMIT if span.target > span.start else Sensor.MINUS_LIMIT
            at = stroke.time_at(axis, motor.limit(sensor))
            if span.target != span.start and at < limit[0]:
                limit = (at, Overrun(motor, sensor))
        return limit
