"""The encoder, its step-out detection and the adjustment after a move: code P (RC-420 manual 13.7, 14)."""

from typing import Annotated, Literal

from pydantic import AfterValidator, Field

from protocols.rorze.notation import Digits, Flag, Number, PaddedHundredths, TwoDecimals, Word, two_decimals
from protocols.rorze.row import OTHER_MODE, Question, RorzeCommand
from protocols.rorze.stall_sensor import MOVING_ERRORS, SETTING_ERRORS, Enabled, StallError, StepOutSetting
from protocols.table import Ack, Effect, R_co, Reply, Retry

MULTIPLIER = "Edges counted per encoder line: two or four."
RATIO = "Motor pulses per encoder count, 1.00-99999.99, at most two decimals."
THRESHOLD = "Difference between motor and encoder that is a step-out, in motor pulses, 0-3000."
LIMIT = "Most pulses an adjustment may take, 1-65535; beyond it is a STALL error."
SPEED = "In pps, 0-50000; 0 is the start speed (OL) of speed parameter set 30."
DELAY = "Wait between the end of a move and the adjustment, in units of 10 ms, 0-999."

Multiplier = Annotated[Literal["double", "quadruple"], Word(double="2", quadruple="4")]


class EncoderMultiplier(Reply, args="{multiplier}"):
    """The encoder's multiplier."""

    multiplier: Multiplier = Field(description=MULTIPLIER)


class EncoderRatio(Reply, args="{ratio}"):
    """The ratio of motor pulses to encoder counts."""

    ratio: Annotated[float, Field(ge=1, le=99_999.99), AfterValidator(two_decimals), PaddedHundredths(8)] = (
        Field(description=RATIO)
    )


class EncoderStallThreshold(Reply, args="{threshold}"):
    """The difference that is taken for a step-out."""

    threshold: Annotated[int, Field(ge=0, le=3_000), Digits(5)] = Field(description=THRESHOLD)


class AdjustmentLimit(Reply, args="{limit}"):
    """The most pulses an adjustment may take."""

    limit: Annotated[int, Field(ge=1, le=65_535), Digits(5)] = Field(description=LIMIT)


class AdjustmentSpeed(Reply, args="{speed}"):
    """The speed of an adjustment."""

    speed: Annotated[int, Field(ge=0, le=50_000), Digits(8)] = Field(description=SPEED)


class AdjustmentDelay(Reply, args="{delay_10ms}"):
    """The wait before an adjustment."""

    delay_10ms: Annotated[int, Field(ge=0, le=999), Digits(5)] = Field(description=DELAY)


class AdjustmentQuery(Question[R_co], modes="1", errors=OTHER_MODE):
    """Base of the questions for an adjustment."""


class AdjustmentSetting(StepOutSetting, modes="1", errors=SETTING_ERRORS | OTHER_MODE):
    """Base of the settings of an adjustment."""


# The pages of PAD, PAS, PJS and PKD have lost two columns; they are those of the other get and set commands.
class GetEncoderMultiplier(Question[EncoderMultiplier], code="PAD", example=("&3FPAD", ">&3FPAD4")):
    """エンコーダ通倍率取得: get the encoder's multiplier."""


class SetEncoderMultiplier(StepOutSetting, code="PAS", args="{multiplier}", example=("&3FPAS4", ">&3FPAS")):
    """エンコーダの通倍率設定: set the encoder's multiplier; quadruple by default.

    The ratio (PBS) has to follow it.
    """

    multiplier: Multiplier = Field(description=MULTIPLIER)


class GetEncoderRatio(Question[EncoderRatio], code="PBD", example=("&3FPBD", ">&3FPBD00200.00")):
    """エンコーダパルス比取得: get the ratio of motor pulses to encoder counts."""


class SetEncoderRatio(StepOutSetting, code="PBS", args="{ratio}", example=("&3FPBS200.00", ">&3FPBS")):
    """エンコーダパルス比設定: set the ratio of motor pulses to encoder counts; 1.00 by default."""

    ratio: Annotated[TwoDecimals, Field(ge=1, le=99_999.99)] = Field(description=RATIO)


