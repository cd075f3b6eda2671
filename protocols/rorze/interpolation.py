"""Synchronous interpolation of a SCARA robot's axes: codes H (RC-420 manual 14.H, 13.10)."""

from typing import Annotated, Any, Literal, Self

from pydantic import AfterValidator, Field, ValidatorFunctionWrapHandler, WrapValidator

from protocols.rorze.notation import (
    BILLION,
    Digits,
    Number,
    Plain,
    PositionRef,
    Pulses,
    Signed,
    SignedValue,
    Slot,
    UpTo,
    Word,
)
from protocols.rorze.position import SignedPulses
from protocols.rorze.row import OTHER_MODE, RorzeCommand
from protocols.table import Ack, Effect, R_co, Reply, Retry, Wire

NOT_MOVING = OTHER_MODE | {0x50}
# The pages list neither a way that is not possible, nor an error output that stands, nor EPS, nor a position
# index that has left the table, but what they mean (21, 13.4.3) befalls these commands.
NO_WAY = frozenset({0x63, 0x64})
BY_REFERENCE = NOT_MOVING | {0x4A, 0x5D}
NOT_FREE = NOT_MOVING | {0x51, 0x52, 0x55, 0x5D, 0x66}
PREPARATION_ERRORS = NOT_FREE | NO_WAY | {*range(0x40, 0x49), 0x4A}


class WrittenNumber(float):
    """A number from the wire, which keeps its decimals: 60000.000 is written as it came."""

    decimals: int

    def __new__(cls, text: str) -> Self:
        """Read the number."""
        number = super().__new__(cls, text)
        number.decimals = len(text.partition(".")[2])
        return number


class EightDecimals(Wire):
    """A number with one to eight decimals and `least` to `most` digits before them."""

    def __init__(self, least: int, most: int) -> None:
        self._least = least
        self.pattern = rf"\d{{{least},{most}}}\.\d{{1,8}}"

    def encode(self, value: Any) -> str:
        """Write as many decimals as it came with; one that was calculated has as many as it needs, or two."""
        if isinstance(value, WrittenNumber):
            return f"{value:0{self._least + 1 + value.decimals}.{value.decimals}f}"
        whole, _, decimals = f"{value:.8f}".rstrip("0").partition(".")
        return f"{whole.zfill(self._least)}.{decimals:0<2}"

    def decode(self, text: str) -> WrittenNumber:
        """Read the number."""
        return WrittenNumber(text)


def _as_it_came(value: object, check: ValidatorFunctionWrapHandler) -> float:
    checked: float = check(value)
    return value if isinstance(value, WrittenNumber) else checked


def eight_decimals(value: float) -> float:
    """Refuse what the controller could not hold."""
    if round(value, 8) != value:
        raise ValueError("at most eight decimals")
    return value


Measure = Pulses | PositionRef
"""A number, or the position table entry that holds it; in these commands it is in the parameter's own unit
(RC-420 manual 13.4.4)."""
Coordinate = Annotated[int, Field(gt=-BILLION, lt=BILLION), Plain()]
Length = Annotated[int, Field(ge=1, lt=BILLION), Number()]
Axis = Annotated[int, Field(ge=0, le=9), Number()]
Path = Annotated[int, Field(ge=0, le=63), Number()]
MOST_POINTS = 16
"""Via points of a path (RC-420 manual 13.10.5)."""
ViaPoint = Annotated[int, Field(ge=0, lt=MOST_POINTS), Number()]
Center = Annotated[Literal["center"], Word(center="CENTER")]
RobotType = Literal["three_axes", "two_axes_belt_linked"]
RobotTypeWire = Word(three_axes="0", two_axes_belt_linked="1")
PulsesOfTurn = Annotated[
    float, Field(ge=1, le=9_999_999.99), AfterValidator(eight_decimals), WrapValidator(_as_it_came)
]

COORDINATE = "Micrometres, between -1,000,000,000 and +1,000,000,000."
ANGLE = "Angle between finger and X axis in thousandths of a degree."
AXIS = "Axis 0-9, of which 0-2 are used."


class Interpolation(RorzeCommand[R_co], modes="02", moving=False, program=False, errors=NOT_MOVING | {0x4A}):
    """Base of all interpolation commands: not in encoder mode, at standstill, not in programs."""


class InterpolationQuestion(Interpolation[R_co], errors=NOT_MOVING, retry=Retry.READ):
    """Base of the questions without parameters."""


class InterpolationSetting(Interpolation[Ack], retry=Retry.SETTING):
    """Base of the settings."""


