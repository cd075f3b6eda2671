"""How fast a move with a pattern would be at each moment, with the settings of now (RC-420 manual 13.3)."""

from typing import Annotated, Final, NamedTuple

from pydantic import Field

from gateway.core.errors import InvalidRequest
from gateway.core.operation import Rows
from gateway.core.records import Record, RequestModel, example
from gateway.core.rights import Right
from gateway.rorze.asked_body import AskedBody, pulses_per_count
from gateway.rorze.patterns import Changes, PatternNumber, read_pattern
from gateway.rorze.speed_sets import Speed, SpeedSetValues, parameters_of
from gateway.rorze.units import Length, LengthUnit, Scale, Scaled, to_pulses
from protocols.rorze.notation import BILLION
from protocols.rorze.profile import Profile, ProfileError, SpeedChange, SpeedParameters, plan, plan_slow

ROWS: Final = Rows("body settings")
Distance = Annotated[float, Field(gt=0, lt=1e9, allow_inf_nan=False, description="Distance of the move.")]
CurveUnit = Annotated[LengthUnit, Field(description="Unit of the distance; pulses are whole.")]
CurveSpeed = Annotated[Speed, Field(description="`low` runs at the start speed, without ramps.")]
Points = Annotated[int, Field(ge=2, le=2_000, description="Number of moments, evenly spread.")]


class CurvePoint(Record):
    """A moment of the move, in the pulses that are put out."""

    time_s: float = Field(description="Seconds since the first pulse.")
    position: float = Field(description="Pulses since the start.")
    speed: float = Field(description="Pulses per second.")
    acceleration: float = Field(description="Pulses per second, per second; below 0 while it slows down.")
    position_in_unit: float | None = Field(description="Position in the body's unit; null without a scale.")
    speed_in_unit: float | None
    acceleration_in_unit: float | None


class SpeedCurve(Record):
    """The speed of a move from its first pulse to its last."""

    body_id: str
    pattern: int
    distance: int = Field(description="Distance in pulses; in encoder mode in encoder counts.")
    pulses: int = Field(description="Number of pulses that are put out.")
    distance_in_unit: Scaled | None
    unit: str | None = Field(description="The body's; null without a scale.")
    total_time_s: float
    top_speed: float = Field(description="The highest speed it comes to, in pulses per second.")
    points: list[CurvePoint] = Field(
        description="Evenly spread, and each moment in which a part of the curve begins."
    )


class CurveDraft(
    RequestModel,
    json_schema_extra=example(
        acceleration={
            "start_speed_pps": 5_000,
            "maximum_speed_pps": 50_000,
            "acceleration_pps_s": 100_000,
            "rising_percent": 50,
            "falling_percent": 50,
        },
        distance={"value": 10_000, "unit": "pulse"},
    ),
):
    """A move with a pattern that no body has yet."""

    acceleration: SpeedSetValues
    deceleration: SpeedSetValues | None = Field(
        default=None, description="Deceleration; left out: as the acceleration."
    )
    changes: Changes = Field(default_factory=list)
    distance: Length = Field(description="Distance of the move.")
    speed: Speed = Field(default="high", description="`low` runs at the start speed, without ramps.")
    points: int = Field(default=200, ge=2, le=2_000, description="Number of moments, evenly spread.")

    def course(self) -> "_Course":
        """As the speed curve takes it.

        :raises ProfileError: its values do not go together.
        """
        up = self.acceleration.parameters()
        down = up if self.deceleration is None else self.deceleration.parameters()
        return _Course(up, down, [change.planned() for change in self.changes])


class _Course(NamedTuple):
    """The parts of a speed curve."""

    up: SpeedParameters
    down: SpeedParameters
    changes: list[SpeedChange]


class _Units(NamedTuple):
    """How pulses that are put out come to the body's unit."""

    scale: Scale | None
    ratio: float
    """Pulses put out for one of what the body counts."""

    def of(self, pulses: float) -> float | None:
        return None if self.scale is None else self.scale.value(pulses / self.ratio)


