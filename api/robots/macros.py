"""The macros of a robot over HTTP; `runs` of one are moves."""

from fastapi import Request, Response
from pydantic import BaseModel, Field

from api.common.requests import json_response, new_router
from api.robots.names import RobotId, robot_of
from gateway.core.rights import Right

router = new_router("robots")


class MacroInfo(BaseModel):
    """A macro by its name."""

    name: str
    title: str | None = Field(description="What it does, from the configuration; null where it is not there.")
    refused: bool = Field(description="Whether the robot has refused it as unknown when it was last called.")


class MacroList(BaseModel):
    """The macros that are known: a robot cannot be asked for their names."""

    robot_id: str
    macros: list[MacroInfo]


@router.get("/robots/{robot_id}/macros", Right.VIEW, response_model=MacroList)
async def list_macros(request: Request, robot_id: RobotId) -> Response:
    """List the macros of the configuration, and those the robot has refused; nothing is sent."""
    macros = robot_of(request, robot_id).macros
    listed = [
        MacroInfo(name=name, title=macros.titles.get(name), refused=name in macros.refused)
        for name in macros.names()
    ]
    return json_response(MacroList(robot_id=robot_id, macros=listed))
