"""Moves over HTTP: their kinds in the client's words, and the one way in which every move is started."""

import asyncio
from typing import Annotated, Any, Final, Literal, Self

from fastapi import Query, Request, Response
from pydantic import BaseModel, Field, ValidationError, WithJsonSchema, model_validator

from api.common.problems import DECLARED
from api.common.requests import (
    BodyId,
    GroupId,
    RequestModel,
    Wait,
    example,
    json_response,
    new_router,
    plant_of,
    wait_headers,
    wait_s,
)
from gateway.core.errors import InvalidRequest, NotAllowed, NotFound
from gateway.core.move_record import Move
from gateway.core.rights import Right
from gateway.plant import Plant
from gateway.rorze.bodies import Body, Group
from gateway.rorze.plans import PlannedMove, plan_of
from gateway.rorze.units import Scale, Unit, to_pulses
from protocols.rorze import moves, origin
from protocols.rorze.moves import RelativeMove
from protocols.rorze.row import RorzeCommand
from protocols.wording import expectation

router = new_router("moves")

Direction = Literal["cw", "ccw"]
Speed = Literal["high", "low"]
Pattern = Annotated[
    int | None,
    Field(ge=0, le=29, description="Acceleration pattern; left out, number 30 (RC-420 manual 13.3.4)."),
]
MotionRow = type[RorzeCommand[Any]]

_RELATIVE: Final[dict[tuple[Direction, Speed], MotionRow]] = {
    ("cw", "high"): moves.MoveClockwise,
    ("ccw", "high"): moves.MoveCounterclockwise,
    ("cw", "low"): moves.MoveClockwiseSlowly,
    ("ccw", "low"): moves.MoveCounterclockwiseSlowly,
}
_ABSOLUTE: Final[dict[Speed, MotionRow]] = {"high": moves.MoveTo, "low": moves.MoveToSlowly}
_HOME: Final[dict[str, MotionRow]] = {
    "standard": origin.Home,
    "stall_detection": origin.HomeWithStallDetection,
    "fast_then_stop": origin.HomeFastThenStop,
    "fast_then_decelerate": origin.HomeFastThenDecelerate,
    "rc204": origin.HomeLikeRc204,
}


class Length(RequestModel, json_schema_extra=example(value=0, unit="pulse")):
    """A distance or a position with its unit."""

    value: Annotated[int | float, WithJsonSchema({"type": "number"})] = Field(
        gt=-1e9, lt=1e9, description="Pulses are whole numbers, written without a point."
    )
    unit: Unit = Field(description="mm, um, deg and mdeg need the body's scale in the configuration.")

    def pulses(self, scale: Scale | None) -> int:
        """The same in pulses.

        :raises InvalidRequest: the body has no scale for this unit.
        """
        return to_pulses(self.value, self.unit, scale)

    @model_validator(mode="after")
    def _whole_pulses(self) -> Self:
        if self.unit == "pulse" and isinstance(self.value, float):
            raise ValueError(f"pulses must be a whole number without a point, not {self.value}")
        return self


class _MoveRequest(RequestModel):
    validate_only: bool = Field(
        default=False, description="Only say what would be sent and how long it would take; nothing moves."
    )


class RelativeMoveRequest(
    _MoveRequest,
    json_schema_extra=example(kind="relative", direction="cw", distance={"value": 500, "unit": "pulse"}),
):
    """Move by a distance (RC-420 manual 13.2)."""

    kind: Literal["relative"]
    direction: Direction
    distance: Length
    speed: Speed = Field(default="high", description="`low` runs at the start speed, without ramps.")
    pattern: Pattern = None

    def command(self, scale: Scale | None) -> RorzeCommand[Any]:
        """The controller's command for it."""
        row = _RELATIVE[self.direction, self.speed]
        return _built(row, distance=self.distance.pulses(scale), pattern=self.pattern)


class AbsoluteMoveRequest(
    _MoveRequest, json_schema_extra=example(kind="absolute", position={"value": 0, "unit": "pulse"})
):
    """Move to a position (RC-420 manual 13.2)."""

    kind: Literal["absolute"]
    position: Length
    speed: Speed = Field(default="high", description="`low` runs at the start speed, without ramps.")
    pattern: Pattern = None

    def command(self, scale: Scale | None) -> RorzeCommand[Any]:
        """The controller's command for it."""
        return _built(_ABSOLUTE[self.speed], position=self.position.pulses(scale), pattern=self.pattern)


class HomeRequest(_MoveRequest, json_schema_extra=example(kind="home")):
    """Search the origin (RC-420 manual 13.5)."""

    kind: Literal["home"]
    method: Literal["standard", "stall_detection", "fast_then_stop", "fast_then_decelerate", "rc204"] = Field(
        default="standard", description="Commands 00M, 01M, 02M, 03M and 04M, in this order."
    )

    def command(self, _: Scale | None) -> RorzeCommand[Any]:
        """The controller's command for it."""
        return _HOME[self.method]()


class ContinuousMoveRequest(
    _MoveRequest, json_schema_extra=example(kind="continuous", direction="cw", speed="low")
):
    """Move until stopped; only where the configuration has `allow_endless_moves`."""

    kind: Literal["continuous"]
    direction: Direction
    speed: Speed = Field(default="high", description="`low` runs at the start speed, without ramps.")
    pattern: Pattern = None

    def command(self, _: Scale | None) -> RorzeCommand[Any]:
        """The controller's command for it."""
        return _built(_RELATIVE[self.direction, self.speed], distance="endless", pattern=self.pattern)


MoveRequest = Annotated[
    RelativeMoveRequest | AbsoluteMoveRequest | HomeRequest | ContinuousMoveRequest,
    Field(discriminator="kind"),
]


