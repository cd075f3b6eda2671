"""The types of events of robots and of their units."""

from typing import Literal

from pydantic import Field

from gateway.core.backup_record import Restore
from gateway.core.event_types import (
    EventData,
    EventType,
    LeftMoving,
    Nothing,
    Swap,
    Unreadable,
    backup_types,
    lease_types,
    move_types,
    news_types,
    restore_types,
)
from gateway.fics.axes import CoordinateSystem
from gateway.fics.jogs import JogSession
from gateway.fics.move_record import RobotMove
from gateway.fics.stops import RobotStopReport
from gateway.fics.system_errors import RobotErrorRecord

ROBOT, UNIT = "/robots/{robot_id}", "/robots/{robot_id}/units/{unit}"


class Overdue(EventData):
    """A move that takes longer than its way and its speeds explain."""

    move_id: str
    longest_s: float | None
    request_id: str | None


class StopRefusal(RobotStopReport):
    """The state of a stop that the robot has refused."""

    error: str = Field(description="The refusal, such as E03.")


class ErrorsReset(EventData):
    """The end of an error that stood, and who reset it."""

    by: str = Field(description="gateway, or elsewhere.")


class SpeedsKnown(EventData):
    """The speeds in percent that are set again, and the axes that are at 100 %: by unit and coordinates."""

    speeds: dict[str, dict[CoordinateSystem, dict[str, float]]] = Field(
        description="Percentages of full speed."
    )
    full_speed: dict[str, dict[CoordinateSystem, list[str]]]


class RobotPowerLoss(SpeedsKnown):
    """How sure the gateway is, and what it will set again."""

    certain: bool


class LiveAxis(EventData):
    """Where an axis stands."""

    value: float | None = Field(description="Coordinate; null while the robot does not know it.")
    unit: str = Field(description="mm, pulse or degree.")


class RobotPosition(EventData):
    """Where the axes of a unit stand (APS)."""

    unit: int
    coordinates: CoordinateSystem
    axes: dict[str, LiveAxis]


class RobotInputChange(EventData):
    """An input as it is now."""

    channel: int
    number: int = Field(description="Number of the input within its channel, from 0.")
    on: bool


class AxisStatusChange(EventData):
    """How a motor axis is now (C-HOST manual 2-10)."""

    unit: int
    axis: str
    status: list[Literal["origin_done", "servo_ready", "alarm"]] = Field(description="The bits that are set.")
    driver_error: str = Field(
        description="The driver's own code, hexadecimal as in `31h`; `00h` when it has none."
    )


class AxisSensorChange(EventData):
    """A sensor of a motor axis as it is now (C-HOST manual 2-11)."""

    unit: int
    axis: str
    sensor: Literal["origin", "plus_limit", "minus_limit"]
    on: bool


class BitMismatch(EventData):
    """Bits of a unit at rest that the configured order of bits does not explain."""

    unit: int
    detail: str


class MissingUnit(EventData):
    """A unit of the configuration that the robot does not have."""

    unit: int


class UnitChange(EventData):
    """The selected unit, as the gateway had left it and as it was found."""

    expected: int = Field(description="Number of a unit.")
    found: int = Field(description="Number of a unit.")


TYPES = (
    *move_types("robot", UNIT, RobotMove),
    *lease_types("robot", ROBOT),
    EventType("robot.move.overdue", UNIT, Overdue, "a move takes longer than its way and speeds explain"),
    *(
        EventType(f"robot.stop.{news}", ROBOT, data, when)
        for news, data, when in (
            ("requested", RobotStopReport, "a stop is asked for"),
            ("confirmed", RobotStopReport, "all axes stand still, as the robot says"),
            (
                "unconfirmed",
                RobotStopReport,
                "it is not confirmed in time, and is repeated on",
            ),
            ("refused", StopRefusal, "the robot has refused the stop"),
        )
    ),
    EventType("robot.motion.foreign", ROBOT, Nothing, "it moves, and the gateway has not started that"),
    EventType("robot.online", ROBOT, Nothing, "it answers again"),
    EventType("robot.offline", ROBOT, Nothing, "it does not answer any more"),
    EventType("robot.unreadable", ROBOT, Unreadable, "the watch could not learn its state"),
    EventType("robot.error", ROBOT, RobotErrorRecord, "an error of the system stands"),
    EventType("robot.errors.reset", ROBOT, ErrorsReset, "the error that stood is reset"),
    EventType("robot.swapped", ROBOT, Swap, "after a loss of power it is not as in the last night"),
    EventType("robot.power_cycled", ROBOT, RobotPowerLoss, "it has lost its power, or seems to"),
    EventType("robot.speeds.restored", ROBOT, SpeedsKnown, "the speeds that were known are set again"),
    EventType("robot.power_cycle.acknowledged", ROBOT, Nothing, "somebody knows of the loss of power"),
    EventType(
        "robot.bits.mismatch",
        ROBOT,
        BitMismatch,
        "it stands still, homed, and its bits do not mean what the configuration says",
    ),
    EventType(
        "robot.input.changed",
        ROBOT,
        RobotInputChange,
        "an input of the first channel is another than when it was last asked for: while somebody watches "
        "`io`, and as often as `input_edges_per_s` says",
    ),
    EventType(
        "robot.status.changed",
        ROBOT,
        AxisStatusChange,
        "status bits of a motor axis, or its driver's error, are others than when they were last asked for",
    ),
    EventType(
        "robot.sensor.changed",
        ROBOT,
        AxisSensorChange,
        "a sensor of a motor axis is another than when it was last asked for",
    ),
    EventType("robot.unit.changed", ROBOT, UnitChange, "somebody else has selected another unit"),
    EventType(
        "robot.unit.missing", ROBOT, MissingUnit, "the robot says that it has no such unit as is configured"
    ),
    *news_types(
        "robot.jog",
        ROBOT,
        JogSession,
        started="an axis jogs",
        stopping="the axis is told to stop, and may still move",
        ended="it was ended by request or at a limit, and the axis stands still",
        lost="its heartbeat stayed away, and the axis stands still",
        stopped="a stop or the end of the gateway has ended it, and the axis stands still",
        not_stopped="the axis did not stand still in time: the whole robot is being stopped",
    ),
    *backup_types("robot", ROBOT),
    *restore_types("robot", ROBOT, Restore),
    EventType(
        "robot.position",
        UNIT,
        RobotPosition,
        "somebody watches it (`sample`), and the robot acts on that unit",
        live=True,
    ),
    EventType("robot.left_moving", ROBOT, LeftMoving, "the gateway ends, and it moves as far as is known"),
)
