"""Inputs and outputs (C-HOST manual 2-21 to 2-23)."""

from protocols.fics.inputs_outputs import ChannelBits, GetInputChannel, GetOutputChannel, SwitchOutput
from simulator.fics.actions import Code, Refused, acts_out
from simulator.fics.robot import SYSTEM, Robot


def _place(robot: Robot, channel: int) -> int:
    """Where a channel is in the lists.

    :raises Refused: E05, the system has no such channel.
    """
    if channel > robot.layout.channels:
        raise Refused(Code.RANGE)
    return channel - 1


@acts_out(GetInputChannel)
def _get_inputs(robot: Robot, command: GetInputChannel, now: float) -> ChannelBits:
    return ChannelBits(bits=robot.inputs[_place(robot, command.channel)])


@acts_out(GetOutputChannel)
def _get_outputs(robot: Robot, command: GetOutputChannel, now: float) -> ChannelBits:
    return ChannelBits(bits=robot.outputs[_place(robot, command.channel)])


@acts_out(SwitchOutput)
def _switch_output(robot: Robot, command: SwitchOutput, now: float) -> None:
    place, bit = _place(robot, command.channel), 1 << command.bit
    robot.outputs[place] = robot.outputs[place] | bit if command.on else robot.outputs[place] & ~bit
    robot.truth.log("output", now, SYSTEM, channel=command.channel, bits=robot.outputs[place])
