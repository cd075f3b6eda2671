"""What the paths of robots say, and the units they lead to."""

from typing import Annotated

from fastapi import Path, Request

from api.common.requests import plant_of
from gateway.fics.units import RobotUnit
from protocols.fics.notation import Unit

RobotId = Annotated[str, Path(description="The robot's id in the configuration.", examples=["r1"])]
UnitNumber = Annotated[Unit, Path(description="Number of the unit, from 1.", examples=[1])]


def unit_of(request: Request, robot_id: str, unit: int) -> RobotUnit:
    """Find a unit.

    :raises NotFound: there is no such robot, or it has no such unit.
    """
    return plant_of(request).robot(robot_id).unit(unit)
