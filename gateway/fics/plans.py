"""What a robot's move would do, asked without moving: the exact frame, where it goes, how long it takes."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import inf, sqrt
from typing import Any

from pydantic import Field

from gateway.core.errors import GatewayError
from gateway.core.records import Record
from gateway.fics.axes import Coordinates, Places
from gateway.fics.durations import PER_SECOND, ROWS
from gateway.fics.errors import NotHomed, PositionUnknown
from gateway.fics.move_record import check
from gateway.fics.soft_limits import crossed_limits
from gateway.fics.targets import end_of, places_it_needs, target_of
from gateway.fics.units import RobotUnit
from protocols.fics import speeds
from protocols.fics.motor_axes import MoveMotorsRelative
from protocols.fics.moves import MoveRelative, MoveToPosition
from protocols.fics.notation import AxisSystem
from protocols.fics.row import FicsCommand


class PlannedRobotMove(Record):
    """A move that was checked and not sent."""

    body_id: str = Field(description="Address of the unit, ROBOT/units/1.")
    frame: str = Field(description="The exact bytes that would be sent, CR as \\r.")
    coordinates: Coordinates = Field(description="Which axes the positions are of.")
    units: dict[str, str] = Field(description="By axis: mm, pulse or degree.")
    start_position: dict[str, float | None] | None = Field(
        None, description="By axis, as it is now; null while the robot does not tell it."
    )
    target_position: dict[str, float | None] | None = Field(
        None, description="By axis that moves, where it can be known beforehand."
    )
    duration_s: float | None = Field(
        None, description="How long it would move by the settings of now, where that can be calculated."
    )
    note: str | None = Field(None, description="Why something is not known, or would be refused.")


class NotCalculable(Exception):
    """The manual does not say enough to calculate how an axis goes; the message says of what."""


@dataclass(frozen=True)
class Ride:
    """How an axis goes from rest to rest: up a ramp, on, and down a ramp; in units and seconds."""

    way: float
    low: float
    """The speed it starts with and ends with."""
    peak: float
    faster: float
    """By how much it grows a second."""
    slower: float

    @property
    def _up_s(self) -> float:
        return (self.peak - self.low) / self.faster

    @property
    def duration_s(self) -> float:
        """How long it goes."""
        ramps_s = self._up_s + (self.peak - self.low) / self.slower
        return ramps_s + max(self.way - (self.low + self.peak) / 2 * ramps_s, 0.0) / self.peak

    def gone(self, seconds: float) -> float:
        """How far it has gone after so many seconds."""
        left_s = self.duration_s - seconds
        if seconds <= 0 or left_s <= 0:
            return 0.0 if seconds <= 0 else self.way
        if seconds < self._up_s:
            return seconds * (self.low + self.faster * seconds / 2)
        if left_s < (self.peak - self.low) / self.slower:
            return self.way - left_s * (self.low + self.slower * left_s / 2)
        return self._up_s * (self.low + self.peak) / 2 + (seconds - self._up_s) * self.peak


async def plan_of(unit: RobotUnit, command: FicsCommand[Any]) -> PlannedRobotMove:
    """Work out a move as far as the robot and its present settings tell. Only reads are sent.

    :raises InvalidRequest: the unit cannot do it, whatever its state.
    """
    check(unit, command)
    coordinates = unit.coordinates_of(command)
    plan = PlannedRobotMove(
        body_id=unit.address,
        frame=unit.frame_of(command),
        coordinates=coordinates,
        units=unit.counted_in(coordinates),
    )
    try:
        await _foresee(plan, unit, command)
    except (NotHomed, PositionUnknown) as error:
        plan.note = f"It would be refused: {error.detail}"
    except (GatewayError, NotCalculable) as error:
        plan.note = str(error)
    return plan


async def _foresee(plan: PlannedRobotMove, unit: RobotUnit, command: FicsCommand[Any]) -> None:
    plan.start_position = start = await unit.position(plan.coordinates)
    stored = None
    if isinstance(command, MoveToPosition):
        stored = await unit.stored(command.position)
        if stored is None:
            raise NotCalculable(f"It would be refused: position {command.position} is not set.")
    plan.target_position = target = target_of(unit, command, start, stored)
    await unit.require_places(places_it_needs(unit, command, start, target), command)
    end = end_of(unit, command, start, target) or {}
    if crossed := await crossed_limits(unit, plan.coordinates, end):
        raise NotCalculable(f"It would be refused: {', and '.join(it.said.en for it in crossed)}.")
    try:
        plan.duration_s = await _duration_s(plan, unit, command)
    except NotCalculable as unknown:
        raise NotCalculable(f"{unknown}{_limits_of_motors(unit, end)}") from None


async def _duration_s(plan: PlannedRobotMove, unit: RobotUnit, command: FicsCommand[Any]) -> float:
    if plan.target_position is None:
        raise NotCalculable("How far it goes is only known when it is done.")
    rides = await rides_of(unit, plan.coordinates, _ways(plan, command))
    return round(max((it.duration_s for it in rides.values()), default=0.0), 3)


def _limits_of_motors(unit: RobotUnit, end: Places) -> str:
    """Tell which limits cannot be checked: those of motors whose places only the robot can calculate."""
    motors = dict.fromkeys(it for axis in end if unit.converted(axis) for it in unit.motors_behind(axis))
    if not motors:
        return ""
    return f" Only the robot knows whether the soft limits of its motors {' and '.join(motors)} allow it."


def _ways(plan: PlannedRobotMove, command: FicsCommand[Any]) -> dict[str, float]:
    """How far each axis goes; a relative move knows it without knowing from where."""
    if isinstance(command, MoveRelative | MoveMotorsRelative):
        amounts = zip(plan.units, command.coordinates, strict=False)
        return {axis: abs(amount) for axis, amount in amounts if amount}
    start, target = plan.start_position or {}, plan.target_position or {}
    ways = {axis: abs((place or 0.0) - (start[axis] or 0.0)) for axis, place in target.items()}
    return {axis: way for axis, way in ways.items() if way}


async def rides_of(unit: RobotUnit, coordinates: Coordinates, ways: Mapping[str, float]) -> dict[str, Ride]:
    """Work out how a single axis goes its way; the manual tells of no more than that.

    :raises NotCalculable: several axes go, or something is not known.
    :raises GatewayError: a setting was not read.
    """
    if not ways:
        return {}
    (axis, way), *others = ways.items()
    if others:
        raise NotCalculable("How the robot times several axes together is not known.")
    if coordinates == "user" and unit.converted(axis):
        raise NotCalculable(f"Axis {axis} is moved by several motors, so its duration is not known.")
    if (await unit.read(speeds.GetSmoothAcceleration())).enabled:
        raise NotCalculable("S-curves are on, and how long they ramp is not known.")
    names = unit.names(coordinates)
    top, percent, up_ms, down_ms = [await _setting(unit, query, names, axis) for query in ROWS[coordinates]]
    start_pps = await _setting(unit, speeds.GetSelfStartSpeeds(), unit.motor_axes, axis)
    system = unit.systems[axis]
    if start_pps and system is not AxisSystem.PULSE:
        raise NotCalculable(f"The start speed of axis {axis} is in pulses, not in {system}.")
    top *= PER_SECOND[system]
    return {axis: ride_over(way, min(start_pps, top), top, percent / 100, up_ms / 1000, down_ms / 1000)}


async def _setting(unit: RobotUnit, query: FicsCommand[Any], names: list[str], axis: str) -> float:
    """Read one setting of an axis; the only field of the reply has one value for each axis."""
    reply = await unit.read(query)
    (values,) = reply.model_dump().values()
    value = dict(zip(names, values, strict=False)).get(axis)
    if value is None or value < 0:
        raise NotCalculable(f"The robot does not tell the {query.titles()[1].removeprefix('get the ')}.")
    return float(value)


def ride_over(way: float, start: float, top: float, share: float, up_s: float, down_s: float) -> Ride:
    """Work out a ride over a way, at a share of the top speed, in units and seconds.

    An assumption: the times are those from start to top speed, so a slower move ramps for a shorter time.

    :raises NotCalculable: it never comes there.
    """
    speed = top * share
    if speed <= 0:
        raise NotCalculable("The maximum speed is 0.")
    low = min(start, speed)
    faster, slower = (top - start) / up_s if up_s else inf, (top - start) / down_s if down_s else inf
    if not faster or not slower:
        return Ride(way, speed, speed, inf, inf)
    cost = 1 / (2 * faster) + 1 / (2 * slower)
    return Ride(way, low, min(speed, sqrt(low**2 + way / cost)) if cost else speed, faster, slower)
