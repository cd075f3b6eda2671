"""The seven ways to find an axis's origin (C-HOST manual 2-25): which sensor, whether to turn back, and Z."""

from collections.abc import Generator
from typing import NamedTuple

from simulator.fics.axes import Motor, Sensor
from simulator.fics.course import Route, Span, Stroke, stroke

PLUS, MINUS = 1.0, -1.0


class OriginNotFound(Exception):
    """The origin sensor never answered."""

    def __init__(self, motor: Motor) -> None:
        super().__init__(f"{motor.name} has no origin")
        self.motor = motor


class Manner(NamedTuple):
    """The properties of a homing type."""

    sensor: Sensor
    turns_back: bool
    """Leave the sensor again at HMB; otherwise go on towards minus."""
    z: bool
    """The origin is the encoder's next Z phase, not the edge of the sensor."""


MANNERS = (
    Manner(Sensor.ORIGIN, turns_back=True, z=True),  # 0 Enc
    Manner(Sensor.ORIGIN, turns_back=True, z=False),  # 1 No
    Manner(Sensor.ORIGIN, turns_back=False, z=True),  # 2 Enc SENSOR
    Manner(Sensor.ORIGIN, turns_back=False, z=False),  # 3 No SENSOR
    Manner(Sensor.MINUS_LIMIT, turns_back=True, z=True),  # 4 Enc LIMIT
    Manner(Sensor.MINUS_LIMIT, turns_back=True, z=False),  # 5 No LIMIT
    Manner(Sensor.ORIGIN, turns_back=False, z=True),  # 6 Enc FAST
)
"""Ways of homing by the value of HMT. The direction, towards minus, is an assumption, and so are the ways
where the manual gives only names; FAST differs from Enc SENSOR in the speeds it is given, not in its way."""

Steps = Generator[Stroke, float, float]
"""Strokes, and in the end the moment at which the last of them ended."""


class Search:
    """The search of one motor: the encoder is latched at each place, the axis overshoots and comes back."""

    def __init__(self, motor: Motor, axis: int) -> None:
        self._motor = motor
        self._axis = axis

    def route(self, now: float) -> Route:
        """From wherever the axis is to its offset from the origin, which becomes its coordinate 0.

        A limit sensor that it does not look for ends it as any move.

        :raises OriginNotFound: the sensor never answers.
        """
        motor = self._motor
        motor.homed = False
        manner = MANNERS[motor.homing_type]
        now = yield from self._come_from_plus(manner.sensor, now)
        now = yield from self._find(manner.sensor, MINUS, motor.homing_speed, now)
        origin = self._edge(manner.sensor)
        onwards = PLUS if manner.turns_back else MINUS
        if manner.turns_back:
            now = yield from self._find(manner.sensor, PLUS, motor.z_speed, now)
        if manner.z:
            origin = motor.world.next_z(origin + motor.zero, onwards) - motor.zero
            now = yield from self._pass(origin, onwards, motor.z_speed, now, manner.sensor)
        zero = origin + motor.homing_offset
        yield self._leg(zero, motor.homing_speed, now, manner.sensor)
        motor.at, motor.zero, motor.homed = 0.0, motor.zero + zero, True

    def _come_from_plus(self, sensor: Sensor, now: float) -> Steps:
        """Leave the sensor towards plus, or go round by the minus limit if the axis stands beyond it."""
        motor = self._motor
        if not motor.held.get(sensor, motor.at <= self._edge(sensor)):
            return now
        if not motor.sees(sensor, motor.at):
            now = yield from self._find(Sensor.MINUS_LIMIT, MINUS, motor.homing_speed, now)
        return (yield from self._find(sensor, PLUS, motor.homing_speed, now))

    def _find(self, sensor: Sensor, direction: float, speed: float, now: float) -> Steps:
        """Come by the edge of a sensor; one that is held has none, so the axis runs on to its limit."""
        motor = self._motor
        if sensor not in motor.held:
            now = yield from self._pass(self._edge(sensor), direction, speed, now, sensor)
        if sensor in motor.held:
            world = motor.world
            end = (world.plus_limit if direction > 0 else world.minus_limit) - motor.zero
            yield self._leg(end, speed, now, Sensor.MINUS_LIMIT)
            raise OriginNotFound(motor)
        return now

    def _edge(self, sensor: Sensor) -> float:
        """The coordinate at which the sensor comes on for an axis on its way towards minus."""
        world = self._motor.world
        return (world.minus_limit if sensor is Sensor.MINUS_LIMIT else world.dog[1]) - self._motor.zero

    def _pass(self, place: float, direction: float, speed: float, now: float, onto: Sensor) -> Steps:
        """Come by a place at a speed and brake behind it."""
        ramps = self._motor.search_ramps(speed)
        low = min(ramps.start_speed, ramps.speed)
        overshoot = (ramps.speed**2 - low**2) / (2 * ramps.deceleration)
        return (yield self._leg(place + direction * overshoot, speed, now, onto))

    def _leg(self, target: float, speed: float, now: float, onto: Sensor) -> Stroke:
        ramps = self._motor.search_ramps(speed)
        return stroke({self._axis: Span(self._motor.at, target)}, {self._axis: ramps}, now, onto)