class GetEncoderStallThreshold(
    Question[EncoderStallThreshold], code="PED", example=("&3FPED", ">&3FPED00128")
):
    """脱調検出パルス取得: get the difference that the encoder takes for a step-out."""


class SetEncoderStallThreshold(
    StepOutSetting, code="PES", args="{threshold}", example=("&3FPES128", ">&3FPES")
):
    """脱調検出パルス設定: set the difference that the encoder takes for a step-out; 128 by default."""

    threshold: Annotated[int, Field(ge=0, le=3_000), Number()] = Field(description=THRESHOLD)


class GetAdjustment(AdjustmentQuery[Enabled], code="PJD", example=("&3FPJD", ">&3FPJD1")):
    """アジャスト機能の取得: get whether an adjustment to the encoder follows a move."""


class SetAdjustment(AdjustmentSetting, code="PJS", args="{enabled}", example=("&3FPJS1", ">&3FPJS")):
    """アジャスト機能の設定: set whether an adjustment to the encoder follows a move; off by default."""

    enabled: Flag = Field(description="0 off, 1 on.")


class GetAdjustmentLimit(AdjustmentQuery[AdjustmentLimit], code="PKD", example=("&3FPKD", ">&3FPKD00800")):
    """アジャスト最大パルス値の取得: get the most pulses an adjustment may take."""


class SetAdjustmentLimit(AdjustmentSetting, code="PKS", args="{limit}", example=("&3FPKS800", ">&3FPKS")):
    """アジャスト最大パルス値の設定: set the most pulses an adjustment may take; 800 by default."""

    limit: Annotated[int, Field(ge=1, le=65_535), Number()] = Field(description=LIMIT)


class GetAdjustmentSpeed(AdjustmentQuery[AdjustmentSpeed], code="PLD", example=("&3FPLD", ">&3FPLD00001000")):
    """アジャスト速度取得: get the speed of an adjustment."""


class SetAdjustmentSpeed(AdjustmentSetting, code="PLS", args="{speed}", example=("&3FPLS500", ">&3FPLS")):
    """アジャスト速度設定: set the speed of an adjustment; 0 by default."""

    speed: Annotated[int, Field(ge=0, le=50_000), Number()] = Field(description=SPEED)


class GetEncoderStallError(Question[StallError], code="PRD", example=("&3FPRD", ">&3FPRD0")):
    """脱調検出状態取得: get whether the encoder has found a step-out."""


class ClearEncoderStallError(
    RorzeCommand[Ack],
    code="PRS",
    moving=False,
    errors=MOVING_ERRORS,
    retry=Retry.CONDITIONAL,
    effect=Effect.CLEARING,
    example=("&3FPRS", ">&3FPRS"),
):
    """脱調検出状態解除: clear the STALL error found by the encoder."""


class GetEncoderStallDetection(Question[Enabled], code="PSD", example=("&3FPSD", ">&3FPSD1")):
    """脱調検出設定取得: get whether the encoder is watched for step-outs."""


class SetEncoderStallDetection(StepOutSetting, code="PSS", args="{enabled}", example=("&3FPSS1", ">&3FPSS")):
    """脱調検出設定: set whether the encoder is watched for step-outs; off by default."""

    enabled: Flag = Field(description="0 off, 1 on.")


class GetAdjustmentDelay(AdjustmentQuery[AdjustmentDelay], code="PTD", example=("&3FPTD", ">&3FPTD00003")):
    """アジャスト開始までの時間取得: get the wait between a move and its adjustment."""


class SetAdjustmentDelay(AdjustmentSetting, code="PTS", args="{delay_10ms}", example=("&3FPTS3", ">&3FPTS")):
    """アジャスト開始までの時間設定: set the wait between a move and its adjustment; 3 by default."""

    delay_10ms: Annotated[int, Field(ge=0, le=999), Number()] = Field(description=DELAY)
