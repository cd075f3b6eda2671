"""Homing and its settings (C-HOST manual 2-4, 2-25 to 2-28)."""

from typing import Annotated

from pydantic import Field

from protocols.fics.axis_settings import (
    AxisSetting,
    AxisSpeeds,
    AxisSpeedSetting,
    CoordinateSetting,
    SetCoordinates,
)
from protocols.fics.notation import AXES, Cut, FicsWhole, ListLength, PerAxis, Within
from protocols.fics.row import Query, RobotAction
from protocols.table import Effect, Reply, Retry

TYPES = (
    "0 encoder Z phase, 1 no Z phase, 2 and 3 the same without turning back at the sensor, "
    "4 and 5 the same with the limit sensor for the origin sensor, 6 fast with Z phase."
)
TypeNumber = Annotated[int, Within(0, 6)]


class HomeRobot(
    RobotAction,
    code="ORG",
    blocked="abc",
    retry=Retry.CONDITIONAL,
    effect=Effect.MOTION,
    example=("ORG", "ORG"),
):
    """原点復帰: home all axes, or the mechanism as program 999 does it."""


class HomingTypes(Reply, args="{types}"):
    """Homing methods of the motor axes of the unit."""

    types: Annotated[list[TypeNumber], ListLength, PerAxis(FicsWhole(), hole=None)] = Field(description=TYPES)


class GetHomingTypes(Query[HomingTypes], code="HMT", blocked="abc", example=("HMT", "HMT 0,4,6")):
    """原点復帰タイプの問い合わせ: get how the motor axes find their origins."""


class SetHomingTypes(AxisSetting, code="HMT", args="{types}", ranged=True, example=("HMT 0,,6", "HMT")):
    """原点復帰タイプの設定: set how the motor axes find their origins."""

    types: Annotated[list[TypeNumber | None], ListLength, Cut, PerAxis(FicsWhole())] = Field(
        description=f"{TYPES} {AXES}"
    )


class GetHomingOffsets(Query[SetCoordinates], code="HMO", blocked="abc", example=("HMO", "HMO 0,-1.5,10")):
    """原点オフセットの問い合わせ: get where the motor axes go after homing."""


class SetHomingOffsets(CoordinateSetting, code="HMO", example=("HMO 0,,-1.5", "HMO")):
    """原点オフセットの設定: set where the motor axes go after homing; that place becomes 0."""


class GetHomingSpeeds(Query[AxisSpeeds], code="HMV", blocked="abc", example=("HMV", "HMV 50,50,12.5")):
    """原点復帰速度(高速)の問い合わせ: get the speeds at which sensors are looked for."""


class SetHomingSpeeds(AxisSpeedSetting, code="HMV", example=("HMV 50,,12.5", "HMV")):
    """原点復帰速度(高速)の設定: set the speeds at which sensors are looked for."""


class GetIndexSearchSpeeds(Query[AxisSpeeds], code="HMB", blocked="abc", example=("HMB", "HMB 5,5,1.25")):
    """原点復帰速度(Zサーチ速度)の問い合わせ: get the speeds at which the Z phase is looked for."""


class SetIndexSearchSpeeds(AxisSpeedSetting, code="HMB", example=("HMB 5,,1.25", "HMB")):
    """原点復帰速度(Zサーチ速度)の設定: set the speeds at which the Z phase is looked for."""
