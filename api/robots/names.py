"""The robots that paths lead to."""

from fastapi import Request

from api.common.requests import plant_of
from gateway.fics.family import Fics
from gateway.fics.robot import Robot


def robot_of(request: Request, robot_id: str) -> Robot:
    """Find a robot, to tell what is known of it.

    :raises NotFound: there is no such robot.
    """
    return plant_of(request).family(Fics).robot(robot_id)