def _built(row: MotionRow, **parameters: object) -> RorzeCommand[Any]:
    try:
        return row(**parameters)
    except ValidationError as error:
        fault = error.errors()[0]
        raise InvalidRequest(
            f"{fault['loc'][0]} comes to {parameters[str(fault['loc'][0])]} pulses: {expectation(fault)}; "
            "nothing was sent."
        ) from None


class MoveList(BaseModel):
    """Moves of a body, newest first."""

    moves: list[Move]


class GroupMove(BaseModel):
    """One command to a group, with one move for each member."""

    group_id: str
    moves: list[Move]


class GroupPlan(BaseModel):
    """A group's move that was checked and not sent."""

    group_id: str
    frame: str = Field(description="The exact bytes that would be sent, CR as \\r.")
    members: list[PlannedMove]


ENDS_DECLARED: Final[dict[int | str, dict[str, Any]]] = {
    **DECLARED,
    200: {"model": Move, "description": "The move is over; `status` says how it ended."},
    202: {"description": "The controller has accepted the move; ask again at Location."},
}
GROUP_ENDS_DECLARED: Final[dict[int | str, dict[str, Any]]] = {
    **DECLARED,
    200: {"model": GroupMove, "description": "All moves are over; `status` says how each ended."},
    202: {"description": "The moves are under way."},
}


@router.post(
    "/bodies/{body_id}/moves",
    Right.OPERATE,
    status_code=202,
    response_model=Move,
    responses={**ENDS_DECLARED, 200: {**ENDS_DECLARED[200], "model": Move | PlannedMove}},
)
async def start_move(request: Request, body_id: BodyId, move: MoveRequest, wait: Wait = None) -> Response:
    """Start a move, or with `validate_only` say what it would be.

    202 when the controller has accepted it and it is not over, 200 when it ended while the request waited. A
    move that has started and failed is no HTTP error: see its `status`, `end_cause` and `error`.
    """
    body = plant_of(request).body(body_id)
    command = move.command(body.scale)
    if move.validate_only:
        _require_end(plant_of(request), command)
        return json_response(await plan_of(body, command))
    return await perform(request, body, command, wait)


@router.get("/bodies/{body_id}/moves", Right.VIEW, response_model=MoveList)
async def list_moves(
    request: Request, body_id: BodyId, limit: Annotated[int, Query(ge=1, le=1000)] = 100
) -> Response:
    """List the body's moves, newest first."""
    plant = plant_of(request)
    return json_response(MoveList(moves=plant.moves.of(plant.body(body_id))[:limit]))


@router.get("/bodies/{body_id}/moves/{move_id}", Right.VIEW, response_model=Move)
async def get_move(request: Request, body_id: BodyId, move_id: str, wait: Wait = None) -> Response:
    """Get a move, at once or when it is over."""
    plant = plant_of(request)
    body = plant.body(body_id)
    if plant.moves.get(move_id).body_id != body.address:
        raise NotFound(f"{body.address} has no move {move_id}.")
    waited_s = wait_s(request, wait)
    return json_response(await plant.moves.wait(move_id, waited_s), headers=wait_headers(waited_s))


@router.post(
    "/groups/{group_id}/moves",
    Right.OPERATE,
    status_code=202,
    response_model=GroupMove,
    responses={**GROUP_ENDS_DECLARED, 200: {**GROUP_ENDS_DECLARED[200], "model": GroupMove | GroupPlan}},
)
async def start_group_move(
    request: Request, group_id: GroupId, move: MoveRequest, wait: Wait = None
) -> Response:
    """Start a move of all members of a group by one command; each has a move of its own."""
    group = plant_of(request).group(group_id)
    command = _common_command(group, move)
    if move.validate_only:
        _require_end(plant_of(request), command)
        return json_response(await _group_plan(group, command))
    return await perform(request, group, command, wait)


def _common_command(group: Group, move: MoveRequest) -> RorzeCommand[Any]:
    first, *others = [move.command(member.scale) for member in group.members]
    if any(command != first for command in others):
        raise InvalidRequest(
            f"The members of {group.address} have different scales, but get one command; nothing was sent.",
            "Give pulses.",
        )
    return first


async def _group_plan(group: Group, command: RorzeCommand[Any]) -> GroupPlan:
    frame = group.line.frame_of(group.number, command)
    plans = await asyncio.gather(*(plan_of(member, command) for member in group.members))
    members = [plan.model_copy(update={"frame": frame}) for plan in plans]
    return GroupPlan(group_id=group.address, frame=frame, members=members)


async def perform(
    request: Request, target: Body | Group, command: RorzeCommand[Any], wait: float | None
) -> Response:
    """Send a motion command and answer with its move, or with one for each member of a group.

    :raises NotAllowed: it would never end, and the configuration does not allow that.
    :raises GatewayError: it was refused, or not sent.
    """
    plant = plant_of(request)
    _require_end(plant, command)
    started = await plant.moves.start(target, command)
    waited_s = wait_s(request, wait)
    if waited_s:
        await asyncio.gather(*(plant.moves.wait(move.id, waited_s) for move in started))
    status = 200 if all(move.status.final for move in started) else 202
    headers = wait_headers(waited_s)
    if isinstance(target, Group):
        return json_response(GroupMove(group_id=target.address, moves=started), status, headers)
    headers["Location"] = f"/bodies/{target.address}/moves/{started[0].id}"
    return json_response(started[0], status, headers)


def _require_end(plant: Plant, command: RorzeCommand[Any]) -> None:
    endless = isinstance(command, RelativeMove) and command.distance == "endless"
    if endless and not plant.config.server.allow_endless_moves:
        raise NotAllowed(
            "Moves without an end are switched off; nothing was sent.",
            "Give a distance, or set allow_endless_moves in the configuration.",
        )
