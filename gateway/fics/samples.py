"""Where a unit of a robot was seen during a move; with no plan, for no command tells its speed curve."""

from datetime import datetime

from pydantic import Field

from gateway.core.records import Record
from gateway.core.ways import Way
from gateway.fics.axes import Coordinates, Places
from gateway.fics.move_record import RobotMove


class RobotSample(Record):
    """Where the axes stood."""

    time: datetime = Field(description="When the robot's answer came.")
    time_s: float = Field(description="Seconds since the move's command was written.")
    axes: dict[str, float | None] = Field(description="Null while the robot does not know it.")


class RobotSamples(Record):
    """Where a unit was seen during a move: 512 answers at most."""

    move_id: str
    robot_id: str
    unit: int
    coordinates: Coordinates
    units: dict[str, str] = Field(description="What positions are counted in, by axis: mm, pulse or degree.")
    samples: list[RobotSample]


def samples_of(move: RobotMove, way: Way[Places]) -> RobotSamples:
    """Give the samples of a move."""
    return RobotSamples(
        move_id=move.id,
        robot_id=move.robot_id,
        unit=move.unit,
        coordinates=move.coordinates,
        units=move.units,
        samples=[
            RobotSample(time=way.time_of(seconds), time_s=round(seconds, 6), axes=dict(places))
            for seconds, places in way.places
        ],
    )
