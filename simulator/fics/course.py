"""The motion in one unit: strokes along straight lines in motor or user coordinates, one or many."""

from collections.abc import Generator, Iterator, Mapping
from dataclasses import dataclass, replace
from math import inf, isfinite

from simulator.fics.axes import Motor, Sensor
from simulator.fics.geometry import Places
from simulator.fics.mechanics import Mechanics
from simulator.fics.motion import Glide, Ramps, glide

ROUNDING = 1e-9
"""Least way of an axis, in its unit; a shorter one is rounding."""

PATH_CHECKS = 64
"""Places at which the way of a converted move is looked at before the motors go it."""


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

    @property
    def way(self) -> float:
        """The length of the way, without a sign; 0 for a way within rounding."""
        way = abs(self.target - self.start)
        return way if way > ROUNDING else 0.0

    def place(self, share: float) -> float:
        """Where it is after a share of the way; exactly there at the end."""
        return self.target if share == 1.0 else self.start + (self.target - self.start) * share


@dataclass(frozen=True, slots=True)
class Stroke:
    """Axes, by their places in the unit, that start and arrive together on a straight line."""

    spans: Mapping[int, Span]
    glide: Glide
    """Share of the way, from 0 to 1, over the time."""
    onto: Sensor | None = None
    """The limit sensor it may run onto, as homing does."""

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
    spans: Mapping[int, Span], ramps: Mapping[int, Ramps], now: float, onto: Sensor | None = None
) -> Stroke:
    """Plan a stroke in which no axis exceeds its ramps."""
    shares = [_in_shares(ramps[axis], span.way) for axis, span in spans.items() if span.way]
    if not shares:
        return Stroke(spans, glide(1.0, 1.0, Ramps(0.0, 1.0), now), onto)
    slowest = Ramps(
        min(share.start_speed for share in shares),
        min(share.speed for share in shares),
        min(share.acceleration for share in shares),
        min(share.deceleration for share in shares),
        shares[0].s_curve,
    )
    return Stroke(spans, glide(0.0, 1.0, slowest, now), onto)


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

    def __init__(self, mechanics: Mechanics, *, converted: bool = False) -> None:
        self.mechanics = mechanics
        self.converted = converted
        self._user = list(mechanics.geometry.to_user(mechanics.at_rest())) if converted else []
        self._tracks: list[_Track] = []

    @property
    def ended(self) -> bool:
        """Tell whether everything stands still."""
        return not self._tracks

    def next_at(self) -> float:
        """When the next stroke ends, or runs onto a limit."""
        return min((track.next_at for track in self._tracks), default=inf)

    def start(self, route: Route) -> None:
        """Begin a route, beside those under way."""
        first = next(route, None)
        if first is not None:
            self._tracks.append(_Track(route, first))
            self._set_off(first)

    def moves(self, axis: int) -> bool:
        """Tell whether an axis, by its place in the unit, is on its way."""
        return any(axis in track.stroke.spans for track in self._tracks)

    def motor_places(self, now: float) -> Places:
        """The coordinates of the motors."""
        places = self._user[:] if self.converted else list(self.mechanics.at_rest())
        for track in self._tracks:
            for axis in track.stroke.spans:
                places[axis] = track.stroke.place(axis, now)
        return self.mechanics.geometry.to_motors(tuple(places)) if self.converted else tuple(places)

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

    def sense(self, now: float) -> None:
        """Look where the limit sensors are: a person may have moved them."""
        for track in self._tracks:
            track.limit_at, track.limit = self._next_limit(track.stroke, now)

    def brake(self, now: float, axis: int | None = None) -> None:
        """Ramp down one axis, or all of them, and let nothing follow."""
        for track in self._tracks:
            if axis is None or axis in track.stroke.spans:
                track.route.close()
                track.stroke = replace(track.stroke, glide=track.stroke.glide.braked(now))
        self.sense(now)

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
            self._set_off(track.stroke)

    def _set_off(self, stroke: Stroke) -> None:
        self._log("axis_start", stroke, stroke.glide.starts_at)
        self.sense(stroke.glide.starts_at)

    def _settle(self, stroke: Stroke, now: float) -> None:
        for axis in stroke.spans:
            if self.converted:
                self._user[axis] = stroke.place(axis, now)
            else:
                self.mechanics.motors[axis].at = stroke.place(axis, now)
        if self.converted:
            self.mechanics.put(self.mechanics.geometry.to_motors(tuple(self._user)))
        self._log("axis_stop", stroke, now)

    def _log(self, kind: str, stroke: Stroke, now: float) -> None:
        """Tell the truth of each motor that a stroke moves."""
        places = self.motor_places(now)
        for axis in self._driven(stroke):
            motor = self.mechanics.motors[axis]
            self.mechanics.truth.log(kind, now, self.mechanics.number, axis=motor.name, place=places[axis])

    def _driven(self, stroke: Stroke) -> list[int]:
        """The motors of a stroke, by their places; a converted axis takes all those of the arms."""
        moving = {axis for axis, span in stroke.spans.items() if span.way}
        arms = set(range(self.mechanics.geometry.converted)) if self.converted else set()
        return sorted(moving | arms if moving & arms else moving)

    def _next_limit(self, stroke: Stroke, now: float) -> tuple[float, Overrun | None]:
        """When a stroke runs onto a limit sensor it has no business on."""
        found = self._converted_limits(stroke, now) if self.converted else self._limits(stroke)
        return min(found, key=lambda limit: limit[0], default=(inf, None))

    def _limits(self, stroke: Stroke) -> Iterator[tuple[float, Overrun]]:
        for axis, span in stroke.spans.items():
            motor, sensor = self.mechanics.motors[axis], _ahead(span.start, span.target)
            if sensor not in (None, stroke.onto):
                yield stroke.time_at(axis, motor.limit(sensor)), Overrun(motor, sensor)

    def _converted_limits(self, stroke: Stroke, now: float) -> Iterator[tuple[float, Overrun]]:
        """Look at many places of the way that is left: the motors do not go straight, and may turn."""
        way = Span(stroke.glide.place(now), stroke.glide.target)
        shares = [way.place(check / PATH_CHECKS) for check in range(PATH_CHECKS + 1)]
        places = [self._motors_after(stroke, share) for share in shares]
        for check in range(PATH_CHECKS):
            for axis, motor in enumerate(self.mechanics.motors):
                sensor = _ahead(places[check][axis], places[check + 1][axis])
                if sensor is not None and motor.sees(sensor, places[check + 1][axis]):
                    share = self._first_seen(stroke, axis, sensor, shares[check], shares[check + 1])
                    yield stroke.glide.time_at(share), Overrun(motor, sensor)

    def _first_seen(self, stroke: Stroke, axis: int, sensor: Sensor, early: float, late: float) -> float:
        """The share of a converted way at which a motor comes onto a sensor that it sees at the later one."""
        motor = self.mechanics.motors[axis]
        while early < (middle := (early + late) / 2) < late:
            if motor.sees(sensor, self._motors_after(stroke, middle)[axis]):
                late = middle
            else:
                early = middle
        return late

    def _motors_after(self, stroke: Stroke, share: float) -> Places:
        """Where the motors are after a share of a converted way."""
        user = [
            stroke.spans[axis].place(share) if axis in stroke.spans else at
            for axis, at in enumerate(self._user)
        ]
        return self.mechanics.geometry.to_motors(tuple(user))


def _ahead(start: float, end: float) -> Sensor | None:
    """The limit sensor on the way; None if there is no way."""
    if start == end:
        return None
    return Sensor.PLUS_LIMIT if end > start else Sensor.MINUS_LIMIT
