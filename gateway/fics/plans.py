"""Plans of robots' moves: the exact frame, the way, the duration; and the samples beside a plan."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from math import inf, sqrt
from typing import Any, Final

from pydantic import Field

from gateway.core.errors import ControllerRefused, GatewayError
from gateway.core.exchange import Lane
from gateway.core.move_log import Trajectory
from gateway.core.records import Record
from gateway.fics.axes import AxisDuration, AxisDurations, AxisUnits, AxisValues, CoordinateSystem, Places
from gateway.fics.conversation import STATE_FORBIDS
from gateway.fics.errors import NotHomed, PositionUnknown
from gateway.fics.motion_state import SMOOTH
from gateway.fics.move_record import RobotMove, check
from gateway.fics.settings import crossed_limits
from gateway.fics.targets import end_of, places_it_needs, target_of
from gateway.fics.units import RobotUnit
from protocols.fics import motor_axes, speeds
from protocols.fics.motor_axes import MoveMotorsRelative
from protocols.fics.moves import MoveRelative, MoveToPosition
from protocols.fics.notation import AxisSystem
from protocols.fics.row import FicsCommand

PER_SECOND = {AxisSystem.MILLIMETRE: 1.0, AxisSystem.PULSE: 1000.0, AxisSystem.DEGREE: 6.0}
"""Units of position a second in mm/s, kpps and rpm (C-HOST manual 1-5)."""
PATIENCE, PATIENCE_S = 1.5, 5.0
"""A move is overdue after this multiple of its reckoning and this time more, in seconds."""

ROWS: Final[Mapping[CoordinateSystem, Sequence[FicsCommand[Any]]]] = {
    "user": (
        speeds.GetMaximumSpeeds(),
        speeds.GetSpeedPercent(),
        speeds.GetAccelerationTimes(),
        speeds.GetDecelerationTimes(),
    ),
    "motor": (
        motor_axes.GetMotorMaximumSpeeds(),
        motor_axes.GetMotorSpeedPercent(),
        motor_axes.GetMotorAccelerationTimes(),
        motor_axes.GetMotorDecelerationTimes(),
    ),
}
"""The questions for the maximum speeds, their percents and both times of user and of motor axes."""


async def longest_move_s(
    unit: RobotUnit, coordinates: CoordinateSystem, start: Places, target: Places
) -> float | None:
    """The longest time in seconds that a move takes; None where a place or a speed is not known.

    :raises ControllerRefused: a state of the system forbids the question, and motion (C-HOST manual 1-7).
    """
    return longest_s(start, target, await _durations_of(unit, coordinates))


async def _durations_of(unit: RobotUnit, coordinates: CoordinateSystem) -> AxisDurations:
    """How fast the axes of a unit go, kept until a setting may have changed; empty where it is not told."""
    known, key = unit.known, (unit.number, coordinates)
    if key in known.durations:
        return known.durations[key]
    changed = known.settings_changed
    try:
        found = await _durations_read(unit, coordinates)
    except ControllerRefused as refused:
        if refused.error_code in STATE_FORBIDS:
            raise  # what forbids the question forbids motion, too
        return {}
    except GatewayError:
        return {}
    if known.settings_changed == changed:
        known.durations[key] = found
    return found


async def _durations_read(unit: RobotUnit, coordinates: CoordinateSystem) -> AxisDurations:
    rows = ROWS[coordinates]
    top, percent, up, down = [await unit.read(row, Lane.COMMAND) for row in rows]
    told = zip(
        unit.names(coordinates), top.speeds, percent.percents, up.times_ms, down.times_ms, strict=False
    )
    return {
        axis: AxisDuration(
            speed * PER_SECOND[unit.systems[axis]] * share / 100, SMOOTH * (up_ms + down_ms) / 1000
        )
        for axis, speed, share, up_ms, down_ms in told
        if speed > 0 and share > 0
    }


def longest_s(start: Places, target: Places | None, axes: AxisDurations) -> float | None:
    """The longest time in seconds that a move takes; None where a place or a speed is not known."""
    longest = 0.0
    for axis, wanted in (target or {}).items():
        place, duration = start.get(axis), axes.get(axis)
        if wanted is None or place is None or duration is None:
            return None
        longest = max(longest, duration.seconds(abs(wanted - place)))
    return round(longest, 3) if target else None


class PlannedRobotMove(Record):
    """A move that was checked and not sent."""

    body_id: str = Field(description="Address of the unit, ROBOT/units/1.")
    frame: str = Field(description="The exact bytes that would be sent, CR as \\r.")
    coordinates: CoordinateSystem = Field(description="Coordinates of the positions.")
    units: AxisUnits = Field(description="Units by axis: mm, pulse or degree.")
    start_position: AxisValues | None = Field(
        None, description="Present position by axis; null while the robot does not tell it."
    )
    target_position: AxisValues | None = Field(
        None, description="Target by axis that moves, where it can be known beforehand."
    )
    duration_s: float | None = Field(
        None, description="Seconds that it would move by the present settings, where that can be calculated."
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
    """Acceleration in units per second squared."""
    slower: float

    @property
    def _up_s(self) -> float:
        return (self.peak - self.low) / self.faster

    @property
    def duration_s(self) -> float:
        """The duration of the stroke in seconds."""
        ramps_s = self._up_s + (self.peak - self.low) / self.slower
        return ramps_s + max(self.way - (self.low + self.peak) / 2 * ramps_s, 0.0) / self.peak

    def gone(self, seconds: float) -> float:
        """The way that is behind it after a time in seconds."""
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
        raise NotCalculable(f"It would be refused: {', and '.join(limit.said.en for limit in crossed)}.")
    try:
        plan.duration_s = await _duration_s(plan, unit, command)
    except NotCalculable as unknown:
        raise NotCalculable(f"{unknown}{_limits_of_motors(unit, end)}") from None


async def _duration_s(plan: PlannedRobotMove, unit: RobotUnit, command: FicsCommand[Any]) -> float:
    if plan.target_position is None:
        raise NotCalculable("How far it goes is only known when it is done.")
    rides = await rides_of(unit, plan.coordinates, _ways(plan, command))
    return round(max((ride.duration_s for ride in rides.values()), default=0.0), 3)


def _limits_of_motors(unit: RobotUnit, end: Places) -> str:
    """Tell which limits cannot be checked: those of motors whose places only the robot can calculate."""
    motors = dict.fromkeys(
        motor for axis in end if unit.converted(axis) for motor in unit.motors_behind(axis)
    )
    if not motors:
        return ""
    return f" Only the robot knows whether the soft limits of its motors {' and '.join(motors)} allow it."


def _ways(plan: PlannedRobotMove, command: FicsCommand[Any]) -> dict[str, float]:
    """The way of each axis, without a sign; a relative move knows it without its start."""
    if isinstance(command, MoveRelative | MoveMotorsRelative):
        amounts = zip(plan.units, command.coordinates, strict=False)
        return {axis: abs(amount) for axis, amount in amounts if amount}
    start, target = plan.start_position or {}, plan.target_position or {}
    ways = {axis: abs((place or 0.0) - (start[axis] or 0.0)) for axis, place in target.items()}
    return {axis: way for axis, way in ways.items() if way}


async def rides_of(
    unit: RobotUnit, coordinates: CoordinateSystem, ways: Mapping[str, float]
) -> dict[str, Ride]:
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


class RobotSample(Record):
    """Where the axes stood."""

    time: datetime = Field(description="Time of the robot's answer.")
    time_s: float = Field(description="Seconds since the move's command was written.")
    axes: AxisValues = Field(description="Coordinates by axis; null while the robot does not know one.")
    planned: dict[str, float] | None = Field(
        description="Planned place of the axis that moves at this time, in its `units`; null without a plan."
    )


class RobotSamples(Record):
    """Where a unit was seen during a move: 512 answers at most."""

    move_id: str
    robot_id: str
    unit: int
    coordinates: CoordinateSystem
    units: AxisUnits = Field(description="Units of the positions, by axis: mm, pulse or degree.")
    planned_s: float | None = Field(description="Seconds that the plan takes; null without a plan.")
    note: str | None = Field(description="Why there is no plan.")
    samples: list[RobotSample]


class RobotTrajectory(Trajectory[Places]):
    """The trajectory of a unit's move, and what its plan is made of."""

    def __init__(self, unit: RobotUnit, move: RobotMove, sent_at: datetime, at: float) -> None:
        super().__init__(sent_at, at, move.start_position or dict.fromkeys(move.units))
        self.unit, self.move = unit, move
        self._settings_changed = unit.known.settings_changed
        self._rides: dict[str, Ride] | str | None = None

    async def rides(self) -> dict[str, Ride] | str:
        """Work out the plan by the settings that the move was made with, or say why there is none.

        They are read at the first request: no move waits for its plan.
        """
        if self._rides is None:
            try:
                self._rides = await self._read_rides()
            except GatewayError as error:
                return f"The settings could not be read: {error.detail}"
        return self._rides

    async def _read_rides(self) -> dict[str, Ride] | str:
        distances = self.distances
        if distances is None:
            return "How far it goes was only known when it was done."
        try:
            rides = await rides_of(self.unit, self.move.coordinates, distances)
        except NotCalculable as error:
            return str(error)
        if self.unit.known.settings_changed != self._settings_changed:
            return "Settings of the robot may have changed since the move began."
        return rides

    @property
    def distances(self) -> Mapping[str, float] | None:
        """The way of each axis that moves; None where that was not known beforehand."""
        start, target = self.move.start_position, self.move.target_position
        if start is None or target is None:
            return None
        found: dict[str, float] = {}
        for axis, wanted in target.items():
            place = start.get(axis)
            if wanted is None or place is None:
                return None
            if wanted != place:
                found[axis] = abs(wanted - place)
        return found

    def planned(self, rides: Mapping[str, Ride], seconds: float) -> dict[str, float]:
        """The planned places of the axes that move, after a time in seconds."""
        start, target = self.move.start_position or {}, self.move.target_position or {}
        places: dict[str, float] = {}
        for axis, ride in rides.items():
            begun, wanted = start[axis] or 0.0, target[axis] or 0.0
            gone = ride.gone(seconds)
            places[axis] = round(begun + gone if wanted > begun else begun - gone, 6)
        return places


async def samples_of(trajectory: RobotTrajectory) -> RobotSamples:
    """Give the samples of a move, with the plan beside them where there is one."""
    move, plan = trajectory.move, await trajectory.rides()
    rides = None if isinstance(plan, str) else plan
    return RobotSamples(
        move_id=move.id,
        robot_id=move.robot_id,
        unit=move.unit,
        coordinates=move.coordinates,
        units=move.units,
        planned_s=None
        if rides is None
        else round(max((ride.duration_s for ride in rides.values()), default=0.0), 3),
        note=plan if isinstance(plan, str) else None,
        samples=[
            RobotSample(
                time=trajectory.time_of(seconds),
                time_s=round(seconds, 6),
                axes=dict(places),
                planned=None if rides is None else trajectory.planned(rides, seconds),
            )
            for seconds, places in trajectory.places
        ],
    )
