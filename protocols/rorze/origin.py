"""Origin search (homing) and its settings: codes beginning with zero (RC-420 manual 13.5, 14)."""

from typing import Annotated

from pydantic import Field

from protocols.rorze.notation import Digits, Number
from protocols.rorze.position import SignedPulses
from protocols.rorze.row import Question, RorzeCommand, Setting
from protocols.table import Ack, Effect, Reply, Retry

# The pages do not list 66, but it keeps the motor from moving (21).
HOMING_ERRORS = frozenset({*range(0x40, 0x49), 0x50, 0x51, 0x66})


class OriginSearch(
    RorzeCommand[Ack], moving=False, errors=HOMING_ERRORS, retry=Retry.CONDITIONAL, effect=Effect.MOTION
):
    """Base of the five methods of homing."""


class Home(OriginSearch, code="00M", example=("&3F00M", ">&3F00M")):
    """原点サーチ: origin search.

    At the start speed OL of speed parameter set 30, without stall detection. Success ends a STALL error.
    """


class HomeWithStallDetection(
    OriginSearch,
    code="01M",
    errors=HOMING_ERRORS | {0x52, 0x54},
    example=("&3F01M", ">&3F01M"),
):
    """脱調検出付き原点サーチ: origin search with stall detection, then centring of the stall dog."""


class HomeFastThenStop(OriginSearch, code="02M", example=("&3F02M", ">&3F02M")):
    """高速原点サーチ1: fast origin search, stopping at once at the sensor.

    Acceleration pattern 30 up to the origin sensor, then slowly from there.
    """


class HomeFastThenDecelerate(OriginSearch, code="03M", example=("&3F03M", ">&3F03M")):
    """高速原点サーチ2: fast origin search, decelerating at the sensor.

    Acceleration pattern 30 up to the origin sensor, then down to the start speed OL and slowly from there.
    """


class HomeLikeRc204(OriginSearch, code="04M", example=("&3F04M", ">&3F04M")):
    """原点サーチ実行(弊社RC-204互換): origin search as the RC-204 does it.

    Ends on the CW side of the origin sensor, by the origin offset.
    """


class CentreStallDog(
    RorzeCommand[Ack],
    code="0QM",
    moving=False,
    errors=frozenset({0x50, 0x51, 0x52, 0x55, 0x66}),
    retry=Retry.CONDITIONAL,
    effect=Effect.MOTION,
    example=("&3F0QM", ">&3F0QM"),
):
    """脱調中心合わせ: move to the centre of the stall dog.

    Prepares stall detection by the STALL sensor, which must be on at the start (RC-420 manual 13.6.2).
    """


class OverrunFactor(Reply, args="{factor}"):
    """The overrun past the edge of the origin sensor, in origin offsets."""

    factor: Annotated[int, Field(ge=0, le=5), Digits(1)]


class GetOverrunFactor(Question[OverrunFactor], code="0BD", example=("&3F0BD", ">&3F0BD2")):
    """オーバーラン倍率取得: get the overrun factor of the origin search."""


class SetOverrunFactor(
    Setting,
    code="0BS",
    args="{factor}",
    errors=frozenset({0x4A}),
    example=("&3F0BS2", ">&3F0BS"),
):
    """オーバーラン倍率設定: set the overrun factor of the origin search.

    The overrun is origin offset times factor, in pulses (RC-420 manual 13.5.1).
    """

    factor: Annotated[int, Field(ge=0, le=5, description="Origin offsets to overrun, initially 2."), Number()]


class GetHomingDistance(Question[SignedPulses], code="0PD", example=("&3F0PD", ">&3F0PD+000010000")):
    """原点サーチ・脱調中心合わせ時の移動量取得: get the distance moved by homing or centring the stall dog.

    Start position minus end position, in pulses.
    """


class HomingRetries(Reply, args="{retries}"):
    """Further attempts after a failed origin search."""

    retries: Annotated[int, Field(ge=0, le=9), Digits(1)]


class GetHomingRetries(Question[HomingRetries], code="0RD", example=("&3F0RD", ">&3F0RD2")):
    """原点サーチのリトライ回数取得: get the number of retries of the origin search."""


class SetHomingRetries(
    Setting,
    code="0RS",
    args="{retries}",
    errors=frozenset({0x4A}),
    example=("&3F0RS2", ">&3F0RS"),
):
    """原点サーチのリトライ回数設定: set the number of retries of the origin search."""

    retries: Annotated[int, Field(ge=0, le=9, description="Further attempts, initially 0."), Number()]


class OriginOffset(Reply, args="{offset}"):
    """The distance from the CW edge of the origin sensor to the origin."""

    # Width as that of the other settings up to 65535; the page is lost.
    offset: Annotated[
        int,
        Field(
            ge=1,
            le=65_535,
            description="Distance from the CW edge of the origin sensor to the origin, in pulses.",
        ),
        Digits(5),
    ]


class GetOriginOffset(Question[OriginOffset], code="0SD", example=("&3F0SD", ">&3F0SD00020")):
    """原点オフセット取得: get the origin offset."""


class SetOriginOffset(
    Setting,
    code="0SS",
    args="{offset}",
    errors=frozenset({0x4A}),
    example=("&3F0SS20", ">&3F0SS"),
):
    """原点オフセット設定: set the origin offset.

    Distance from the CW edge of the origin sensor to the origin (RC-420 manual 13.5.1).
    """

    offset: Annotated[int, Field(ge=1, le=65_535, description="Offset in pulses, initially 10."), Number()]
