"""The axes of a unit: their names, what each is counted in, which motors move them; and how all are asked."""

from collections.abc import Awaitable, Callable, Iterable, Mapping, Sequence
from typing import Annotated, Any, Literal, NamedTuple, Protocol, TypeVar

from pydantic import Field
from typing_extensions import TypeAliasType

from gateway.core.errors import InvalidRequest, NotFound
from protocols.fics.jog import StepAxis
from protocols.fics.motor_axes import MoveMotorsAbsolute, MoveMotorsRelative
from protocols.fics.notation import AxisSystem, Quantity, Unit
from protocols.fics.row import FicsCommand
from protocols.fics.status import AxisStatus, MotionMode

V = TypeVar("V")

CoordinateSystem = TypeAliasType("CoordinateSystem", Literal["user", "motor"])
AxisUnits = TypeAliasType("AxisUnits", dict[str, str])
"""Units by axis: mm, pulse or degree."""
AxisValues = TypeAliasType("AxisValues", dict[str, float | None])
"""Coordinates by axis; null where one is not known."""
Places = Mapping[str, float | None]
"""The place of each axis; None while it is not known."""
Tell = Callable[[str, dict[str, Any]], object]
"""Publishes an event of a robot, by its type and its data."""

DISPLAYED = 0.01
"""The smallest amount a robot displays, in mm and degrees: an assumption. Pulses are whole."""
NOISE_DIGITS = 6
"""Decimals behind these are those of binary numbers, not of places."""


class Answering(Protocol):
    """A robot or a unit as its features ask it."""

    async def read(self, query: FicsCommand[Any], /) -> Any:
        """Send a query and give its reply.

        :raises GatewayError: it was not answered; the error says why.
        """

    async def change(self, command: FicsCommand[Any], /, *, since: int | None = None) -> Any:
        """Send a setting and give what was read back; nothing is sent if a stop came `since`.

        :raises GatewayError: it was not set, or is another afterwards; the error says which.
        """

    async def as_expected(
        self, read: Callable[[], Awaitable[V]], expects: Callable[[V], None] | None, /
    ) -> int | None:
        """Require a reading to be as expected, and count the stops before it."""


class NamedRobot(Answering, Protocol):
    """A robot as its features ask it."""

    id: str


