"""The names in the paths of robots, as every front end describes them."""

from typing import Annotated

from pydantic import Field

from protocols.fics.notation import Unit

RobotId = Annotated[str, Field(description="The robot's id in the configuration.", examples=["r1"])]
UnitNumber = Annotated[Unit, Field(description="Number of the unit, from 1.", examples=[1])]
