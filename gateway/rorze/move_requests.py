"""Moves in the words of clients: their kinds, with lengths in units, and the commands they come to."""

from typing import Annotated, Any, Final, Literal, TypeVar

from pydantic import Field, PrivateAttr, ValidationError, model_validator
from typing_extensions import TypeAliasType

from gateway.core.errors import InvalidRequest
from gateway.core.jogs import Jog
from gateway.core.move_record import StartRequest
from gateway.core.records import RequestModel, example
from gateway.rorze.bodies import Group
from gateway.rorze.plans import MaxSpeed, require_one_speed
from gateway.rorze.speed_sets import Speed
from gateway.rorze.units import Length, Scale
from protocols.rorze import moves, origin
from protocols.rorze.notation import PositionReference
from protocols.rorze.row import RorzeCommand
from protocols.rorze.stops import Accelerate, ChangeSpeed, Decelerate
from protocols.wording import expectation

Direction = TypeAliasType("Direction", Literal["cw", "ccw"])
Pattern = Annotated[
    int | None,
    Field(ge=0, le=29, description="Acceleration pattern; left out, number 30 (RC-420 manual 13.3.4)."),
]
MotionRow = type[RorzeCommand[Any]]
Row = TypeVar("Row", bound=RorzeCommand[Any])

_RELATIVE: Final[dict[tuple[Direction, Speed], type[moves.RelativeMove]]] = {
    ("cw", "high"): moves.MoveClockwise,
    ("ccw", "high"): moves.MoveCounterclockwise,
    ("cw", "low"): moves.MoveClockwiseSlowly,
    ("ccw", "low"): moves.MoveCounterclockwiseSlowly,
}
_ABSOLUTE: Final[dict[Speed, MotionRow]] = {"high": moves.MoveTo, "low": moves.MoveToSlowly}
_HOME: Final[dict[str, MotionRow]] = {
    "standard": origin.Home,
    "stall_detection": origin.HomeWithStallDetection,
    "fast_then_stop": origin.HomeFastThenStop,
    "fast_then_decelerate": origin.HomeFastThenDecelerate,
    "rc204": origin.HomeLikeRc204,
    "centre_stall_dog": origin.CentreStallDog,
}


class RelativeMoveRequest(
    StartRequest,
    json_schema_extra=example(kind="relative", direction="cw", distance={"value": 500, "unit": "pulse"}),
):
    """Move by a distance (RC-420 manual 13.2)."""

    kind: Literal["relative"]
    direction: Direction
    distance: Length
    speed: Speed = Field(default="high", description="`low` runs at the start speed, without ramps.")
    pattern: Pattern = None
    max_speed: MaxSpeed = None

    _one_speed = model_validator(mode="after")(require_one_speed)

    def command(self, scale: Scale | None) -> RorzeCommand[Any]:
        """The controller's command for it."""
        return relative_command(self.direction, self.speed, self.distance.pulses(scale), self.pattern)


class AbsoluteMoveRequest(
    StartRequest, json_schema_extra=example(kind="absolute", position={"value": 0, "unit": "pulse"})
):
    """Move to a position (RC-420 manual 13.2)."""

    kind: Literal["absolute"]
    position: Length
    speed: Speed = Field(default="high", description="`low` runs at the start speed, without ramps.")
    pattern: Pattern = None
    max_speed: MaxSpeed = None

    _one_speed = model_validator(mode="after")(require_one_speed)

    def command(self, scale: Scale | None) -> RorzeCommand[Any]:
        """The controller's command for it."""
        return _built(_ABSOLUTE[self.speed], position=self.position.pulses(scale), pattern=self.pattern)


class PositionMoveRequest(StartRequest, json_schema_extra=example(kind="position", position=5)):
    """Move to a position of the body's table (RC-420 manual 13.4)."""

    kind: Literal["position"]
    position: int = Field(ge=0, le=2047, description="Position number.")
    speed: Speed = Field(default="high", description="`low` runs at the start speed, without ramps.")
    pattern: Pattern = None
    max_speed: MaxSpeed = None

    _one_speed = model_validator(mode="after")(require_one_speed)

    def command(self, _: Scale | None) -> RorzeCommand[Any]:
        """The controller's command for it."""
        entry = PositionReference(position=self.position)
        return _built(_ABSOLUTE[self.speed], position=entry, pattern=self.pattern)


HomeMethod = TypeAliasType(
    "HomeMethod",
    Literal[
        "standard", "stall_detection", "fast_then_stop", "fast_then_decelerate", "rc204", "centre_stall_dog"
    ],
)


