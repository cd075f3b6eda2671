"""Acceleration patterns A[n]: codes S (RC-420 manual 14.S, 13.3.4, 13.3.7)."""

from typing import Annotated

from pydantic import Field

from protocols.rorze.notation import BILLION, Amount, Number, Slot, Speed, UpTo
from protocols.rorze.row import RorzeCommand
from protocols.table import Ack, R_co, Reply, Retry

ChangePoint = Annotated[int, Field(ge=0, le=15), Number()]
AmountValue = Annotated[int, Field(ge=0, lt=BILLION), UpTo(9)]
UsedSpeedSet = Annotated[int, Field(ge=0, le=30), UpTo(2)]
"""A speed parameter set as answered; 30 is the standard one."""

PATTERN_ERRORS = frozenset({*range(0x40, 0x49), 0x4A, 0x50})


class PatternCommand(RorzeCommand[R_co], moving=False, program=False, errors=PATTERN_ERRORS):
    """Base of all pattern commands: at standstill, not in programs."""


class SpeedChangePoint(Reply, args="F{begin},T{end},S{speed}|NoData"):
    """A change of speed during a move; nothing where none is set."""

    begin: AmountValue | None = Field(None, description="Pulses after the start at which the change begins.")
    end: AmountValue | None = Field(None, description="Pulses after the start at which the change is done.")
    speed: Annotated[int, Field(ge=1, le=1_000_000), UpTo(7)] | None = Field(
        None, description="Speed after the change, in pps."
    )


class GetSpeedChange(
    PatternCommand[SpeedChangePoint],
    code="SED",
    args="A[{pattern}],{point}",
    errors=PATTERN_ERRORS | {0x65},
    retry=Retry.READ,
    example=("&3FSEDA[3],2", ">&3FSEDF5321,T8000,S5000", "&3FSEDA[3],5", ">&3FSEDNoData"),
):
    """速度変更設定取得: get a change of speed during moves with a pattern."""

    pattern: Slot
    point: ChangePoint = Field(description="Number of the change, 0 to 15.")


class SetSpeedChange(
    PatternCommand[Ack],
    code="SES",
    args="A[{pattern}]|A[{pattern}],{point},F{begin},S{speed}|A[{pattern}],{point},T{end},S{speed}",
    retry=Retry.SETTING,
    example=(
        "&3FSESA[3]",
        ">&3FSES",
        "&3FSESA[3],2,F50000,S3000",
        ">&3FSES",
        "&3FSESA[3],2,T50000,S3000",
        ">&3FSES",
    ),
):
    """速度変更設定: set a change of speed during moves with a pattern.

    It is placed by where it begins or by where it ends. The pattern alone clears all its changes.
    """

    pattern: Slot
    point: ChangePoint | None = Field(None, description="Number of the change, 0 to 15.")
    begin: Amount | None = Field(None, description="Pulses after the start at which the change begins.")
    end: Amount | None = Field(None, description="Pulses after the start at which the change is done.")
    speed: Speed | None = Field(None, description="Speed after the change, 1 to 1,000,000 pps.")


class SpeedChangePulses(Reply, args="{pulses}"):
    """The way a change of speed takes."""

    # The manual starts at 1; equal speeds take none.
    pulses: Annotated[int, Field(ge=0, le=BILLION), UpTo(10)]


class GetSpeedChangePulses(
    PatternCommand[SpeedChangePulses],
    code="SHD",
    args="<A[{pattern}],>{start_speed},{end_speed}",
    retry=Retry.READ,
    example=("&3FSHDA[3],50000,20000", ">&3FSHD32275"),
):
    """加減速パルス数取得: get the pulses a change of speed takes."""

    start_speed: Speed = Field(description="Speed before the change, 1 to 1,000,000 pps.")
    end_speed: Speed = Field(description="Speed after the change, 1 to 1,000,000 pps.")
    pattern: Slot | None = None


class PatternSpeedSets(Reply, args="A:S[{acceleration}],D:S[{deceleration}]"):
    """The speed parameter sets a pattern is made of."""

    acceleration: UsedSpeedSet
    deceleration: UsedSpeedSet


class GetPattern(
    PatternCommand[PatternSpeedSets],
    code="SPD",
    args="<A[{pattern}]>",
    retry=Retry.READ,
    example=("&3FSPDA[3]", ">&3FSPDA:S[12],D:S[13]"),
):
    """加減速パターン取得: get the speed parameter sets of an acceleration pattern."""

    pattern: Slot | None = None


class SetPattern(
    PatternCommand[Ack],
    code="SPS",
    args="A[{pattern}],A:S[{acceleration}],D:S[{deceleration}]",
    errors=frozenset({0x4A, 0x50}),
    retry=Retry.SETTING,
    example=("&3FSPSA[3],A:S[12],D:S[13]", ">&3FSPS"),
):
    """加減速パターン設定: make an acceleration pattern of two speed parameter sets."""

    pattern: Slot
    acceleration: Slot = Field(description="Speed parameter set of the acceleration, 0 to 29.")
    deceleration: Slot = Field(description="Speed parameter set of the deceleration, 0 to 29.")


class PatternPulses(Reply, args="A:{acceleration},D:{deceleration}"):
    """The pulses acceleration and deceleration take."""

    acceleration: AmountValue
    deceleration: AmountValue


class GetPatternPulses(
    PatternCommand[PatternPulses],
    code="SSD",
    args="A[{pattern}]",
    errors=PATTERN_ERRORS | {0x65},
    retry=Retry.READ,
    example=("&3FSSDA[3]", ">&3FSSDA:32275,D:12384"),
):
    """加減速区間パルス数取得: get the pulses the acceleration and deceleration of a pattern take."""

    pattern: Slot
