"""Position and encoder counters: code 6 (RC-420 manual 13.7, 14)."""

from typing import Annotated, Literal

from pydantic import Field

from protocols.rorze.notation import Pulses, SignedValue, Word
from protocols.rorze.row import Question, RorzeCommand
from protocols.table import Ack, Effect, Reply, Retry


class SignedPulses(Reply, args="{pulses}"):
    """A position or an amount."""

    pulses: SignedValue = Field(description="Value in pulses; in encoder counts in encoder mode.")


class EncoderCount(Reply, args="{count}"):
    """The encoder counter."""

    count: SignedValue = Field(description="Value of the encoder counter, in counts.")


class GetEncoderCount(Question[EncoderCount], code="6ED", example=("&3F6ED", ">&3F6ED+000050000")):
    """エンコーダカウント取得: get the encoder count."""


class SetEncoderCount(
    RorzeCommand[Ack],
    code="6ES",
    args="{count}",
    moving=False,
    errors=frozenset({0x4A, 0x50}),
    retry=Retry.CONDITIONAL,
    effect=Effect.SETTING,
    example=("&3F6ES5000", ">&3F6ES", "&3F6ESP", ">&3F6ES"),
):
    """エンコーダカウント設定: set the encoder count.

    The position in output pulses stays as it is.
    """

    count: Pulses | Annotated[Literal["position"], Word(position="P")] = Field(
        description="Encoder counts; `position` takes the present position over, divided by the PBS ratio."
    )


class GetEncoderPosition(Question[SignedPulses], code="6MD", example=("&3F6MD", ">&3F6MD+000050000")):
    """エンコーダカウント取得(パルス数換算): get the encoder count converted to output pulses."""


class GetPosition(Question[SignedPulses], code="6PD", example=("&3F6PD", ">&3F6PD+000050000")):
    """現在ポジション取得: get the present position.

    Counted in output pulses or by the encoder, as the operating mode is.
    """


class SetPosition(
    RorzeCommand[Ack],
    code="6PS",
    args="{position}",
    moving=False,
    errors=frozenset({0x4A, 0x50}),
    retry=Retry.CONDITIONAL,
    effect=Effect.SETTING,
    example=("&3F6PS5000", ">&3F6PS", "&3F6PSC", ">&3F6PS"),
):
    """現在ポジション設定: set the present position without moving.

    In encoder mode the encoder count is rewritten too.
    """

    position: Pulses | Annotated[Literal["encoder"], Word(encoder="C")] = Field(
        description="Pulses; `encoder` takes the encoder count over, multiplied by the PBS ratio."
    )
