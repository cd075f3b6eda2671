"""Moves of units with a speed of their own: VAO or MAO is set before they start (C-HOST manual 2-15, 4-5).

A robot takes no speed with a move, and JOG and JTE none at all: theirs is the robot's own (2-2, 2-3).
"""

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Final

from gateway.fics.axes import Coordinates
from gateway.fics.move_requests import RobotMoveRequest
from gateway.fics.robot import Robot
from gateway.fics.settings import SETTINGS
from gateway.fics.units import RobotUnit

_SETTING: Final[dict[Coordinates, str]] = {"user": "speed_percent", "motor": "motor_speed_percent"}


@asynccontextmanager
async def at_own_speed(
    robot: Robot, unit: RobotUnit, request: RobotMoveRequest
) -> AsyncIterator[RobotMoveRequest]:
    """Set the `speed_percent` of a move, if it has one, and keep others from setting it until it has begun.

    It is not put back: that would make whatever moves next faster than the person at the machine has seen.

    :raises GatewayError: it was not set and read back, or a stop came meanwhile; the move must not start.
    """
    percent = getattr(request, "speed_percent", None)
    if percent is None:
        yield request
        return
    epoch = robot.line.stop_epoch
    robot.known.motion.require_still(request.command(unit))
    async with robot.own_speed:
        setting = SETTINGS[_SETTING[getattr(request, "coordinates", "user")]]
        found = getattr(await unit.read(setting.read()), setting.field)
        wanted = [float(percent)] * len(unit.names(setting.coordinates))
        if list(found) != wanted:
            await unit.change(setting.write(**{setting.field: wanted}))
        if robot.line.stop_epoch != epoch:
            raise robot.line.overtaken()
        yield request
