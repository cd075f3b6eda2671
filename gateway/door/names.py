"""The names in paths, as every front end describes them."""

from collections.abc import Mapping
from typing import Annotated, Any, Final

from pydantic import Field

from protocols.fics.notation import Unit

LineId = Annotated[str, Field(description="The line's id.", examples=["line1"])]
BodyId = Annotated[
    str,
    Field(
        description="Two hex digits, 00-77, with the line's id where several lines have it: 3F or arm.3F.",
        examples=["3F"],
    ),
]
GroupId = Annotated[
    str,
    Field(
        description="Two hex digits, 80-9E, with the line's id where several lines have it: 80 or arm.80.",
        examples=["80"],
    ),
]
RobotId = Annotated[str, Field(description="The robot's id in the configuration.", examples=["r1"])]
UnitNumber = Annotated[Unit, Field(description="Number of the unit, from 1.", examples=[1])]
ScaraId = Annotated[str, Field(description="The robot's id in the configuration.", examples=["wafer"])]

NAMES: Final[Mapping[str, Any]] = {
    "line_id": LineId,
    "body_id": BodyId,
    "group_id": GroupId,
    "robot_id": RobotId,
    "unit": UnitNumber,
    "scara_id": ScaraId,
}
"""The descriptions of names in paths; all others are text."""