class Preparation(
    Interpolation[Ack], errors=PREPARATION_ERRORS, retry=Retry.CONDITIONAL, effect=Effect.SETTING
):
    """Base of the preparations of a move: HPS must come before, and HMM starts the move."""

    pattern: Slot | None = None


class StraightPreparation(Preparation):
    """A preparation that takes a distance."""

    distance: Measure = Field(description=COORDINATE)


class PrepareArmExtension(
    StraightPreparation,
    code="H+S",
    args="<A[{pattern}],>{distance}",
    example=("&01H+SA[1],1000", ">&01H+S"),
):
    """アームを伸ばす移動の準備: prepare to extend the arm along its axis.

    The table of chapter 19 allows positive distances only.
    """


class PrepareArmRetraction(
    StraightPreparation,
    code="H-S",
    args="<A[{pattern}],>{distance}",
    example=("&01H-SA[1],1000", ">&01H-S"),
):
    """アームを縮める移動の準備: prepare to retract the arm along its axis.

    The table of chapter 19 allows positive distances only.
    """


class ArmLength(Reply, args="{length}"):
    """The length of the arm in micrometres."""

    length: Annotated[int, Field(ge=1, lt=BILLION), Signed()]


class GetArmLength(InterpolationQuestion[ArmLength], code="HAD", example=("&01HAD", ">&01HAD+000156000")):
    """アーム長取得: get the length of the arm."""


class SetArmLength(InterpolationSetting, code="HAS", args="{length}", example=("&01HAS156000", ">&01HAS")):
    """アーム長設定: set the length of the arm."""

    length: Length = Field(description="Micrometres; 1 at first.")


class DrivenAxis(Reply, args="{axis}"):
    """The axis a controller drives."""

    axis: Annotated[int, Field(ge=0, le=9), Digits(1)]


class GetDrivenAxis(InterpolationQuestion[DrivenAxis], code="HCD", example=("&01HCD", ">&01HCD1")):
    """担当軸取得: get the axis this controller drives."""


class SetDrivenAxis(InterpolationSetting, code="HCS", args="{axis}", example=("&01HCS1", ">&01HCS")):
    """担当軸設定: set the axis this controller drives.

    Axis 0 turns the arm, 1 is the arm, 2 the finger. For belt-linked robots the page swaps 0 and 1, but the
    worked example of 13.10.11 does not.
    """

    axis: Axis = Field(description=AXIS)


class PathPoint(Reply, args="X:{x},Y:{y},R:{radius}|{place}|NoData"):
    """A via point: coordinates in micrometres, or the place `center`; nothing where none is set."""

    x: Coordinate | None = None
    y: Coordinate | None = None
    radius: Annotated[int, Field(ge=0, lt=BILLION), UpTo(9)] | None = None
    place: Center | None = None


class GetPathPoint(
    Interpolation[PathPoint],
    code="HDD",
    args="H[{path}],{point}",
    retry=Retry.READ,
    example=(
        "&01HDDH[3],1",
        ">&01HDDX:200000,Y:100000,R:50000",
        "&01HDDH[3],1",
        ">&01HDDCENTER",
        "&01HDDH[3],1",
        ">&01HDDNoData",
    ),
):
    """補間パターン経路点の取得: get a via point of an interpolation path."""

    path: Path = Field(description="Interpolation path 0-63.")
    point: ViaPoint = Field(description="Via point 0-15.")


class SetPathPoint(
    InterpolationSetting,
    code="HDS",
    args="H[{path}],{point},X:{x},Y:{y},R:{radius}|H[{path}],{point},{place}|H[{path}]",
    errors=BY_REFERENCE,
    example=(
        "&01HDSH[3],1,X:200000,Y:100000,R:50000",
        ">&01HDS",
        "&01HDSH[3],1,X:P[1000],Y:P[1001],R:P[1002]",
        ">&01HDS",
        "&01HDSH[3],1,CENTER",
        ">&01HDS",
        "&01HDSH[3]",
        ">&01HDS",
    ),
):
    """補間パターン経由点の設定: set a via point of an interpolation path.

    The path alone clears all its points.
    """

    path: Path = Field(description="Interpolation path 0-63.")
    point: ViaPoint | None = Field(None, description="Via point 0-15.")
    x: Measure | None = Field(None, description=COORDINATE)
    y: Measure | None = Field(None, description=COORDINATE)
    radius: Annotated[int, Field(ge=0, lt=BILLION), Number()] | PositionRef | None = Field(
        None, description="Radius of the rounded corner in micrometres; 0 at the end of the path."
    )
    place: Center | None = Field(
        None, description="`center`: the third joint is over the origin of coordinates."
    )


