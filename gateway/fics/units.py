"""A unit of a robot: its axes, what each is counted in, where they stand and how they are."""

from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal, TypeVar

from gateway.core.errors import GatewayError, InvalidRequest
from gateway.core.lanes import Lane
from gateway.fics.downloads import download
from gateway.fics.durations import Paces
from protocols.fics.jog import StepAxis
from protocols.fics.macros import RunMacro
from protocols.fics.motor_axes import GetMotorPosition, MoveMotorsAbsolute, MoveMotorsRelative
from protocols.fics.notation import AxisSystem, Quantity
from protocols.fics.positions import DownloadPositions
from protocols.fics.row import FicsCommand
from protocols.fics.status import AxisStatus, GetAxisStatus, GetUserPosition, MotionMode

if TYPE_CHECKING:
    from gateway.fics.move_record import RobotMove
    from gateway.fics.robot import Robot

V = TypeVar("V")

Coordinates = Literal["user", "motor"]
Places = Mapping[str, float | None]

UnknownReason = Literal["not_homed", "homing", "macro", "automatic", "no_conversion", "not_known"]
"""Why a robot does not tell where an axis stands (C-HOST manual 2-9), as far as the gateway can find out."""


class RobotUnit:
    """Axes of a robot that are commanded together."""

    def __init__(
        self,
        robot: "Robot",
        number: int,
        axes: list[str],
        motor_axes: list[str],
        systems: Mapping[str, AxisSystem],
    ) -> None:
        self.robot = robot
        self.number = number
        self.axes = axes
        """Names of the user axes, in the order of coordinates."""
        self.motor_axes = motor_axes
        self.systems = systems
        """What each axis is counted in; a name that user and motor axes share is one axis."""
        self.move: RobotMove | None = None
        """The move that is not over yet."""
        self.paces: dict[Coordinates, Paces] = {}
        """How fast its axes go, as last read."""
        self.stood_still = False
        """Whether it did when it was last asked, and nothing was sent since that could move it."""

    @cached_property
    def address(self) -> str:
        """Its address that is always unique, such as `ROBOT/units/1`."""
        return f"{self.robot.id}/units/{self.number}"

    def names(self, coordinates: Coordinates) -> list[str]:
        """The names of its axes in user or in motor coordinates."""
        return self.axes if coordinates == "user" else self.motor_axes

    def converted(self, axis: str) -> bool:
        """Whether a user axis is no motor itself, but computed from motors (C-HOST manual 1-6)."""
        return axis in self.axes and axis not in self.motor_axes

    def motors_behind(self, axis: str) -> list[str]:
        """The motors that move an axis: all that are no user axes, where it is converted."""
        return [it for it in self.motor_axes if it not in self.axes] if self.converted(axis) else [axis]

    def require_axis(self, axis: str) -> None:
        """Refuse an axis that is neither a user axis nor a motor axis.

        :raises InvalidRequest: it is neither.
        """
        known = dict.fromkeys((*self.axes, *self.motor_axes))
        if axis not in known:
            raise InvalidRequest(f"axis: {self.address} has the axes {', '.join(known)}; nothing was sent.")

    def require_values(
        self,
        coordinates: Coordinates,
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

    # asking

    async def position(
        self, coordinates: Coordinates = "user", lane: Lane = Lane.READ
    ) -> dict[str, float | None]:
        """Read the position; an axis is null while its position is not known (C-HOST manual 2-9, 4-4).

        :raises GatewayError: it was not read.
        """
        return (await self.position_at(coordinates, lane))[0]

    async def position_at(
        self, coordinates: Coordinates = "user", lane: Lane = Lane.READ
    ) -> tuple[dict[str, float | None], float]:
        """Read the position as `position` does, and tell when the answer came, on the event loop's clock."""
        query = GetUserPosition() if coordinates == "user" else GetMotorPosition()
        (reply,), at = await self.robot.converse(query, self.number, lane)
        values = reply.coordinates
        names = self.names(coordinates)
        if len(values) == 1 and values[0] is None:
            values = [None] * len(names)
        return self.by_axis(names, values), at

    async def status(self, lane: Lane = Lane.READ) -> dict[str, AxisStatus]:
        """Read the status of its motor axes (C-HOST manual 2-10).

        :raises GatewayError: it was not read.
        """
        return (await self.status_at(lane))[0]

    async def status_at(self, lane: Lane = Lane.READ) -> tuple[dict[str, AxisStatus], float]:
        """Read the status as `status` does, and tell when the answer came, on the event loop's clock."""
        (reply,), at = await self.robot.converse(GetAxisStatus(), self.number, lane)
        self.stood_still = at_rest(reply.axes)
        return self.by_axis(self.motor_axes, reply.axes), at

    async def stored(self, number: int, lane: Lane = Lane.READ) -> list[float | None] | None:
        """Read a stored position; None where it is not set.

        :raises GatewayError: it was not read.
        """
        found = (await download(self, DownloadPositions(first=number, count=1), lane)).replies
        return list(found[0].coordinates) if found else None

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

    async def why_unknown(self, places: Places) -> dict[str, UnknownReason]:
        """Find out why axes without a place have none: the robot prints the same for every reason."""
        missing = [axis for axis, place in places.items() if place is None]
        if not missing:
            return {}
        try:
            motors = await self.status()
        except GatewayError:
            return dict.fromkeys(missing, "not_known")
        modes = {motor.motion_mode for motor in motors.values()}
        if MotionMode.HOMING in modes:
            return dict.fromkeys(missing, "homing")
        if MotionMode.MACRO in modes:
            ours = isinstance(self.robot.motion, RunMacro)
            return dict.fromkeys(missing, "macro" if ours else "automatic")
        homed = {axis: all(motors[it].origin_done for it in self.motors_behind(axis)) for axis in missing}
        otherwise = await self._why_homed_axes_are_unknown() if any(homed.values()) else "not_known"
        return {axis: otherwise if homed[axis] else "not_homed" for axis in missing}

    async def _why_homed_axes_are_unknown(self) -> UnknownReason:
        try:
            motors = await self.position("motor")
        except GatewayError:
            return "not_known"
        return "not_known" if None in motors.values() else "no_conversion"


def coordinates_of(unit: RobotUnit, command: FicsCommand[Any]) -> Coordinates:
    """Which coordinates a motion command speaks in; a step in those its axis belongs to."""
    if isinstance(command, StepAxis):
        return "user" if command.axis in unit.axes else "motor"
    return "motor" if isinstance(command, MoveMotorsAbsolute | MoveMotorsRelative) else "user"


def at_rest(axes: Iterable[AxisStatus]) -> bool:
    """Whether no axis moves, and nothing is under way that could move one."""
    still = (MotionMode.STANDING, MotionMode.STOPPED)
    return all(not axis.moving and axis.motion_mode in still for axis in axes)


def in_trouble(axis: AxisStatus) -> bool:
    """Whether the status of an axis tells of an error."""
    return axis.alarm or bool(axis.driver_error) or axis.motion_mode == MotionMode.STOPPED
