"""The names in the paths of bodies and groups, as every front end describes them."""

from typing import Annotated

from pydantic import Field

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