async def curve_of(
    body: AskedBody,
    number: int,
    distance: int,
    speed: Speed,
    points: int,
    draft: CurveDraft | None = None,
) -> SpeedCurve:
    """Calculate a move of `distance` pulses or encoder counts by a pattern or its draft; it only reads.

    :raises InvalidRequest: there is no such move: it would be refused, or the pattern is not set.
    :raises GatewayError: the settings were not read.
    """
    if not 1 <= distance < BILLION:
        raise InvalidRequest(
            f"distance comes to {distance}, and must be 1 to {BILLION - 1}; nothing was sent."
        )
    ratio = await pulses_per_count(body)
    try:
        course = await _course(body, number) if draft is None else draft.course()
        profile = (plan_slow if speed == "low" else plan)(round(distance * ratio), *course)
    except ProfileError as error:
        raise InvalidRequest(f"A move with pattern {number} would be refused: {error}") from None
    return _curve(body, number, distance, profile, _Units(body.scale, ratio), points)


async def _course(body: AskedBody, number: int) -> _Course:
    pattern = await read_pattern(body, number)
    if pattern.acceleration_set is None or pattern.deceleration_set is None:
        raise InvalidRequest(
            f"Pattern {number} of {body.address} was never set; nothing was changed.",
            f"Set it by PUT .../patterns/{number}, or try it out by POST .../patterns/{number}/curve.",
        )
    up = await parameters_of(body, pattern.acceleration_set)
    same = pattern.deceleration_set == pattern.acceleration_set
    down = up if same else await parameters_of(body, pattern.deceleration_set)
    if pattern.changes is None:
        raise InvalidRequest(
            f"The speed changes of pattern {number} of {body.address} do not suit its speed sets."
        )
    return _Course(up, down, [SpeedChange("F", change.begin, change.speed_pps) for change in pattern.changes])


def _curve(
    body: AskedBody, number: int, distance: int, profile: Profile, units: _Units, points: int
) -> SpeedCurve:
    end_s = profile.duration_s or 0.0
    even = (end_s * index / (points - 1) for index in range(points))
    moments = sorted({*even, *(phase.start_s for phase in profile.curve.phases if phase.start_s < end_s)})
    rows = [_point(profile, at_s, units) for at_s in moments]
    return SpeedCurve(
        body_id=body.address,
        pattern=number,
        distance=distance,
        pulses=profile.distance or 0,
        distance_in_unit=Scaled.of(distance, body.scale),
        unit=None if body.scale is None else body.scale.unit,
        total_time_s=end_s,
        top_speed=max(row.speed for row in rows),
        points=rows,
    )


def _point(profile: Profile, at_s: float, units: _Units) -> CurvePoint:
    """The state at a moment; at the last one as it arrives, not as it stands."""
    phase = profile.curve.at(at_s)
    numbers = {"position": profile.position(at_s), "speed": phase.speed, "acceleration": phase.acceleration}
    in_unit = {f"{name}_in_unit": units.of(number) for name, number in numbers.items()}
    return CurvePoint(time_s=at_s, **numbers, **in_unit)


@ROWS.get("/bodies/{body_id}/patterns/{n}/curve")
async def get_curve(
    body: AskedBody,
    n: PatternNumber,
    *,
    distance: Distance,
    unit: CurveUnit = "pulse",
    speed: CurveSpeed = "high",
    points: Points = 200,
) -> SpeedCurve:
    """Work out how a move with this pattern would go, with the settings of now; nothing moves."""
    return await curve_of(body, n, to_pulses(distance, unit, body.scale), speed, points)


@ROWS.post("/bodies/{body_id}/patterns/{n}/curve", Right.VIEW)
async def draft_curve(body: AskedBody, n: PatternNumber, draft: CurveDraft) -> SpeedCurve:
    """Work out how a move would go if the pattern were this one; nothing is set, and nothing moves."""
    return await curve_of(body, n, draft.distance.pulses(body.scale), draft.speed, draft.points, draft)
