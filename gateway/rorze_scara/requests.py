"""Moves of SCARA robots in the words of clients: their kinds, and the commands they come to."""

from abc import abstractmethod
from collections.abc import Callable, Mapping, Sequence
from typing import Annotated, Any, Final, Literal, NamedTuple, Self

from pydantic import Field, WithJsonSchema, model_validator

from gateway.core.records import RequestModel, example
from gateway.rorze.move_requests import Pattern
from gateway.rorze.plans import require_one_speed
from gateway.rorze_scara.paths import commands_for
from gateway.rorze_scara.record import ScaraMoveKind
from protocols.rorze import ways
from protocols.rorze.interpolation import (
    MOST_POINTS,
    MoveToExtensionStart,
    Path,
    PathPoint,
    PrepareArmExtension,
    PrepareArmRetraction,
    PrepareFingerRotation,
    PrepareMoveAlongX,
    PrepareMoveAlongY,
    PreparePath,
    StartInterpolation,
    TurnFinger,
)
from protocols.rorze.notation import BILLION
from protocols.rorze.path import Path as WayPath
from protocols.rorze.row import RorzeCommand
from protocols.rorze.scara import TURN, FingerPlace, Mechanics, Pose

_IN_THOUSANDTHS: Final[Mapping[str, float]] = {"mm": 1000.0, "um": 1.0, "deg": 1000.0, "mdeg": 1.0}
_Value = Annotated[int | float, WithJsonSchema({"type": "number"})]


class _Amount(RequestModel):
    """A number with its unit."""

    value: _Value = Field(gt=-1e9, lt=1e9)
    unit: str

    @property
    def exactly(self) -> float:
        """In micrometres, or thousandths of a degree."""
        return self.value * _IN_THOUSANDTHS[self.unit.removesuffix("/s")]

    @property
    def thousandths(self) -> int:
        """The length as the controllers count."""
        return round(self.exactly)

    @model_validator(mode="after")
    def _fits_its_column(self) -> Self:
        if abs(self.thousandths) >= BILLION:
            raise ValueError("must be less than 1,000,000 mm or deg")
        return self


class Distance(_Amount, json_schema_extra=example(value=1, unit="mm")):
    """A length or a coordinate."""

    unit: Literal["mm", "um"]


class Angle(_Amount, json_schema_extra=example(value=90, unit="deg")):
    """An angle, counterclockwise from X."""

    unit: Literal["deg", "mdeg"]


class PathSpeed(_Amount, json_schema_extra=example(value=5, unit="mm/s")):
    """How fast the finger's end goes along its way."""

    value: _Value = Field(gt=0, lt=1e6)
    unit: Literal["mm/s", "um/s"]


class TurnSpeed(_Amount, json_schema_extra=example(value=5, unit="deg/s")):
    """How fast each axis turns."""

    value: _Value = Field(gt=0, lt=1e6)
    unit: Literal["deg/s", "mdeg/s"]


class ViaPoint(
    RequestModel, json_schema_extra=example(x={"value": 255, "unit": "mm"}, y={"value": 300, "unit": "mm"})
):
    """A point that a path leads through, or the centre (RC-420 manual 13.10.5, 13.10.6)."""

    x: Distance | None = None
    y: Distance | None = None
    radius: Distance | None = Field(
        None, description="Radius of the arc that rounds the corner; left out, 0. The last point has none."
    )
    place: Literal["center"] | None = Field(
        None, description="`center`: the third joint is over the origin of coordinates."
    )

    @model_validator(mode="after")
    def _one_place(self) -> Self:
        given = (self.x is None, self.y is None, self.place is None)
        if given not in ((False, False, True), (True, True, False)):
            raise ValueError("give x and y, or place")
        if self.radius is not None and (self.place is not None or self.radius.thousandths < 0):
            raise ValueError("radius belongs to x and y, and is not negative")
        return self

    def point(self) -> PathPoint:
        """As the controllers hold it."""
        if self.x is None or self.y is None:
            return PathPoint(place=self.place)
        radius = 0 if self.radius is None else self.radius.thousandths
        return PathPoint(x=self.x.thousandths, y=self.y.thousandths, radius=radius)


class MoveStart(NamedTuple):
    """The preparation and the motion of a move."""

    pulses: tuple[int, ...]
    pose: Pose
    place: FingerPlace
    points: ways.Points
    """Number of the stored path that is asked for."""
    own_path: int
    """The path that the gateway keeps for its lines."""


class Course(NamedTuple):
    """By how many pulses each axis turns, and along which path."""

    turned: tuple[int, ...]
    path: WayPath | None = None
    """The path of the finger; None where each axis turns alone."""

    @property
    def length_um(self) -> float | None:
        """The length of the path in micrometres; None without one."""
        return None if self.path is None else self.path.length

    @property
    def sharpest_turn(self) -> float:
        """How sharply the path makes the base turn, in radians a micrometre."""
        return 0.0 if self.path is None else self.path.sharpest_turn()