class FingerLength(Reply, args="{length}"):
    """The distance from the third joint to the centre of the wafer in micrometres."""

    length: Annotated[int, Field(ge=1, lt=BILLION), UpTo(9)]


class GetFingerLength(InterpolationQuestion[FingerLength], code="HFD", example=("&01HFD", ">&01HFD300000")):
    """第3関節－ウェハ中心距離取得: get the distance from the third joint to the centre of the wafer."""


class TurnFinger(
    Interpolation[Ack],
    code="HFM",
    args="<A[{pattern}],>F:{angle}|<A[{pattern}],>{angle}",
    errors=PREPARATION_ERRORS,
    retry=Retry.NEVER,
    effect=Effect.MOTION,
    example=("&01HFMA[0],F:90000", ">&01HFM"),
):
    """指定フィンガー方向に移動: turn the finger to a direction, moving axis 2 only.

    Needs the start positions (HPS). The bare angle of 13.10.9 is understood, but not written.
    """

    angle: Measure = Field(description=ANGLE)
    pattern: Slot | None = None


class SetFingerLength(InterpolationSetting, code="HFS", args="{length}", example=("&01HFS300000", ">&01HFS")):
    """第3関節－ウェハ中心距離設定: set the distance from the third joint to the centre of the wafer."""

    length: Length = Field(description="Micrometres; 1 at first.")


class Coordinates(Reply, args="X:{x},Y:{y},F:{angle}"):
    """Where the wafer's point is, in micrometres, and the finger's angle in thousandths of a degree."""

    x: SignedValue
    y: SignedValue
    angle: SignedValue


class ConvertPulsesToCoordinates(
    Interpolation[Coordinates],
    code="HLD",
    args="0:{axis_0},1:{axis_1}<,2:{axis_2}>|",
    errors=BY_REFERENCE | {0x63},
    retry=Retry.READ,
    example=(
        "&02HLD0:-10149,1:-10000,2:-16666",
        ">&02HLDX:+000000000,Y:+000115000,F:+000090000",
        "&01HLD0:1000,1:-2000",
        ">&01HLDX:+000200000,Y:+000100000,F:+000090000",
        "&01HLD0:P[100],1:P[101],2:P[102]",
        ">&01HLDX:+000200000,Y:+000100000,F:+000090000",
        "&02HLD",
        ">&02HLDX:+000000000,Y:+000115000,F:+000090000",
    ),
):
    """ポジション－座標変換: calculate coordinates and finger direction of the axes' positions.

    Without positions: of those set by HPS (RC-420 manual 13.10.7). Belt-linked robots have no axis 2.
    """

    axis_0: Measure | None = Field(None, description="Pulses.")
    axis_1: Measure | None = Field(None, description="Pulses.")
    axis_2: Measure | None = Field(None, description="Pulses.")


class AxisPositions(Reply, args="0:{axis_0},1:{axis_1}<,2:{axis_2}>"):
    """The positions of the axes in pulses; belt-linked robots have no axis 2."""

    axis_0: SignedValue
    axis_1: SignedValue
    axis_2: SignedValue | None = None


class ConvertCoordinatesToPulses(
    Interpolation[AxisPositions],
    code="HLS",
    args="X:{x},Y:{y}<,F:{angle}>",
    errors=BY_REFERENCE | {0x63},
    retry=Retry.READ,
    example=(
        "&02HLSX:0,Y:115000,F:90000",
        ">&02HLS0:-000010149,1:-000010000,2:-000016666",
        "&01HLSX:200000,Y:100000",
        ">&01HLS0:+000001000,1:-000002000",
        "&01HLSX:P[103],Y:P[104]",
        ">&01HLS0:+000001000,1:-000002000",
    ),
):
    """座標－ポジション変換: calculate the positions of the axes for coordinates and finger direction.

    Belt-linked robots need no angle.
    """

    x: Measure = Field(description=COORDINATE)
    y: Measure = Field(description=COORDINATE)
    angle: Measure | None = Field(None, description=ANGLE)


class StartInterpolation(
    Interpolation[Ack],
    code="HMM",
    errors=NOT_FREE,
    retry=Retry.NEVER,
    effect=Effect.MOTION,
    example=("&80HMM", ">&80HMM"),
):
    """同期補間移動開始: start the prepared interpolated move."""


class PreparePath(
    Preparation,
    code="HMS",
    args="<A[{pattern}],>H[{path}]",
    example=("&01HMSA[1],H[3]", ">&01HMS"),
):
    """同期補間移動準備: prepare an interpolated move along a path."""

    path: Path = Field(description="Interpolation path 0-63.")


