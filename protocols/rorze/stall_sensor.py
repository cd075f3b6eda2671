"""Step-out detection by the STALL sensor: code Q (RC-420 manual 13.6, 14)."""

from typing import Annotated

from pydantic import Field

from protocols.rorze.notation import Digits, Flag, FlagValue, Number
from protocols.rorze.row import Question, RorzeCommand, Setting
from protocols.table import Ack, Effect, Reply, Retry


class Enabled(Reply, args="{enabled}"):
    """A function, on or off."""

    enabled: FlagValue = Field(description="0 off, 1 on.")


class StallError(Reply, args="{stalled}"):
    """The STALL error, present or not."""

    stalled: FlagValue = Field(description="0 no STALL error, 1 STALL error.")


# The pages list no errors, but do not allow these commands while the motor moves: that is 50 (21).
MOVING_ERRORS = frozenset({0x50})
SETTING_ERRORS = MOVING_ERRORS | {0x4A}


class StepOutSetting(Setting, moving=False, errors=SETTING_ERRORS):
    """Base of the settings of step-out detection and of the encoder."""


INTERVAL = "Period of the dogs, from ON edge to ON edge, in pulses, 100-65535; checked every half of it."


class StallInterval(Reply, args="{interval}"):
    """The period of the STALL sensor's dogs."""

    interval: Annotated[int, Field(ge=100, le=65_535), Digits(5)] = Field(description=INTERVAL)


class GetStallSensorInterval(Question[StallInterval], code="QID", example=("&3FQID", ">&3FQID00100")):
    """脱調検出間隔取得: get the period of the STALL sensor's dogs."""


class SetStallSensorInterval(StepOutSetting, code="QIS", args="{interval}", example=("&3FQIS100", ">&3FQIS")):
    """脱調検出間隔設定: set the period of the STALL sensor's dogs; 2048 by default.

    Half of it is the interval of the checks: one in the middle of each dog, one in each gap (RC-420 manual
    13.6.2).
    """

    interval: Annotated[int, Field(ge=100, le=65_535), Number()] = Field(description=INTERVAL)


class GetStallSensorError(Question[StallError], code="QRD", example=("&3FQRD", ">&3FQRD0")):
    """脱調検出状態取得: get whether the STALL sensor has found a step-out."""


class ClearStallSensorError(
    RorzeCommand[Ack],
    code="QRS",
    moving=False,
    errors=MOVING_ERRORS,
    retry=Retry.CONDITIONAL,
    effect=Effect.CLEARING,
    example=("&3FQRS", ">&3FQRS"),
):
    """脱調検出状態解除: clear the STALL error found by the STALL sensor."""


class GetStallSensorDetection(Question[Enabled], code="QSD", example=("&3FQSD", ">&3FQSD1")):
    """脱調検出設定取得: get whether the STALL sensor is watched for step-outs."""


class SetStallSensorDetection(StepOutSetting, code="QSS", args="{enabled}", example=("&3FQSS1", ">&3FQSS")):
    """脱調検出設定: set whether the STALL sensor is watched for step-outs; off by default."""

    enabled: Flag = Field(description="0 off, 1 on.")
