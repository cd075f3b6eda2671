"""A unit of a robot: where its axes stand, how they are, and what it is asked and told."""

from collections.abc import Awaitable, Callable
from typing import Any, Literal, TypeVar

from gateway.core.errors import GatewayError
from gateway.core.lanes import Lane
from gateway.core.trajectories import Trajectory
from gateway.fics.asking import Asking
from gateway.fics.axes import Coordinates, Places, UnitAxes, at_rest
from gateway.fics.downloads import download
from gateway.fics.motion_state import MotionState
from gateway.fics.move_record import RobotMove
from gateway.fics.questions import POSITIONS, SENSORS, STATUS
from protocols.fics.macros import RunMacro
from protocols.fics.positions import DownloadPositions
from protocols.fics.row import FicsCommand
from protocols.fics.status import AxisSensors, AxisStatus, MotionMode

T = TypeVar("T")
UnknownReason = Literal["not_homed", "homing", "macro", "automatic", "no_conversion", "not_known"]
"""Why a robot does not tell where an axis stands (C-HOST manual 2-9), as far as the gateway can find out."""


class RobotUnit(UnitAxes):
    """The axes of a unit, and the robot's answers about them."""

    def __init__(self, axes: UnitAxes, asking: Asking, motion: MotionState) -> None:
        super().__init__(axes.robot_id, axes.number, axes.axes, axes.motor_axes, axes.systems)
        self._asking = asking
        self._motion = motion
        self.trajectory: Trajectory[Places] | None = None
        """Where it is seen during the move that is not over yet."""

    @property
    def move(self) -> RobotMove | None:
        """The move that is not over yet."""
        return self._motion.moves.get(self.number)

    @property
    def settings_changed(self) -> int:
        """How often a setting of the robot may have changed."""
        return self._asking.settings_changed

    @property
    def stood_still(self) -> bool:
        """Whether it did when it was last asked, and nothing was sent since that could move it."""
        return self.number in self._motion.still

    def frame_of(self, command: FicsCommand[Any]) -> str:
        """Show the exact frame of a command as text, with its terminator escaped."""
        return self._asking.line.frame_of(command)

    async def read(self, query: FicsCommand[Any], lane: Lane = Lane.READ) -> Any:
        """Send a query and give its reply; errors as of `Asking.ask`."""
        return (await self._asking.ask(query, self.number, lane)).replies[0]

    async def change(self, command: FicsCommand[Any], since: int | None = None) -> Any:
        """Send a setting and give what was read back; errors as of `Asking.change`."""
        return await self._asking.change(command, self.number, since=since)

    async def as_expected(
        self, read: Callable[[], Awaitable[T]], expects: Callable[[T], None] | None
    ) -> int | None:
        """How much was said when what can be read was as expected; errors as of `Asking.as_expected`."""
        return await self._asking.as_expected(read, expects)

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
        (reply,), at, _ = await self._asking.ask(POSITIONS[coordinates], self.number, lane)
        values = reply.coordinates
        names = self.names(coordinates)
        if len(values) == 1 and values[0] is None:
            values = [None] * len(names)
        places = self.by_axis(names, values)
        if self.trajectory is not None and self.move is not None and self.move.coordinates == coordinates:
            self.trajectory.add(at, places)
        return places, at

    async def status(self, lane: Lane = Lane.READ) -> dict[str, AxisStatus]:
        """Read the status of its motor axes (C-HOST manual 2-10).

        :raises GatewayError: it was not read.
        """
        return (await self.status_at(lane))[0]

    async def status_at(self, lane: Lane = Lane.READ) -> tuple[dict[str, AxisStatus], float]:
        """Read the status as `status` does, and tell when the answer came, on the event loop's clock."""
        (reply,), at, _ = await self._asking.ask(STATUS, self.number, lane)
        self._motion.note_rest(self.number, still=at_rest(reply.axes))
        return self.by_axis(self.motor_axes, reply.axes), at

    async def sensors(self) -> dict[str, AxisSensors]:
        """Read the sensors of its motor axes (C-HOST manual 2-11).

        :raises GatewayError: it was not read.
        """
        return self.by_axis(self.motor_axes, (await self.read(SENSORS)).axes)

    async def stored(self, number: int, lane: Lane = Lane.READ) -> list[float | None] | None:
        """Read a stored position; None where it is not set.

        :raises GatewayError: it was not read.
        """
        wanted = DownloadPositions(first=number, count=1)
        found = (await download(self._asking, self, wanted, lane)).replies
        return list(found[0].coordinates) if found else None

    async def why_unknown(self, places: Places) -> dict[str, UnknownReason]:
        """Find out why axes without a place have none: the robot prints the same for every reason."""
        missing = [axis for axis, place in places.items() if place is None]
        if not missing:
            return {}
        try:
            motors = await self.status()
            at = await self.position("motor")
        except GatewayError:
            return dict.fromkeys(missing, "not_known")
        modes = {motor.motion_mode for motor in motors.values()}
        if MotionMode.HOMING in modes:
            return dict.fromkeys(missing, "homing")
        if MotionMode.MACRO in modes:
            ours = isinstance(self._motion.command, RunMacro)
            return dict.fromkeys(missing, "macro" if ours else "automatic")
        return {axis: self._why(axis, at) for axis in missing}

    def _why(self, axis: str, at: Places) -> UnknownReason:
        """Why an axis has no place: its motors have theirs if they are homed and answer (2-9, 4-4)."""
        unknown = [motor for motor in self.motors_behind(axis) if at[motor] is None]
        if not unknown:
            return "no_conversion"
        silent = all(self._asking.is_silent(self.number, motor) for motor in unknown)
        return "not_known" if silent else "not_homed"