class UnitAxes:
    """Axes of a robot that are commanded together."""

    def __init__(
        self,
        robot_id: str,
        number: int,
        axes: list[str],
        motor_axes: list[str],
        systems: Mapping[str, AxisSystem],
    ) -> None:
        self.robot_id = robot_id
        self.number = number
        self.address = f"{robot_id}/units/{number}"
        """Address that is always unique, such as `ROBOT/units/1`."""
        self.axes = axes
        """Names of the user axes, in the order of coordinates."""
        self.motor_axes = motor_axes
        self.systems = systems
        """The unit system of each axis; a name that user and motor axes share is one axis."""

    def names(self, coordinates: CoordinateSystem) -> list[str]:
        """The names of its axes in user or in motor coordinates."""
        return self.axes if coordinates == "user" else self.motor_axes

    def counted_in(self, coordinates: CoordinateSystem) -> dict[str, str]:
        """The unit of position of each axis: mm, pulse or degree."""
        return {name: self.systems[name].unit(Quantity.POSITION) for name in self.names(coordinates)}

    def converted(self, axis: str) -> bool:
        """True if a user axis is no motor itself, but computed from motors (C-HOST manual 1-6)."""
        return axis in self.axes and axis not in self.motor_axes

    def motors_behind(self, axis: str) -> list[str]:
        """The motors that move an axis: all that are no user axes, where it is converted."""
        return [axis for axis in self.motor_axes if axis not in self.axes] if self.converted(axis) else [axis]

    def coordinates_of(self, command: FicsCommand[Any]) -> CoordinateSystem:
        """The coordinates of a motion command; a step has those of its axis."""
        if isinstance(command, StepAxis):
            return "user" if command.axis in self.axes else "motor"
        return "motor" if isinstance(command, MoveMotorsAbsolute | MoveMotorsRelative) else "user"

    def by_axis(self, names: Sequence[str], values: Sequence[V]) -> dict[str, V]:
        """Give the robot's values their names.

        :raises InvalidRequest: the robot has another number of axes than the configuration says.
        """
        if len(values) != len(names):
            raise InvalidRequest(
                f"{self.address} has {len(values)} axes, {len(names)} are configured.",
                "Correct the axes of the unit in the configuration.",
            )
        return dict(zip(names, values, strict=True))

    # what requests may say

    def require_axis(self, axis: str) -> None:
        """Refuse an axis that is neither a user axis nor a motor axis.

        :raises InvalidRequest: it is neither.
        """
        known = dict.fromkeys((*self.axes, *self.motor_axes))
        if axis not in known:
            raise InvalidRequest(f"axis: {self.address} has the axes {', '.join(known)}; nothing was sent.")

    def require_values(
        self,
        coordinates: CoordinateSystem,
        values: Iterable[float | None],
        quantity: Quantity | None = Quantity.POSITION,
        called: str = "coordinates",
    ) -> None:
        """Refuse values that its axes cannot have; without a `quantity` all axes have the same unit.

        :raises InvalidRequest: there are more of them than axes, or one is a fraction of a pulse.
        """
        names, given = self.names(coordinates), list(values)
        if len(given) > len(names):
            raise InvalidRequest(
                f"{self.address} has the axes {', '.join(names)}, and {len(given)} {called} "
                "were given; nothing was sent."
            )
        for name, value in zip(names, given, strict=False):
            if value is not None and quantity is not None:
                self.require_value(name, quantity, value)

    def require_value(self, axis: str, quantity: Quantity, value: float, field: str = "") -> None:
        """Refuse a value that an axis cannot have; `field` is where the request says it.

        :raises InvalidRequest: it is a fraction of a pulse.
        """
        if not self.systems[axis].can_hold(quantity, value):
            where = field or f"Axis {axis}"
            raise InvalidRequest(f"{where}: pulses are whole, {value:g} is not; nothing was sent.")


class AskedUnit(UnitAxes, Answering):
    """The axes of a unit, and the robot's answers about them; `gateway.fics.units.RobotUnit` is one."""


class AxisDuration(NamedTuple):
    """The time that an axis takes for a distance."""

    speed: float
    """Units of position a second."""
    ramps_s: float
    """Both ramps at their longest."""

    def seconds(self, distance: float) -> float:
        """The longest time in seconds for a distance."""
        return distance / self.speed + self.ramps_s if distance else 0.0


AxisDurations = dict[str, AxisDuration]


U = TypeVar("U", bound=UnitAxes)


def unit_of(units: Sequence[U], number: int) -> U:
    """Find a unit of a robot.

    :raises NotFound: it is not configured.
    """
    for unit in units:
        if unit.number == number:
            return unit
    known = ", ".join(str(unit.number) for unit in units)
    raise NotFound(f"Robot {units[0].robot_id} has no unit {number}, but {known}; nothing was sent.")


def at_rest(axes: Iterable[AxisStatus]) -> bool:
    """True if nothing is under way that could move an axis: the first digit of ACD tells (2-10)."""
    return all(axis.motion_mode in (MotionMode.STANDING, MotionMode.STOPPED) for axis in axes)


def in_trouble(axis: AxisStatus) -> bool:
    """True if the status of an axis tells of an error."""
    return bool(axis.driver_error) or axis.motion_mode == MotionMode.STOPPED


RobotId = Annotated[str, Field(description="The robot's id in the configuration.", examples=["r1"])]
UnitNumber = Annotated[Unit, Field(description="Number of the unit, from 1.", examples=[1])]
