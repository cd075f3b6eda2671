"""Moves of robots over HTTP: their kinds in the client's words, and the one way in which each is started."""

from typing import Annotated, Any, Final, Literal

from fastapi import Body, Path, Query, Request, Response
from pydantic import BaseModel, Field

from api.common.problems import DECLARED
from api.common.requests import (
    RequestModel,
    Wait,
    example,
    json_response,
    new_router,
    plant_of,
    wait_headers,
    wait_s,
)
from api.robots.axes import Amounts, build, numbers
from api.robots.fit import require_fit
from api.robots.paths import RobotId, UnitNumber, unit_of
from gateway.core.errors import InvalidRequest, NotFound
from gateway.core.rights import Right
from gateway.fics.move_record import RobotMove
from gateway.fics.plans import PlannedRobotMove, plan_of
from gateway.fics.units import Coordinates, RobotUnit
from protocols.fics import motor_axes, moves
from protocols.fics.homing import HomeRobot
from protocols.fics.jog import StepAxis, Steps
from protocols.fics.macros import Arguments, MacroName, RunMacro
from protocols.fics.notation import AxisName, PositionNumber, Unit
from protocols.fics.row import FicsCommand

router = new_router("robot moves")

MotionRow = type[FicsCommand[Any]]
_ABSOLUTE: Final[dict[Coordinates, MotionRow]] = {
    "user": moves.MoveAbsolute,
    "motor": motor_axes.MoveMotorsAbsolute,
}
_RELATIVE: Final[dict[Coordinates, MotionRow]] = {
    "user": moves.MoveRelative,
    "motor": motor_axes.MoveMotorsRelative,
}


class _RobotMoveRequest(RequestModel):
    validate_only: bool = Field(
        default=False, description="Only say what would be sent and how long it would take; nothing moves."
    )


class _AxesMoveRequest(_RobotMoveRequest):
    coordinates: Coordinates = Field(
        default="user", description="Whether axes are those of the user or the motors (C-HOST manual 1-6)."
    )
    axes: Amounts = Field(min_length=1, description="By name; an axis that is not named stays where it is.")

    def _built(self, row: MotionRow, unit: RobotUnit) -> FicsCommand[Any]:
        names = unit.names(self.coordinates)
        return build("axes", row, coordinates=numbers("axes", unit, names, self.axes))


class RobotAbsoluteMoveRequest(
    _AxesMoveRequest, json_schema_extra=example(kind="absolute", axes={"X": {"value": 10, "unit": "mm"}})
):
    """Move axes to a position (C-HOST manual 2-6, 4-3)."""

    kind: Literal["absolute"]

    def command(self, unit: RobotUnit) -> FicsCommand[Any]:
        """The robot's command for it."""
        return self._built(_ABSOLUTE[self.coordinates], unit)


class RobotRelativeMoveRequest(
    _AxesMoveRequest, json_schema_extra=example(kind="relative", axes={"X": {"value": 10, "unit": "mm"}})
):
    """Move axes by an amount (C-HOST manual 2-5, 4-2)."""

    kind: Literal["relative"]

    def command(self, unit: RobotUnit) -> FicsCommand[Any]:
        """The robot's command for it."""
        return self._built(_RELATIVE[self.coordinates], unit)


class RobotPositionMoveRequest(_RobotMoveRequest, json_schema_extra=example(kind="position", position=1)):
    """Move to a stored position (C-HOST manual 2-16)."""

    kind: Literal["position"]
    position: PositionNumber = Field(description="Number of the position, 1-1999; it has to be set.")

    def command(self, _: RobotUnit) -> FicsCommand[Any]:
        """The robot's command for it."""
        return moves.MoveToPosition(position=self.position)


class RobotHomeRequest(_RobotMoveRequest, json_schema_extra=example(kind="home")):
    """Home all axes, or the mechanism as its program does it (C-HOST manual 2-4)."""

    kind: Literal["home"]

    def command(self, _: RobotUnit) -> FicsCommand[Any]:
        """The robot's command for it."""
        return HomeRobot()


class RobotStepRequest(_RobotMoveRequest, json_schema_extra=example(kind="step", axis="X", steps=10)):
    """Move one axis by a few of the smallest amounts it displays (C-HOST manual 2-3)."""

    kind: Literal["step"]
    axis: AxisName
    steps: Steps = Field(description="1-255 in either direction.")

    def command(self, _: RobotUnit) -> FicsCommand[Any]:
        """The robot's command for it."""
        return StepAxis(axis=self.axis, steps=self.steps)


RobotMoveRequest = Annotated[
    RobotAbsoluteMoveRequest
    | RobotRelativeMoveRequest
    | RobotPositionMoveRequest
    | RobotHomeRequest
    | RobotStepRequest,
    Field(discriminator="kind"),
]


