"""A robot's inputs, outputs and variables: one by one or several in a row."""

from typing import Annotated, Final

from pydantic import Field

from gateway.core.errors import InvalidRequest
from gateway.core.operation import Expectation, Rows
from gateway.core.records import AnswerModel, RequestModel, SentBack, example
from gateway.core.rights import Right
from gateway.fics.axes import NamedRobot
from protocols.fics.inputs_outputs import ChannelBits, GetInputChannel, GetOutputChannel, SwitchOutput
from protocols.fics.notation import LAST_CHANNEL, Bit, Number, Within
from protocols.fics.notation import Channel as ChannelNumber
from protocols.fics.variables import (
    LAST_VARIABLE,
    NUMBER,
    GetVariable,
    SetVariable,
    Variable,
    VariableValue,
)

ROWS: Final = Rows("robots", later=True)
BITS = range(8)

FirstChannel = Annotated[ChannelNumber, Field(description="The first channel.")]
ChannelCount = Annotated[ChannelNumber, Field(description="Number of channels.")]
FirstVariable = Annotated[Variable, Field(description="The first variable.")]


class Channel(AnswerModel):
    """Eight inputs or outputs."""

    channel: int
    bits: list[bool] = Field(description="Bit 0 first.")


class ChannelList(AnswerModel):
    """Inputs or outputs of a robot."""

    robot_id: str
    channels: list[Channel]


class OutputState(RequestModel, json_schema_extra=example(on=True)):
    """The state that an output is to take."""

    on: bool


class VariableList(AnswerModel):
    """Variables of a robot."""

    robot_id: str
    variables: list[VariableValue]


class VariableSetting(SentBack, json_schema_extra=example(value=12.5)):
    """The value that a variable is to take."""

    read_only = frozenset(("number",))
    compared_whole = False

    value: Number


@ROWS.get("/robots/{robot_id}/inputs")
async def get_inputs(robot: NamedRobot, *, first: FirstChannel = 1, count: ChannelCount = 1) -> ChannelList:
    """Ask the robot for inputs, channel by channel (IDI)."""
    return await _read(robot, GetInputChannel, first, count)


@ROWS.get("/robots/{robot_id}/outputs")
async def get_outputs(robot: NamedRobot, *, first: FirstChannel = 1, count: ChannelCount = 1) -> ChannelList:
    """Ask the robot for outputs, channel by channel (IDO)."""
    return await _read(robot, GetOutputChannel, first, count)


@ROWS.put("/robots/{robot_id}/outputs/{channel}/{bit}", Right.OPERATE)
async def switch_output(
    robot: NamedRobot,
    channel: Annotated[ChannelNumber, Field(description="Channel of eight bits, from 1.", examples=[1])],
    bit: Annotated[Bit, Field(description="Bit of the channel, 0-7.", examples=[7])],
    output: OutputState,
) -> ChannelList:
    """Switch an output on or off (IOT), and read its channel back; `not-done` where it is not as asked."""
    told: ChannelBits = await robot.change(SwitchOutput(channel=channel, bit=bit, on=output.on))
    return ChannelList(robot_id=robot.id, channels=[_channel(channel, told)])


@ROWS.get("/robots/{robot_id}/variables", tagged=True)
async def get_variables(
    robot: NamedRobot,
    *,
    first: FirstVariable = 0,
    count: Annotated[int, Within(1, LAST_VARIABLE + 1), Field(description="Number of variables.")] = 1,
) -> VariableList:
    """Ask the robot for variables, one by one (VAR)."""
    wanted = _range("variables", first, count, LAST_VARIABLE)
    found = [await robot.read(GetVariable(number=number)) for number in wanted]
    return VariableList(robot_id=robot.id, variables=found)


@ROWS.put("/robots/{robot_id}/variables/{number}", Right.OPERATE)
async def set_variable(
    robot: NamedRobot,
    number: Annotated[Variable, Field(description=NUMBER, examples=[99])],
    variable: VariableSetting,
    *,
    expects: Expectation | None,
) -> VariableValue:
    """Set a variable (VAR), and read it back; `not-done` where it is not as asked.

    `If-Match` is the ETag of this variable alone, as `?first=` gives it; it is read first then.
    """

    def require(value: VariableValue) -> None:
        if expects is not None:
            expects(VariableList(robot_id=robot.id, variables=[value]))

    variable.require_unchanged(VariableValue(number=number, value=variable.value))
    query = GetVariable(number=number)
    since = await robot.as_expected(lambda: robot.read(query), require if expects else None)
    told: VariableValue = await robot.change(SetVariable(number=number, value=variable.value), since=since)
    return told


async def _read(
    robot: NamedRobot, row: type[GetInputChannel | GetOutputChannel], first: int, count: int
) -> ChannelList:
    wanted = _range("channels", first, count, LAST_CHANNEL)
    channels = [_channel(number, await robot.read(row(channel=number))) for number in wanted]
    return ChannelList(robot_id=robot.id, channels=channels)


def _range(what: str, first: int, count: int, last: int) -> range:
    if first + count - 1 > last:
        raise InvalidRequest(f"count: {what} are numbered up to {last}; nothing was sent.")
    return range(first, first + count)


def _channel(number: int, told: ChannelBits) -> Channel:
    return Channel(channel=number, bits=[bool(told.bits >> bit & 1) for bit in BITS])