class Manoeuvre(NamedTuple):
    """The commands of a move, and where it leads."""

    motion: StartInterpolation | TurnFinger | MoveToExtensionStart
    preparation: Sequence[RorzeCommand[Any]]
    course: Callable[[Mechanics, Pose], Course]


_MAX_SPEED: Final = Field(
    description="The fastest it may get; the standard speed sets still bound it. The gateway writes it to "
    "the `slow_pattern` of all axes (RAM only) before; `pattern` does not go with it."
)


class _ScaraMoveRequest(RequestModel):
    kind: ScaraMoveKind
    pattern: Pattern = None
    max_speed: Annotated[PathSpeed | None, _MAX_SPEED] = None
    validate_only: bool = Field(
        default=False, description="Only say where it would lead and what would be sent; nothing moves."
    )

    @model_validator(mode="after")
    def _has_one_speed(self) -> Self:
        return require_one_speed(self)

    @property
    def stored_path(self) -> int | None:
        """The stored path it needs."""
        return None

    @abstractmethod
    def manoeuvre(self, here: MoveStart) -> Manoeuvre:
        """The commands that it comes to from here."""

    def _to(self, here: MoveStart, end: FingerPlace) -> Manoeuvre:
        """A straight line of the finger's end, by the path that the gateway keeps for that."""
        return self._through(here, [PathPoint(x=round(end.x), y=round(end.y), radius=0)])

    def _through(self, here: MoveStart, points: Sequence[PathPoint]) -> Manoeuvre:
        prepared = PreparePath(path=here.own_path, pattern=self.pattern)
        return _along(ways.along(dict(enumerate(points))), *commands_for(here.own_path, points), prepared)


class ScaraLineRequest(
    _ScaraMoveRequest,
    json_schema_extra=example(kind="line", x={"value": 0, "unit": "mm"}, y={"value": 150, "unit": "mm"}),
):
    """Move the finger's end straight to a place; the finger keeps its direction (RC-420 manual 13.10.3)."""

    kind: Literal["line"]
    x: Distance
    y: Distance

    def manoeuvre(self, here: MoveStart) -> Manoeuvre:
        """HDS to the gateway's own path, HMS."""
        return self._to(here, FingerPlace(self.x.thousandths, self.y.thousandths, here.place.direction))


class ScaraPathRequest(_ScaraMoveRequest, json_schema_extra=example(kind="path", path=3)):
    """Move the finger's end along a stored path, or through points (RC-420 manual 13.10.5)."""

    kind: Literal["path"]
    path: Path | None = Field(None, description="Interpolation path 0-63.")
    points: list[ViaPoint] | None = Field(
        None,
        min_length=1,
        max_length=MOST_POINTS,
        description=(
            "Points instead of `path`: the finger goes through these, to the last. They are put into the "
            "path that the gateway keeps for its lines."
        ),
    )

    @model_validator(mode="after")
    def _one_way(self) -> Self:
        if (self.path is None) == (self.points is None):
            raise ValueError("give path or points")
        return self

    @property
    def stored_path(self) -> int | None:
        """The path itself, if it is stored."""
        return self.path

    def manoeuvre(self, here: MoveStart) -> Manoeuvre:
        """HMS; HDS before it for points of its own."""
        if self.path is None:
            return self._through(here, [point.point() for point in self.points or ()])
        return _along(ways.along(here.points), PreparePath(path=self.path, pattern=self.pattern))


class ScaraOffsetRequest(
    _ScaraMoveRequest, json_schema_extra=example(kind="offset", x={"value": 10, "unit": "mm"})
):
    """Move the finger's end straight by an amount in X, in Y or in both."""

    kind: Literal["offset"]
    x: Distance | None = None
    y: Distance | None = None

    @model_validator(mode="after")
    def _has_a_direction(self) -> Self:
        if self.x is None and self.y is None:
            raise ValueError("give x, y or both")
        return self

    def manoeuvre(self, here: MoveStart) -> Manoeuvre:
        """HXS or HYS; a line for both."""
        if self.y is None and self.x is not None:
            row = PrepareMoveAlongX(distance=self.x.thousandths, pattern=self.pattern)
            return _along(ways.by(self.x.thousandths), row)
        if self.x is None and self.y is not None:
            row_y = PrepareMoveAlongY(distance=self.y.thousandths, pattern=self.pattern)
            return _along(ways.by(1j * self.y.thousandths), row_y)
        x, y = (0 if length is None else length.thousandths for length in (self.x, self.y))
        return self._to(here, here.place._replace(x=here.place.x + x, y=here.place.y + y))


class _AlongArm(_ScaraMoveRequest):
    distance: Distance

    @model_validator(mode="after")
    def _goes_ahead(self) -> Self:
        if self.distance.thousandths <= 0:
            raise ValueError("distance must be greater than 0 um")
        return self


