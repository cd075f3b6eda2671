"""Speeds, acceleration times and the S-curve (C-HOST manual 2-15, 2-24, 2-29 to 2-32)."""

from pydantic import Field

from protocols.fics.axis_settings import (
    AxisSetting,
    AxisSpeeds,
    AxisSpeedSetting,
    AxisTimes,
    PercentSetting,
    SpeedPercents,
    TimeSetting,
)
from protocols.fics.notation import AXES, Flag, KnownNumbers, StartSpeeds
from protocols.fics.row import Query
from protocols.table import Reply

FLAG = "0: constant acceleration, 1: S-curve."


class GetSpeedPercent(
    Query[SpeedPercents], code="VAO", blocked="abc", example=("VAO", "VAO 10.0,100.0,30.5")
):
    """速度指定の問い合わせ: get the speed of LMI, LMA and POM in percent; 100 after power-on."""


class SetSpeedPercent(PercentSetting, code="VAO", example=("VAO 10,,30", "VAO", "VAO 0.1,100", "VAO")):
    """速度指定: set the speed of LMI, LMA and POM in percent of the maximum speed."""


class SmoothAcceleration(Reply, args="{enabled}"):
    """S-curve acceleration on or off, for all axes of the unit."""

    enabled: Flag = Field(description=FLAG)


class GetSmoothAcceleration(Query[SmoothAcceleration], code="SCV", blocked="abc", example=("SCV", "SCV 1")):
    """S字加減速の問い合わせ: get whether acceleration follows an S-curve."""


class SetSmoothAcceleration(AxisSetting, code="SCV", args="{enabled}", ranged=True, example=("SCV 1", "SCV")):
    """S字加減速の設定: set whether acceleration follows an S-curve, for all axes of the unit."""

    enabled: Flag = Field(description=FLAG)


class SelfStartSpeeds(Reply, args="{speeds_pps}"):
    """Speeds at which motor axes start from standstill."""

    speeds_pps: KnownNumbers = Field(description="Per motor axis, in pulses per second.")


class GetSelfStartSpeeds(
    Query[SelfStartSpeeds], code="VSB", blocked="abc", example=("VSB", "VSB 500,500,200")
):
    """自起動速度の問い合わせ: get the speeds at which the motor axes start."""


class SetSelfStartSpeeds(
    AxisSetting, code="VSB", args="{speeds_pps}", ranged=True, example=("VSB 500,,0", "VSB")
):
    """自起動速度の設定: set the speeds at which the motor axes start."""

    speeds_pps: StartSpeeds = Field(description=f"In pulses per second, 0-9999. {AXES}")


class GetMaximumSpeeds(Query[AxisSpeeds], code="VSO", blocked="abc", example=("VSO", "VSO 300,310,400")):
    """最高速度の問い合わせ: get the maximum speeds."""


class SetMaximumSpeeds(
    AxisSpeedSetting,
    code="VSO",
    # The manual prints 300.0, 310.0, , 30; zeros and blanks may be left out.
    example=("VSO 300,310,,30", "VSO", "VSO ,310,400", "VSO"),
):
    """最高速度の設定: set the maximum speeds."""


class GetAccelerationTimes(Query[AxisTimes], code="VST", blocked="abc", example=("VST", "VST 100,100,250")):
    """加速時間の問い合わせ: get the times from the start speed to the maximum speed."""


class SetAccelerationTimes(TimeSetting, code="VST", example=("VST 100,,9999", "VST")):
    """加速時間の設定: set the times from the start speed to the maximum speed."""


class GetDecelerationTimes(Query[AxisTimes], code="VSS", blocked="abc", example=("VSS", "VSS 100,100,250")):
    """減速時間の問い合わせ: get the times from the maximum speed to the start speed."""


class SetDecelerationTimes(TimeSetting, code="VSS", example=("VSS 100,,9999", "VSS")):
    """減速時間の設定: set the times from the maximum speed to the start speed."""
