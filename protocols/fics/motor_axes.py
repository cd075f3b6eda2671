"""The motor axes behind converted user axes (C-HOST manual 4)."""

from protocols.fics.axis_settings import (
    AxisSpeeds,
    AxisSpeedSetting,
    AxisTimes,
    CoordinateSetting,
    PercentSetting,
    SetCoordinates,
    SpeedPercents,
    TimeSetting,
)
from protocols.fics.moves import AxesMove
from protocols.fics.row import Query
from protocols.fics.status import AxisCoordinates
from protocols.table import Retry


class MoveMotorsRelative(AxesMove, code="MMI", retry=Retry.NEVER, example=("MMI 10,,-30.5", "MMI")):
    """モータ軸としての相対移動: move motor axes by an amount; homing is not needed."""


class MoveMotorsAbsolute(AxesMove, code="MMA", retry=Retry.CONDITIONAL, example=("MMA 90,,-30.5", "MMA")):
    """モータ軸としての絶対移動: move motor axes to a position."""


class GetMotorPosition(Query[AxisCoordinates], code="MPS", example=("MPS", "MPS 90,#####,-30.5")):
    """モータ軸としての現在位置要求: get the present position of the motor axes."""


class GetMotorSpeedPercent(
    Query[SpeedPercents], code="MAO", blocked="abc", example=("MAO", "MAO 10.0,100.0,30.5")
):
    """モータ軸としての速度指定の問い合わせ: get the speed of MMI and MMA in percent; 100 after power-on."""


class SetMotorSpeedPercent(PercentSetting, code="MAO", example=("MAO 10,,30", "MAO")):
    """モータ軸としての速度指定: set the speed of MMI and MMA in percent of the maximum speed."""


class GetMotorMaximumSpeeds(Query[AxisSpeeds], code="MSO", blocked="abc", example=("MSO", "MSO 300,310,400")):
    """モータ軸としての最高速度の問い合わせ: get the maximum speeds of the motor axes."""


class SetMotorMaximumSpeeds(
    AxisSpeedSetting,
    code="MSO",
    # The manual prints MSO 300.0, 400.0 but speaks of the first and third axis: a hole is missing.
    example=("MSO 300,,400", "MSO"),
):
    """モータ軸としての最高速度の設定: set the maximum speeds of the motor axes."""


class GetMotorAccelerationTimes(
    Query[AxisTimes], code="MST", blocked="abc", example=("MST", "MST 100,100,250")
):
    """モータ軸としての加速時間の問い合わせ: get the acceleration times of the motor axes."""


class SetMotorAccelerationTimes(TimeSetting, code="MST", example=("MST 100,,9999", "MST")):
    """モータ軸としての加速時間の設定: set the acceleration times of the motor axes."""


class GetMotorDecelerationTimes(
    Query[AxisTimes], code="MSS", blocked="abc", example=("MSS", "MSS 100,100,250")
):
    """モータ軸としての減速時間の問い合わせ: get the deceleration times of the motor axes."""


class SetMotorDecelerationTimes(TimeSetting, code="MSS", example=("MSS 100,,9999", "MSS")):
    """モータ軸としての減速時間の設定: set the deceleration times of the motor axes."""


class GetMotorUpperSoftLimits(
    Query[SetCoordinates], code="MSP", blocked="abc", example=("MSP", "MSP 120,135.5,100")
):
    """モータ軸としての+ソフトリミットの問い合わせ: get the upper soft limits of the motor axes."""


class SetMotorUpperSoftLimits(CoordinateSetting, code="MSP", example=("MSP 120,,100", "MSP")):
    """モータ軸としての+ソフトリミットの設定: set the upper soft limits of the motor axes."""


class GetMotorLowerSoftLimits(
    Query[SetCoordinates], code="MSM", blocked="abc", example=("MSM", "MSM -120,-135.5,0")
):
    """モータ軸としての-ソフトリミットの問い合わせ: get the lower soft limits of the motor axes."""


class SetMotorLowerSoftLimits(CoordinateSetting, code="MSM", example=("MSM -120,,0", "MSM")):
    """モータ軸としての-ソフトリミットの設定: set the lower soft limits of the motor axes."""