class ScaraExtendRequest(
    _AlongArm, json_schema_extra=example(kind="extend", distance={"value": 10, "unit": "mm"})
):
    """Extend the arm along its axis."""

    kind: Literal["extend"]

    def manoeuvre(self, _: MoveStart) -> Manoeuvre:
        """H+S."""
        distance = self.distance.thousandths
        return _along(ways.out(distance), PrepareArmExtension(distance=distance, pattern=self.pattern))


class ScaraRetractRequest(
    _AlongArm, json_schema_extra=example(kind="retract", distance={"value": 10, "unit": "mm"})
):
    """Retract the arm along its axis."""

    kind: Literal["retract"]

    def manoeuvre(self, _: MoveStart) -> Manoeuvre:
        """H-S."""
        distance = self.distance.thousandths
        return _along(ways.out(-distance), PrepareArmRetraction(distance=distance, pattern=self.pattern))


class ScaraRotateRequest(
    _ScaraMoveRequest,
    json_schema_extra=example(
        kind="rotate", radius={"value": 150, "unit": "mm"}, angle={"value": 90, "unit": "deg"}
    ),
):
    """Turn the finger to a direction about a point on its line, the arm following (three axes)."""

    kind: Literal["rotate"]
    radius: Distance = Field(description="Distance from the third joint to the centre of the turn.")
    angle: Angle = Field(description="Angle between finger and X axis at the end.")

    def manoeuvre(self, _: MoveStart) -> Manoeuvre:
        """HRS."""
        radius, angle = self.radius.thousandths, self.angle.thousandths
        row = PrepareFingerRotation(radius=radius, angle=angle, pattern=self.pattern)
        return _along(ways.about(radius, angle), row)


class _AxesAlone(_ScaraMoveRequest):
    max_speed: Annotated[TurnSpeed | None, _MAX_SPEED] = None  # type: ignore[assignment]  # axes turn alone


class ScaraFingerRequest(
    _AxesAlone, json_schema_extra=example(kind="finger", angle={"value": 90, "unit": "deg"})
):
    """Turn the finger alone to a direction, at a speed in pulses per second (three axes)."""

    kind: Literal["finger"]
    angle: Angle = Field(description="Angle between finger and X axis at the end.")

    def manoeuvre(self, _: MoveStart) -> Manoeuvre:
        """HFM."""
        angle = self.angle.thousandths
        motion = TurnFinger(angle=angle, pattern=self.pattern)
        return Manoeuvre(
            motion, (), lambda robot, pose: _each_alone(robot, ways.finger_turns(robot, pose, angle))
        )


class ScaraAlignRequest(
    _AxesAlone,
    json_schema_extra=example(kind="align", x={"value": 0, "unit": "mm"}, y={"value": 400, "unit": "mm"}),
):
    """Turn base and finger to the line of a place, or of the end of a stored path (RC-420 manual 13.10.6).

    From there an extension ends there, through the centre if need be. At a speed in pulses per second.
    """

    kind: Literal["align"]
    x: Distance | None = None
    y: Distance | None = None
    path: Path | None = Field(None, description="Interpolation path 0-63, in the place of x and y.")

    @model_validator(mode="after")
    def _one_place(self) -> Self:
        given = (self.x is None, self.y is None, self.path is None)
        if given not in ((False, False, True), (True, True, False)):
            raise ValueError("give x and y, or path")
        return self

    @property
    def stored_path(self) -> int | None:
        """The path, if it is asked for."""
        return self.path

    def manoeuvre(self, here: MoveStart) -> Manoeuvre:
        """HNM."""
        x, y = (None if length is None else length.thousandths for length in (self.x, self.y))
        motion = MoveToExtensionStart(x=x, y=y, path=self.path, pattern=self.pattern)

        def course(robot: Mechanics, pose: Pose) -> Course:
            target = ways.end_of(here.points) if x is None or y is None else complex(x, y)
            return _each_alone(robot, ways.turns_towards(robot, pose, target))

        return Manoeuvre(motion, (), course)


ScaraMoveRequest = Annotated[
    ScaraLineRequest
    | ScaraPathRequest
    | ScaraOffsetRequest
    | ScaraExtendRequest
    | ScaraRetractRequest
    | ScaraRotateRequest
    | ScaraFingerRequest
    | ScaraAlignRequest,
    Field(discriminator="kind"),
]


def _along(way: ways.Way, *preparation: RorzeCommand[Any]) -> Manoeuvre:
    def course(robot: Mechanics, pose: Pose) -> Course:
        path = way(robot, pose)
        return Course(path.pulses(), path)

    return Manoeuvre(StartInterpolation(), preparation, course)


def _each_alone(robot: Mechanics, turns: ways.Turns) -> Course:
    pulses = (
        round(turns.get(axis, 0.0) / TURN * per_turn) for axis, per_turn in enumerate(robot.pulses_per_turn)
    )
    return Course(tuple(pulses))
