"""What the paths of robots say, and the units they lead to."""

from typing import Annotated

from fastapi import Path, Request

from api.common.requests import plant_of
from gateway.fics.family import Fics
from gateway.fics.robot import Robot
from gateway.fics.units import RobotUnit
from protocols.fics.notation import Unit

RobotId = Annotated[str, Path(description="The robot's id in the configuration.", examples=["r1"])]
UnitNumber = Annotated[Unit, Path(description="Number of the unit, from 1.", examples=[1])]


def robot_of(request: Request, robot_id: str) -> Robot:
    """Find a robot, to tell what is known of it.

    :raises NotFound: there is no such robot.
    """
    return plant_of(request).family(Fics).robot(robot_id)


def unit_of(request: Request, robot_id: str, unit: int) -> RobotUnit:
    """Find a unit, to tell what is known of it.

    :raises NotFound: there is no such robot, or it has no such unit.
    """
    return robot_of(request, robot_id).unit(unit)
