"""One route for each row of the C-HOST table, with its own types: for units, or for the robot as a whole."""

from collections.abc import Mapping
from functools import cache
from inspect import getdoc
from typing import Any, Final, Generic, TypeVar

from fastapi import Request, Response
from pydantic import BaseModel, ConfigDict

from api.bodies.command_routes import AGE_HEADER, Endpoint, add_row, snake
from api.common.problems import DECLARED
from api.common.requests import Wait, age_ms_of, json_response, new_router, plant_of
from api.common.routes import Router
from api.robots.fit import require_fit
from api.robots.jogs import begin_jog
from api.robots.moves import ROBOT_ENDS_DECLARED, perform
from api.robots.paths import RobotId, UnitNumber, unit_of
from api.stops import StopResult, perform_stop
from gateway.core.stops import StopMode
from gateway.fics.jogs import JogSession
from gateway.fics.move_record import RobotMove
from gateway.fics.robot import Robot
from gateway.fics.soft_limits import uncrossed
from protocols.fics import stops
from protocols.fics.commands import ROWS, Row, of_the_robot
from protocols.fics.jog import StartJog, StopJog
from protocols.fics.row import FicsCommand, WhenAnswered
from protocols.table import Reply

R = TypeVar("R", bound=Reply)

ROBOT_STOP_MODES: Final[Mapping[Row, StopMode]] = {
    stops.StopAllDecelerating: "decelerate",
    stops.StopAllImmediately: "immediate",
}
_ANSWERED: Final[Mapping[WhenAnswered, str]] = {
    WhenAnswered.ALWAYS: "answered at once",
    WhenAnswered.ON_COMPLETION: "answered when it is done, in Ver.2 not at all",
    WhenAnswered.AT_ONCE: "answered when it is accepted, in Ver.2 not at all",
}


class Replies(BaseModel, Generic[R]):
    """All replies to one command, in turn."""

    model_config = ConfigDict(frozen=True)

    replies: list[R]


@cache
def routers() -> list[Router]:
    """Make the routes of the whole table."""
    router = new_router("robot commands")
    for row in ROWS:
        whole = of_the_robot(row)
        add_row(
            router,
            "/robots/{robot_id}" if whole else "/robots/{robot_id}/units/{unit}",
            f"send_{snake(row)}",
            row,
            _robot_endpoint() if whole else _unit_endpoint(row),
            status_code=_status_of(row),
            response_model=_answer_type(row),
            responses=_responses(row),
            description=describe(row),
        )
    return [router]


def describe(row: Row) -> str:
    """The row's documentation: what the manual's page says, in few words."""
    japanese, english = row.titles()
    more = (getdoc(row) or "").partition("\n")[2].strip()
    blocks = ", ".join(sorted(f"({block})" for block in row.blocked)) or "nothing"
    facts = [
        f"Command `{row.code or 'named by the macro'}`; {_ANSWERED[row.answered]}; blocked by {blocks} "
        f"(C-HOST manual 1-7); retry class `{row.retry}`.",
        f"Example: `{row.example[0]}`.",
    ]
    return "\n\n".join(part for part in (f"{japanese}: {english}.", more, *facts) if part)


def _is_move(row: Row) -> bool:
    return row.starts_motion() and row is not StartJog


def _responses(row: Row) -> dict[int | str, dict[str, Any]]:
    if _is_move(row):
        return ROBOT_ENDS_DECLARED
    if not row.is_query():
        return DECLARED
    age = {"description": "How old the answer is, in milliseconds.", "schema": {"type": "number"}}
    return {**DECLARED, 200: {"description": "The robot's reply.", "headers": {AGE_HEADER: age}}}


def _status_of(row: Row) -> int:
    if row is StartJog:
        return 201
    return 202 if row.starts_motion() else 200


def _answer_type(row: Row) -> Any:
    if row is StartJog:
        return JogSession
    if row.starts_motion():
        return RobotMove
    if row in ROBOT_STOP_MODES:
        return StopResult
    generic: Any = Replies
    return generic[row.reply_type()] if row.ends_with else row.reply_type()


def _robot_endpoint() -> Endpoint:
    async def send(request: Request, robot_id: RobotId, command: Any) -> Response:
        robot = plant_of(request).robot(robot_id)
        if mode := ROBOT_STOP_MODES.get(type(command)):
            return await perform_stop(request, [], mode, [robot])
        return await _send(robot, command, None)

    return send


def _unit_endpoint(row: Row) -> Endpoint:
    if row is StartJog:
        return _start_jog
    if row is StopJog:
        return _stop_jog
    if row.starts_motion():

        async def start(
            request: Request, robot_id: RobotId, unit: UnitNumber, command: Any, wait: Wait = None
        ) -> Response:
            return await perform(request, unit_of(request, robot_id, unit), command, wait)

        return start

    async def send(request: Request, robot_id: RobotId, unit: UnitNumber, command: Any) -> Response:
        axes = unit_of(request, robot_id, unit)
        require_fit(axes, command)
        (settled,) = await uncrossed(axes, {"coordinates": command})
        return await _send(plant_of(request).robot(robot_id), settled, unit)

    return send


async def _start_jog(request: Request, robot_id: RobotId, unit: UnitNumber, command: Any) -> Response:
    """Jog as `POST /robots/{robot_id}/jogs` does: only as long as heartbeats come."""
    return await begin_jog(plant_of(request).robot(robot_id), unit, command.axis, command.direction)


async def _stop_jog(request: Request, robot_id: RobotId, unit: UnitNumber, command: Any) -> Response:
    """Stop the axis of this unit and of no other, with its session; 200 when it was seen to stand still."""
    axes = unit_of(request, robot_id, unit)
    require_fit(axes, command)
    await plant_of(request).robot(robot_id).jogs.stop(unit, command.axis)
    return json_response(command.reply_type()())


async def _send(robot: Robot, command: FicsCommand[Any], unit: int | None) -> Response:
    replies, at = await robot.ask_all(command, unit)
    headers = {AGE_HEADER: str(age_ms_of(at))} if command.is_query() else None
    if command.ends_with:
        return json_response(_answer_type(type(command))(replies=list(replies)), headers=headers)
    return json_response(replies[0] if replies else command.reply_type()(), headers=headers)
