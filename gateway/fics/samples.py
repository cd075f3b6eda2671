"""Where a unit of a robot was seen during a move, beside where its settings lead an axis that goes alone."""

from collections.abc import Mapping
from datetime import datetime

from pydantic import Field

from gateway.core.errors import GatewayError
from gateway.core.records import Record
from gateway.core.trajectories import Trajectory
from gateway.fics.axes import Coordinates, Places
from gateway.fics.move_record import RobotMove
from gateway.fics.plans import NotCalculable, Ride, rides_of
from gateway.fics.units import RobotUnit


class RobotSample(Record):
    """Where the axes stood."""

    time: datetime = Field(description="When the robot's answer came.")
    time_s: float = Field(description="Seconds since the move's command was written.")
    axes: dict[str, float | None] = Field(description="Null while the robot does not know it.")
    planned: dict[str, float] | None = Field(
        description="Where the plan has the axis that moves then, in its `units`; null without a plan."
    )


class RobotSamples(Record):
    """Where a unit was seen during a move: 512 answers at most."""

    move_id: str
    robot_id: str
    unit: int
    coordinates: Coordinates
    units: dict[str, str] = Field(description="What positions are counted in, by axis: mm, pulse or degree.")
    planned_s: float | None = Field(
        description="How long the plan has it move, in seconds; null without a plan."
    )
    note: str | None = Field(description="Why there is no plan.")
    samples: list[RobotSample]


class RobotTrajectory(Trajectory[Places]):
    """The trajectory of a unit's move, and what its plan is made of."""

    def __init__(self, unit: RobotUnit, move: RobotMove, sent_at: datetime, at: float) -> None:
        super().__init__(sent_at, at, move.start_position or dict.fromkeys(move.units))
        self.unit, self.move = unit, move
        self._settings_changed = unit.settings_changed
        self._rides: dict[str, Ride] | str | None = None

    async def rides(self) -> dict[str, Ride] | str:
        """Work out the plan by the settings that the move was made with, or say why there is none.

        They are read when somebody first asks: no move waits for its plan.
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
        if self.unit.settings_changed != self._settings_changed:
            return "Settings of the robot may have changed since the move began."
        return rides

    @property
    def distances(self) -> Mapping[str, float] | None:
        """How far each axis that moves was to go; None where that was not known beforehand."""
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
        """Where the plan has the axes that move after so many seconds."""
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
        else round(max((it.duration_s for it in rides.values()), default=0.0), 3),
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