class MoveToExtensionStart(
    Interpolation[Ack],
    code="HNM",
    args="<A[{pattern}],>X:{x},Y:{y}|<A[{pattern}],>H[{path}]",
    errors=PREPARATION_ERRORS,
    retry=Retry.NEVER,
    effect=Effect.MOTION,
    example=("&01HNMA[1],X:100,Y:200", ">&01HNM", "&01HNMA[1],H[3]", ">&01HNM"),
):
    """アーム伸縮のための移動開始位置に移動: turn axes 0 and 2 towards the target of an extension.

    The target is a point or the end of a path. Needs the start positions (HPS).
    """

    x: Measure | None = Field(None, description=COORDINATE)
    y: Measure | None = Field(None, description=COORDINATE)
    path: Path | None = Field(None, description="Interpolation path 0-63.")
    pattern: Slot | None = None


class GetStartPosition(
    Interpolation[SignedPulses],
    code="HPD",
    args="{axis}",
    retry=Retry.READ,
    example=("&01HPD0", ">&01HPD+000083333"),
):
    """移動開始ポジション取得: get the position from which an axis will start."""

    axis: Axis = Field(description=AXIS)


class SetStartPosition(
    InterpolationSetting,
    code="HPS",
    args="{axis},{position}",
    errors=BY_REFERENCE,
    example=("&01HPS0,83333", ">&01HPS"),
):
    """移動開始ポジション設定: tell a controller from where an axis will start.

    Every axis needs it before each interpolated move.
    """

    axis: Axis = Field(description=AXIS)
    position: Measure = Field(description="Pulses.")


class PrepareFingerRotation(
    Preparation,
    code="HRS",
    args="<A[{pattern}],>R:{radius},F:{angle}",
    example=("&80HRSA[3],R:150000,F:90000", ">&80HRS"),
):
    """フィンガー上の一点を中心に、フィンガーを指定方向に向ける動作の準備: prepare a turn about a point.

    The point is on the line of the finger.
    """

    radius: Measure = Field(description="Distance from axis 2 to the centre of the turn, in micrometres.")
    angle: Measure = Field(description=ANGLE)


class RobotTypeReply(Reply, args="{robot}"):
    """The mechanics an interpolation is calculated for."""

    robot: Annotated[RobotType, RobotTypeWire]


class GetRobotType(InterpolationQuestion[RobotTypeReply], code="HTD", example=("&01HTD", ">&01HTD0")):
    """補間タイプ取得: get the mechanics the interpolation is calculated for."""


class SetRobotType(InterpolationSetting, code="HTS", args="{robot}", example=("&01HTS0", ">&01HTS")):
    """補間タイプ設定: set the mechanics the interpolation is calculated for."""

    robot: Annotated[RobotType, RobotTypeWire] = Field(
        description="Three independent axes (such as RR730), or two with belts (such as RR701, the default)."
    )


class PrepareMoveAlongX(
    StraightPreparation,
    code="HXS",
    args="<A[{pattern}],>{distance}",
    example=("&01HXSA[1],1000", ">&01HXS"),
):
    """X方向への同期補間移動準備: prepare an interpolated move in X."""


class PrepareMoveAlongY(
    StraightPreparation,
    code="HYS",
    args="<A[{pattern}],>{distance}",
    example=("&01HYSA[1],1000", ">&01HYS"),
):
    """Y方向への同期補間移動準備: prepare an interpolated move in Y."""


class PulsesPerTurn(Reply, args="{pulses}"):
    """The pulses of a full turn; as many decimals as were set."""

    pulses: Annotated[PulsesOfTurn, EightDecimals(8, 8)]


class GetPulsesPerTurn(
    Interpolation[PulsesPerTurn],
    code="HZD",
    args="{axis}",
    retry=Retry.READ,
    example=("&01HZD1", ">&01HZD00005000.00"),
):
    """各軸分解能取得: get the pulses of a full turn of an axis."""

    axis: Axis = Field(description=AXIS)


class SetPulsesPerTurn(
    InterpolationSetting,
    code="HZS",
    args="{axis},{pulses}",
    example=("&01HZS1,5000.00", ">&01HZS"),
):
    """各軸分解能設定: set the pulses of a full turn of an axis."""

    axis: Axis = Field(description=AXIS)
    pulses: Annotated[PulsesOfTurn, EightDecimals(1, 7)] = Field(
        description="Pulses of a full turn, 1 to 9,999,999.99 with up to eight decimals; 1 at first."
    )
