"""A robot's inputs, outputs and variables over HTTP: one by one or several in a row."""

from typing import Annotated

from fastapi import Path, Query, Request, Response
from pydantic import BaseModel, Field

from api.common.etags import IF_MATCH, expected_by, tagged
from api.common.requests import json_response, new_router, origin, plant_of
from api.robots.names import RobotId
from gateway.core.records import RequestModel, example
from gateway.core.rights import Right
from gateway.operations import robots
from protocols.fics.inputs_outputs import ChannelBits, GetInputChannel, GetOutputChannel, SwitchOutput
from protocols.fics.notation import Bit, Number, Within
from protocols.fics.notation import Channel as ChannelNumber
from protocols.fics.variables import (
    LAST_VARIABLE,
    NUMBER,
    SetVariable,
    Variable,
    VariableValue,
)

router = new_router("robots")

BITS = range(8)

FirstChannel = Annotated[ChannelNumber, Query(description="The first channel.")]
ChannelCount = Annotated[ChannelNumber, Query(description="How many.")]
FirstVariable = Annotated[Variable, Query(description="The first variable.")]


class Channel(BaseModel):
    """Eight inputs or outputs."""

    channel: int
    bits: list[bool] = Field(description="Bit 0 first.")


class ChannelList(BaseModel):
    """Inputs or outputs of a robot."""

    robot_id: str
    channels: list[Channel]


class OutputState(RequestModel, json_schema_extra=example(on=True)):
    """What an output shall be."""

    on: bool


class VariableList(BaseModel):
    """Variables of a robot."""

    robot_id: str
    variables: list[VariableValue]


class VariableSetting(RequestModel, json_schema_extra=example(value=12.5)):
    """What a variable shall hold."""

    value: Number


@router.get("/robots/{robot_id}/inputs", Right.VIEW, response_model=ChannelList)
async def get_inputs(
    request: Request, robot_id: RobotId, first: FirstChannel = 1, count: ChannelCount = 1
) -> Response:
    """Ask the robot for inputs, channel by channel (IDI)."""
    return await _read(request, robot_id, GetInputChannel, first, count)


@router.get("/robots/{robot_id}/outputs", Right.VIEW, response_model=ChannelList)
async def get_outputs(
    request: Request, robot_id: RobotId, first: FirstChannel = 1, count: ChannelCount = 1
) -> Response:
    """Ask the robot for outputs, channel by channel (IDO)."""
    return await _read(request, robot_id, GetOutputChannel, first, count)


@router.put("/robots/{robot_id}/outputs/{channel}/{bit}", Right.OPERATE, response_model=ChannelList)
async def switch_output(
    request: Request,
    robot_id: RobotId,
    channel: Annotated[ChannelNumber, Path(description="Channel of eight bits, from 1.", examples=[1])],
    bit: Annotated[Bit, Path(description="Bit of the channel, 0-7.", examples=[7])],
    output: OutputState,
) -> Response:
    """Switch an output on or off (IOT), and read its channel back; `not-done` where it is not as asked."""
    command = SwitchOutput(channel=channel, bit=bit, on=output.on)
    told = await robots.switch_output(plant_of(request), origin(), robot_id, command)
    return json_response(ChannelList(robot_id=robot_id, channels=[_channel(channel, told)]))


@router.get("/robots/{robot_id}/variables", Right.VIEW, response_model=VariableList)
async def get_variables(
    request: Request,
    robot_id: RobotId,
    first: FirstVariable = 0,
    count: Annotated[int, Within(1, LAST_VARIABLE + 1), Query(description="How many.")] = 1,
) -> Response:
    """Ask the robot for variables, one by one (VAR)."""
    values = await robots.variables(plant_of(request), origin(), robot_id, first, count)
    return tagged(VariableList(robot_id=robot_id, variables=list(values.values())))


@router.put("/robots/{robot_id}/variables/{number}", Right.OPERATE, response_model=VariableValue, **IF_MATCH)
async def set_variable(
    request: Request,
    robot_id: RobotId,
    number: Annotated[Variable, Path(description=NUMBER, examples=[99])],
    variable: VariableSetting,
) -> Response:
    """Set a variable (VAR), and read it back; `not-done` where it is not as asked.

    `If-Match` is the ETag of this variable alone, as `?first=` gives it; it is read first then.
    """
    command = SetVariable(number=number, value=variable.value)
    expects = expected_by(request, document=lambda value: VariableList(robot_id=robot_id, variables=[value]))
    plant = plant_of(request)
    return json_response(await robots.set_variable(plant, origin(), robot_id, command, expects))


async def _read(
    request: Request, robot_id: str, row: type[GetInputChannel | GetOutputChannel], first: int, count: int
) -> Response:
    found = await robots.channels(plant_of(request), origin(), robot_id, row, first, count)
    channels = [_channel(number, told) for number, told in found.items()]
    return json_response(ChannelList(robot_id=robot_id, channels=channels))


def _channel(number: int, told: ChannelBits) -> Channel:
    return Channel(channel=number, bits=[bool(told.bits >> bit & 1) for bit in BITS])
