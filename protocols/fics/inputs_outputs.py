"""Digital inputs and outputs (C-HOST manual 2-21 to 2-23)."""

from typing import Annotated

from pydantic import Field

from protocols.fics.notation import Bit, Channel, FicsHex, Switch
from protocols.fics.row import Query, RobotAction
from protocols.table import Effect, Reply, Retry

CHANNEL = "Number of the channel of eight bits, from 1."


class ChannelBits(Reply, args="{bits}"):
    """The eight bits of a channel."""

    bits: Annotated[int, Field(ge=0, le=0xFF), FicsHex(2)] = Field(
        description="Bit n is bit n of the channel."
    )


class GetInputChannel(Query[ChannelBits], code="IDI", args="{channel}", example=("IDI 1", "IDI 0F")):
    """DI状態の問い合わせ: get the inputs of a channel."""

    channel: Channel = Field(description=CHANNEL)


class GetOutputChannel(Query[ChannelBits], code="IDO", args="{channel}", example=("IDO 1", "IDO A0")):
    """DO状態の問い合わせ: get the outputs of a channel."""

    channel: Channel = Field(description=CHANNEL)


class SwitchOutput(
    RobotAction,
    code="IOT",
    args="{channel}-{bit}:{on}",
    retry=Retry.CONDITIONAL,
    effect=Effect.SETTING,
    example=("IOT 1-7:+", "IOT", "IOT 2-0:-", "IOT"),
):
    """DO出力の制御: switch an output on or off."""

    channel: Channel = Field(description=CHANNEL)
    bit: Bit = Field(description="Bit of the channel, 0-7.")
    on: Annotated[bool, Switch()]