class MacroRunRequest(RequestModel, json_schema_extra=example(unit=1)):
    """How to run a macro (C-HOST manual 1-7)."""

    unit: Unit | None = Field(
        default=None, description="The unit that is selected while it runs; left out, the only one."
    )
    arguments: Arguments | None = Field(default=None, description="Up to four numbers; null leaves one out.")


class RobotMoveList(BaseModel):
    """Moves of a unit, newest first."""

    moves: list[RobotMove]


ROBOT_ENDS_DECLARED: Final[dict[int | str, dict[str, Any]]] = {
    **DECLARED,
    200: {"model": RobotMove, "description": "The move is over; `status` says how it ended."},
    202: {"description": "The robot has not refused the move; ask again at Location."},
}


@router.post(
    "/robots/{robot_id}/units/{unit}/moves",
    Right.OPERATE,
    status_code=202,
    response_model=RobotMove,
    responses={
        **ROBOT_ENDS_DECLARED,
        200: {**ROBOT_ENDS_DECLARED[200], "model": RobotMove | PlannedRobotMove},
    },
)
async def start_robot_move(
    request: Request, robot_id: RobotId, unit: UnitNumber, move: RobotMoveRequest, wait: Wait = None
) -> Response:
    """Start a move of a unit, or with `validate_only` say what it would be.

    202 when the robot has not refused it and it is not over, 200 when it ended while the request waited. A
    move that has started and failed is no HTTP error: see its `status`, `end_cause` and `error`.
    """
    axes = unit_of(request, robot_id, unit)
    command = move.command(axes)
    if move.validate_only:
        require_fit(axes, command)
        return json_response(await plan_of(axes, command))
    return await perform(request, axes, command, wait)


@router.get("/robots/{robot_id}/units/{unit}/moves", Right.VIEW, response_model=RobotMoveList)
async def list_robot_moves(
    request: Request,
    robot_id: RobotId,
    unit: UnitNumber,
    limit: Annotated[int, Query(ge=1, le=1000)] = 100,
) -> Response:
    """List the unit's moves, newest first."""
    axes = unit_of(request, robot_id, unit)
    return json_response(RobotMoveList(moves=plant_of(request).robot_moves.of(axes)[:limit]))


@router.get("/robots/{robot_id}/units/{unit}/moves/{move_id}", Right.VIEW, response_model=RobotMove)
async def get_robot_move(
    request: Request, robot_id: RobotId, unit: UnitNumber, move_id: str, wait: Wait = None
) -> Response:
    """Get a move, at once or when it is over."""
    moves_of_robots = plant_of(request).robot_moves
    axes = unit_of(request, robot_id, unit)
    if moves_of_robots.get(move_id).body_id != axes.address:
        raise NotFound(f"{axes.address} has no move {move_id}.")
    waited_s = wait_s(request, wait)
    return json_response(await moves_of_robots.wait(move_id, waited_s), headers=wait_headers(waited_s))


@router.post(
    "/robots/{robot_id}/macros/{name}/runs",
    Right.OPERATE,
    status_code=202,
    response_model=RobotMove,
    responses=ROBOT_ENDS_DECLARED,
)
async def run_macro(
    request: Request,
    robot_id: RobotId,
    name: Annotated[MacroName, Path(description="Three capital letters or digits.", examples=["PCK"])],
    run: Annotated[MacroRunRequest, Body(default_factory=MacroRunRequest)],
    wait: Wait = None,
) -> Response:
    """Run a macro of the robot; the run is a move of the unit it is started on."""
    robot = plant_of(request).robot(robot_id)
    if run.unit is None and len(robot.units) > 1:
        raise InvalidRequest(f"unit: {robot.id} has several units; nothing was sent.", "Say on which.")
    unit = robot.units[0] if run.unit is None else robot.unit(run.unit)
    command = RunMacro(macro=name, arguments=run.arguments)
    return await perform(request, unit, command, wait)


async def perform(
    request: Request, unit: RobotUnit, command: FicsCommand[Any], wait: float | None
) -> Response:
    """Send a motion command and answer with its move.

    :raises GatewayError: it was refused, or not sent.
    """
    require_fit(unit, command)
    moves_of_robots = plant_of(request).robot_moves
    move = await moves_of_robots.start(unit.robot, unit.number, command)
    waited_s = wait_s(request, wait)
    move = await moves_of_robots.wait(move.id, waited_s)
    headers = {"Location": f"/robots/{unit.address}/moves/{move.id}", **wait_headers(waited_s)}
    return json_response(move, 200 if move.status.final else 202, headers)
