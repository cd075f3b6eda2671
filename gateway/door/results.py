"""The results that operations of several sections have, as they are told."""

from pydantic import BaseModel, Field

from gateway.core.move_record import Move
from gateway.fics.stops import RobotStopReport
from gateway.rorze.stops import StopReport


class GroupMove(BaseModel):
    """One command to a group, with one move for each member."""

    group_id: str
    moves: list[Move]


class StopResult(BaseModel):
    """How far the stop has come, after two seconds at most."""

    confirmed: bool = Field(
        description="Whether every controller reports standstill. If not, use the hardware stop."
    )
    bodies: list[StopReport]
    robots: list[RobotStopReport]
