"""What is known of a robot at one moment."""

from typing import Self

from pydantic import Field

from gateway.core.records import Record
from gateway.fics.robot import Robot


class RobotNow(Record):
    """A robot, as far as is known."""

    robot_id: str
    online: bool
    mode: int
    moving: bool | None
    power_cycled: bool
    error: str | None = Field(description="The code of the error that stands.")

    @classmethod
    def of(cls, robot: Robot) -> Self:
        """Tell it without asking the robot."""
        return cls(
            robot_id=robot.id,
            online=robot.online,
            mode=robot.mode,
            moving=robot.moving,
            power_cycled=robot.power_cycled,
            error=None if robot.latched_error is None else robot.latched_error.code,
        )
