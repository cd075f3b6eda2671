"""Where a body was seen during a move, beside where the speed curve of its settings leads."""

from datetime import datetime
from typing import Any

from pydantic import Field

from gateway.core.errors import ControllerRefused, GatewayError
from gateway.core.move_record import Move
from gateway.core.records import Record
from gateway.core.ways import Way
from gateway.rorze.bodies import Body
from gateway.rorze.plans import PlannedWay, way_of
from protocols.rorze.profile import ProfileError
from protocols.rorze.row import RorzeCommand


class BodySample(Record):
    """Where a motor stood."""

    time: datetime = Field(description="When the controller's answer came.")
    seconds: float = Field(description="Since the move's command was written.")
    pulses: int
    value: float | None = Field(description="The same in `unit`; null without a scale.")
    planned_pulses: float | None = Field(description="Where the plan has it then; null without a plan.")


class BodySamples(Record):
    """Where a body was seen during a move: each answer that told its position, 512 at most."""

    move_id: str
    body_id: str
    unit: str | None
    planned_s: float | None = Field(
        description="How long the plan has pulses run; null without a plan or an end."
    )
    note: str | None = Field(description="Why there is no plan.")
    samples: list[BodySample]


class BodyWay(Way[int]):
    """The way of a body's move, and what its plan is made of."""

    def __init__(self, body: Body, move: Move, command: RorzeCommand[Any], at: float) -> None:
        super().__init__(move.sent_at or move.created_at, at, move.start_position or 0)
        self.body, self.move, self.command = body, move, command
        self._settings = body.settings
        self._plan: PlannedWay | str | None = None

    async def plan(self) -> PlannedWay | str:
        """Work out the plan by the settings that the move was made with, or say why there is none.

        They are read when somebody first asks: no move waits for its plan.
        """
        if self._plan is None:
            try:
                self._plan = await self._read_plan()
            except GatewayError as error:
                return f"The settings could not be read: {error.detail}"
        return self._plan

    async def _read_plan(self) -> PlannedWay | str:
        body, move = self.body, self.move
        try:
            plan = await way_of(body, self.command, move.start_position or 0, move.target_position)
        except (ProfileError, ControllerRefused) as error:
            return f"The settings make no plan: {error}"
        if body.settings != self._settings:
            return "Settings of the body may have changed since the move began."
        return plan or "How far it goes was only known when it was done."


async def samples_of(way: BodyWay) -> BodySamples:
    """Give the samples of a move, with the plan beside them where there is one."""
    body, plan = way.body, await way.plan()
    scale, known = body.scale, None if isinstance(plan, str) else plan
    return BodySamples(
        move_id=way.move.id,
        body_id=body.address,
        unit=scale.unit if scale else None,
        planned_s=known.profile.duration_s if known else None,
        note=plan if isinstance(plan, str) else None,
        samples=[
            BodySample(
                time=way.time_of(seconds),
                seconds=round(seconds, 6),
                pulses=pulses,
                value=scale.value(pulses) if scale else None,
                planned_pulses=round(known.position(seconds), 3) if known else None,
            )
            for seconds, pulses in way.places
        ],
    )
