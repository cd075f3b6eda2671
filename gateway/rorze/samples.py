"""Where a body was seen during a move, beside where the speed curve of its settings leads."""

from collections.abc import Awaitable, Callable, Mapping
from datetime import datetime
from typing import Any, Final

from pydantic import Field

from gateway.core.errors import ControllerRefused, GatewayError
from gateway.core.move_log import Trajectory
from gateway.core.move_record import Move, MoveKind
from gateway.core.records import Record
from gateway.rorze.bodies import Body
from gateway.rorze.plans import Planned, trajectory_of
from protocols.rorze.profile import ProfileError
from protocols.rorze.row import RorzeCommand

PLAN_POINTS = 200
"""Moments of a plan that are told, besides those where a part of its curve begins."""


_WHY_NONE: Final[Mapping[MoveKind, str]] = {
    "interpolated": "It goes along a path with the other axes of its group, which was prepared by commands "
    "of its own: only the controllers know it."
}


class BodySample(Record):
    """Where a motor stood."""

    time: datetime = Field(description="Time of the controller's answer.")
    time_s: float = Field(description="Seconds since the move's command was written.")
    pulses: int
    value: float | None = Field(description="Position in `unit`; null without a scale.")
    planned_pulses: float | None = Field(
        description="Planned place in pulses at this time; null without a plan."
    )


class PlannedPoint(Record):
    """Where the plan has a motor, had it begun when its command was written."""

    time_s: float
    pulses: float
    speed: float = Field(description="Pulses per second; below 0 where positions decrease.")


class BodySamples(Record):
    """Where a body was seen during a move: each answer that told its position, 512 at most."""

    move_id: str
    body_id: str
    unit: str | None
    pulses_per_unit: float | None = Field(description="The body's scale; null without one.")
    planned_s: float | None = Field(
        description="Seconds for which pulses run in the plan; null without a plan or an end."
    )
    plan: list[PlannedPoint] | None = Field(
        description="Evenly spread, and where a part of the curve begins."
    )
    note: str | None = Field(description="Why there is no plan.")
    samples: list[BodySample]


class BodyTrajectory(Trajectory[int]):
    """The trajectory of a body's move, and what its plan is made of."""

    def __init__(self, body: Body, move: Move, command: RorzeCommand[Any], at: float) -> None:
        super().__init__(move.sent_at or move.created_at, at, move.start_position or 0)
        self.body, self.move, self.command = body, move, command
        self._settings = body.settings
        self._plan: Planned | str | None = None
        self.work_out: Callable[[], Awaitable[Planned]] | None = None
        """Works out the plan of an axis that goes along a path with others."""

    async def plan(self) -> Planned | str:
        """Calculate the plan by the settings that the move was made with, or say why there is none.

        They are read at the first request: no move waits for its plan.
        """
        if self._plan is None:
            try:
                self._plan = await self._read_plan()
            except GatewayError as error:
                return f"The settings could not be read: {error.detail}"
        return self._plan

    async def _read_plan(self) -> Planned | str:
        body, move = self.body, self.move
        plan: Planned | None
        try:
            plan = await (self.work_out() if self.work_out else self._alone())
        except (ProfileError, ControllerRefused) as error:
            return f"The settings make no plan: {error}"
        if body.settings != self._settings:
            return "Settings of the body may have changed since the move began."
        return plan or _WHY_NONE.get(move.kind, "How far it goes was only known when it was done.")

    async def _alone(self) -> Planned | None:
        move = self.move
        return await trajectory_of(self.body, self.command, move.start_position or 0, move.target_position)


async def samples_of(trajectory: BodyTrajectory) -> BodySamples:
    """Give the samples of a move, with the plan beside them where there is one."""
    body, plan = trajectory.body, await trajectory.plan()
    scale, known = body.scale, None if isinstance(plan, str) else plan
    return BodySamples(
        move_id=trajectory.move.id,
        body_id=body.address,
        unit=scale.unit if scale else None,
        pulses_per_unit=scale.pulses_per_unit if scale else None,
        planned_s=known.profile.duration_s if known else None,
        plan=_points(known, trajectory.places[-1][0]) if known else None,
        note=plan if isinstance(plan, str) else None,
        samples=[
            BodySample(
                time=trajectory.time_of(seconds),
                time_s=round(seconds, 6),
                pulses=pulses,
                value=scale.value(pulses) if scale else None,
                planned_pulses=round(known.position(seconds), 3) if known else None,
            )
            for seconds, pulses in trajectory.places
        ],
    )


def _points(plan: Planned, seen_s: float) -> list[PlannedPoint]:
    """The plan to its end, or as far as an endless move was seen."""
    end_s = plan.profile.duration_s
    last_s = seen_s if end_s is None else end_s
    even = (last_s * index / (PLAN_POINTS - 1) for index in range(PLAN_POINTS))
    begins = (phase.start_s for phase in plan.profile.curve.phases if phase.start_s < last_s)
    return [
        PlannedPoint(time_s=at_s, pulses=round(plan.position(at_s), 3), speed=round(plan.speed(at_s), 3))
        for at_s in sorted({*even, *begins})
    ]
