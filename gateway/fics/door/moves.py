"""Moves of robots: started, planned, listed and waited for; macros run as moves."""

from typing import Annotated, Final

from pydantic import BaseModel, Field

from gateway.core.move_record import MoveRecord
from gateway.core.operation import PlainText, Rows, Wait
from gateway.core.origin import current
from gateway.core.records import AnswerModel, RequestModel, example
from gateway.core.rights import Right
from gateway.core.targets import Result, Target
from gateway.door import moving
from gateway.door.csv_tables import CSV, csv_of
from gateway.door.doing import do
from gateway.door.moving import Limit
from gateway.fics.move_record import RobotMove
from gateway.fics.move_requests import RobotMoveRequest
from gateway.fics.plans import PlannedRobotMove, RobotSamples
from gateway.fics.robot import Robot
from gateway.plant import Plant
from protocols.fics.macros import Arguments, MacroName, RunMacro
from protocols.fics.notation import Unit

ROWS: Final = Rows("robot moves")
SAMPLES: Final = Rows("samples")
SAMPLES_AS_CSV: Final = Rows("samples")
MOVES: Final = "/robots/{robot_id}/units/{unit}/moves"


class MacroRunRequest(RequestModel, json_schema_extra=example(unit=1, arguments=[150, 140, -5])):
    """How to run a macro (C-HOST manual 1-7)."""

    unit: Unit | None = Field(
        default=None, description="The unit that is selected while it runs; left out, the only one."
    )
    arguments: Arguments | None = Field(default=None, description="Up to four numbers; null leaves one out.")


class RobotMoveList(AnswerModel):
    """Moves of a unit, newest first."""

    moves: list[RobotMove]


AS_IT_IS: Final = MacroRunRequest()


@ROWS.post(MOVES, Right.OPERATE, moves=True, result=RobotMove, planned=PlannedRobotMove)
async def start_robot_move(
    plant: Plant, target: Target, move: RobotMoveRequest, *, wait: Wait = None
) -> Result | BaseModel:
    """Start a move of a unit, or with `validate_only` say what it would be.

    202 when the robot has not refused it and it is not over, 200 when it ended while the request waited. A
    move that has started and failed is no HTTP error: see its `status`, `end_cause` and `error`.
    """
    return await moving.start(plant, target, move, wait or 0.0)


@ROWS.get(MOVES)
async def list_robot_moves(target: Target, *, limit: Limit = 100) -> RobotMoveList:
    """List the unit's moves, newest first."""
    return RobotMoveList(moves=moving.newest(target, limit))


@ROWS.get(f"{MOVES}/{{move_id}}", result=RobotMove)
async def get_robot_move(target: Target, move_id: str, *, wait: Wait = None) -> MoveRecord:
    """Get a move, at once or when it is over."""
    return await moving.get(target, move_id, wait or 0.0)


@ROWS.post("/robots/{robot_id}/macros/{name}/runs", Right.OPERATE, moves=True, result=RobotMove)
async def run_macro(
    plant: Plant,
    robot: Robot,
    name: Annotated[MacroName, Field(description="Three capital letters or digits.", examples=["PCK"])],
    run: MacroRunRequest = AS_IT_IS,
    *,
    wait: Wait = None,
) -> Result:
    """Run a macro of the robot; the run is a move of the unit it is started on."""
    target = f"/robots/{robot.id}" + ("" if run.unit is None else f"/units/{run.unit}")
    command = RunMacro(macro=name, arguments=run.arguments)
    return await do(plant, current(), target, command, wait or 0.0)


@SAMPLES.get(f"{MOVES}/{{move_id}}/samples")
async def get_robot_samples(target: Target, move_id: str) -> RobotSamples:
    """Get where a unit was seen during a move, and where its settings lead an axis that goes alone.

    No command tells the timing of several axes, or of an S-curve: `note` says then why nothing is planned.
    The settings are read from the robot at the first request for the samples.
    """
    told: RobotSamples = await moving.samples(target, move_id)
    return told


@SAMPLES_AS_CSV.get(f"{MOVES}/{{move_id}}/samples.csv", media=CSV)
async def download_robot_samples(target: Target, move_id: str) -> PlainText:
    """Get the same as CSV: time, time_s, a column for each axis with its unit, and one for its plan."""
    told: RobotSamples = await moving.samples(target, move_id)
    columns = [f"{axis} {unit}" for axis, unit in told.units.items()]
    header = ["time", "time_s", *columns, *(f"planned {column}" for column in columns)]
    rows = (
        [
            *(sample.time.isoformat(), sample.time_s),
            *(sample.axes.get(axis) for axis in told.units),
            *((sample.planned or {}).get(axis) for axis in told.units),
        ]
        for sample in told.samples
    )
    return PlainText(csv_of(header, rows))