class HomeRequest(StartRequest, json_schema_extra=example(kind="home")):
    """Search the origin (RC-420 manual 13.5), or the centre of the stall dog after that (13.6.2)."""

    kind: Literal["home"]
    method: HomeMethod = Field(
        default="standard",
        description="Commands 00M, 01M, 02M, 03M, 04M and 0QM, in this order. 0QM goes to the nearest dog, "
        "and makes no body `homed`.",
    )

    def command(self, _: Scale | None) -> RorzeCommand[Any]:
        """The controller's command for it."""
        return _HOME[self.method]()


class ContinuousMoveRequest(
    StartRequest, json_schema_extra=example(kind="continuous", direction="cw", speed="low")
):
    """Move until stopped; only where the configuration has `allow_endless_moves`."""

    kind: Literal["continuous"]
    direction: Direction
    speed: Speed = Field(default="high", description="`low` runs at the start speed, without ramps.")
    pattern: Pattern = None

    def command(self, _: Scale | None) -> RorzeCommand[Any]:
        """The controller's command for it."""
        return relative_command(self.direction, self.speed, "endless", self.pattern)


MoveRequest = Annotated[
    RelativeMoveRequest | AbsoluteMoveRequest | PositionMoveRequest | HomeRequest | ContinuousMoveRequest,
    Field(discriminator="kind"),
]


def relative_command(
    direction: Direction, speed: Speed, distance: int | Literal["endless"], pattern: int | None
) -> moves.RelativeMove:
    """The command that moves by a distance.

    :raises InvalidRequest: the controller takes no such distance.
    """
    return _built(_RELATIVE[direction, speed], distance=distance, pattern=pattern)


def _built(row: type[Row], **parameters: object) -> Row:
    try:
        return row(**parameters)
    except ValidationError as error:
        fault = error.errors()[0]
        raise InvalidRequest(
            f"{fault['loc'][0]} comes to {parameters[str(fault['loc'][0])]}: {expectation(fault)}; "
            "nothing was sent."
        ) from None


def common_command(group: Group, move: MoveRequest) -> RorzeCommand[Any]:
    """The one command that moves all members of a group.

    :raises InvalidRequest: their scales ask for different ones.
    """
    first, *others = [move.command(member.scale) for member in group.members]
    if any(command != first for command in others):
        raise InvalidRequest(
            f"The members of {group.address} have different scales, but get one command; nothing was sent.",
            "Give pulses.",
        )
    return first


_TURNS: Final[dict[str, Direction]] = {"+": "cw", "-": "ccw", "cw": "cw", "ccw": "ccw"}


class BodyJogRequest(RequestModel, json_schema_extra=example(direction="cw")):
    """The direction of a jog, its speed and its longest way."""

    direction: Literal["cw", "ccw", "+", "-"] = Field(description="+ is cw, - is ccw.")
    speed: Speed = Field(default="low", description="`low` runs at the start speed, without ramps.")
    pattern: Pattern = None
    max_speed: MaxSpeed = None
    at_most: Length | None = Field(
        default=None,
        description="The jog ends after this distance; never further than 10 s take at its top speed, nor "
        "beyond the soft limits.",
    )

    _one_speed = model_validator(mode="after")(require_one_speed)

    @property
    def turn(self) -> Direction:
        """The direction in the words of moves."""
        return _TURNS[self.direction]


class BodyJog(Jog):
    """A body that jogs, or has jogged."""

    id: str = Field(description="Id of the jog, and of the move it makes.")
    body_id: str
    direction: Direction
    speed: Speed
    distance: int = Field(description="Longest way in pulses; encoder counts in encoder mode.")
    _bound: str = PrivateAttr("")
    """Name of the limit at which the jog ends if it comes that far."""


class SpeedIncrease(RequestModel, json_schema_extra=example(mode="accelerate")):
    """Accelerate to the maximum speed: command 5AS."""

    mode: Literal["accelerate"]

    def command(self) -> RorzeCommand[Any]:
        """The controller's command for it."""
        return Accelerate()


class SpeedDecrease(RequestModel, json_schema_extra=example(mode="decelerate")):
    """Decelerate to the start speed: command 5DS."""

    mode: Literal["decelerate"]

    def command(self) -> RorzeCommand[Any]:
        """The controller's command for it."""
        return Decelerate()


class SpeedSetting(RequestModel, json_schema_extra=example(mode="change", speed=20_000)):
    """Change to a speed: command 5CS."""

    mode: Literal["change"]
    speed: int = Field(ge=1, le=1_000_000, description="Speed in pulses per second.")

    def command(self) -> RorzeCommand[Any]:
        """The controller's command for it."""
        return ChangeSpeed(speed=self.speed)


SpeedRequest = Annotated[SpeedIncrease | SpeedDecrease | SpeedSetting, Field(discriminator="mode")]
