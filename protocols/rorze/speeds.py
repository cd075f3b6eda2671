"""The speed parameters of a motion: codes O, with the letter O (RC-420 manual 14.O, 13.3)."""

from typing import Annotated

from pydantic import Field

from protocols.rorze.notation import Digits, Number, Slot, Speed
from protocols.rorze.row import Question, Setting
from protocols.table import R_co, Reply

Percent = Annotated[int, Field(ge=0, le=100), Number()]
StartSpeed = Annotated[int, Field(ge=1, le=30_000), Number()]
Acceleration = Annotated[int, Field(ge=1, le=10_000_000), Number()]


class SpeedQuery(Question[R_co], errors=frozenset({0x4A})):
    """Base of the questions for a speed parameter."""

    speed_set: Slot | None = Field(None, description="Number of the set; left out: the standard set, 30.")


class SpeedParameter(Setting, moving=False, errors=frozenset({0x4A, 0x50})):
    """Base of the settings of a speed parameter."""

    speed_set: Slot | None = Field(None, description="Number of the set; left out: the standard set, 30.")


class PercentReply(Reply, args="{percent}"):
    """A share of the acceleration time."""

    percent: Annotated[int, Field(ge=0, le=100), Digits(3)]


# The manual does not say what a set that was never written answers; the replies leave room for 0.
class SpeedReply(Reply, args="{speed}"):
    """A speed in pps; 0 where it was never set."""

    speed: Annotated[int, Field(ge=0, le=1_000_000), Digits(8)]


class AccelerationReply(Reply, args="{acceleration}"):
    """An acceleration in pps/s; 0 where it was never set."""

    acceleration: Annotated[int, Field(ge=0, le=10_000_000), Digits(8)]


class GetRisingAccelerationShare(
    SpeedQuery[PercentReply],
    code="OAD",
    args="<S[{speed_set}]>",
    example=("&3FOADS[12]", ">&3FOAD035", "&3FOAD", ">&3FOAD080"),
):
    """加速度増加区間率取得: get the share of the acceleration time in which the acceleration rises."""


class SetRisingAccelerationShare(
    SpeedParameter,
    code="OAS",
    args="<S[{speed_set}],>{percent}",
    example=("&3FOASS[12],35", ">&3FOAS", "&3FOAS80", ">&3FOAS"),
):
    """加速度増加区間率設定: set the share of the acceleration time in which the acceleration rises."""

    percent: Percent = Field(description="Percent of the acceleration or deceleration time; 50 at first.")


class GetFallingAccelerationShare(
    SpeedQuery[PercentReply],
    code="OBD",
    args="<S[{speed_set}]>",
    example=("&3FOBDS[12]", ">&3FOBD035", "&3FOBD", ">&3FOBD080"),
):
    """加速度減少区間率取得: get the share of the acceleration time in which the acceleration falls."""


class SetFallingAccelerationShare(
    SpeedParameter,
    code="OBS",
    args="<S[{speed_set}],>{percent}",
    example=("&3FOBSS[12],35", ">&3FOBS", "&3FOBS80", ">&3FOBS"),
):
    """加速度減少区間率設定: set the share of the acceleration time in which the acceleration falls."""

    percent: Percent = Field(description="Percent of the acceleration or deceleration time; 50 at first.")


class GetMaximumSpeed(
    SpeedQuery[SpeedReply],
    code="OHD",
    args="<S[{speed_set}]>",
    example=("&3FOHDS[12]", ">&3FOHD00005000", "&3FOHD", ">&3FOHD00005000"),
):
    """最大速度取得: get the maximum speed."""


class SetMaximumSpeed(
    SpeedParameter,
    code="OHS",
    args="<S[{speed_set}],>{speed}",
    example=("&3FOHSS[12],50000", ">&3FOHS", "&3FOHS50000", ">&3FOHS"),
):
    """最大速度設定: set the maximum speed."""

    speed: Speed = Field(description="Maximum speed, 1 to 1,000,000 pps; 50,000 at first.")


class GetStartSpeed(
    SpeedQuery[SpeedReply],
    code="OLD",
    args="<S[{speed_set}]>",
    example=("&3FOLDS[12]", ">&3FOLD00000050", "&3FOLD", ">&3FOLD00000050"),
):
    """起動速度取得: get the start speed."""


class SetStartSpeed(
    SpeedParameter,
    code="OLS",
    args="<S[{speed_set}],>{speed}",
    example=("&3FOLSS[12],50", ">&3FOLS", "&3FOLS50", ">&3FOLS"),
):
    """起動速度設定: set the start speed."""

    speed: StartSpeed = Field(description="Start speed, 1 to 30,000 pps; 50 at first.")


class GetMaximumAcceleration(
    SpeedQuery[AccelerationReply],
    code="OSD",
    args="<S[{speed_set}]>",
    example=("&3FOSDS[12]", ">&3FOSD00800000", "&3FOSD", ">&3FOSD00800000"),
):
    """最大加速度取得: get the maximum acceleration."""


class SetMaximumAcceleration(
    SpeedParameter,
    code="OSS",
    args="<S[{speed_set}],>{acceleration}",
    example=("&3FOSSS[12],800000", ">&3FOSS", "&3FOSS800000", ">&3FOSS"),
):
    """最大加速度設定: set the maximum acceleration."""

    acceleration: Acceleration = Field(description="Acceleration, 1 to 10,000,000 pps/s; 100,000 at first.")
