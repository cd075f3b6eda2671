"""A robot and its units as they are asked and told: where axes stand, how they are, and what is stored."""

from collections.abc import Awaitable, Callable, Sequence
from itertools import pairwise
from typing import Any, Literal, TypeVar

from typing_extensions import TypeAliasType

from gateway.core.errors import ControllerRefused, GarbledReply, GatewayError, InvalidRequest
from gateway.core.events import Data, Event
from gateway.core.exchange import Lane
from gateway.core.move_log import Trajectory
from gateway.fics.axes import AskedUnit, CoordinateSystem, Places, UnitAxes, at_rest, unit_of
from gateway.fics.bits import Bits
from gateway.fics.conversation import Answers, Conversation, answered_now, deadline_of
from gateway.fics.errors import HOME_FIRST, NotDone, NotHomed, PositionUnknown, RobotBusy
from gateway.fics.exchange import POSITIONS, SENSORS, STATUS
from gateway.fics.knowledge import Knowledge
from gateway.fics.line import FicsLine
from gateway.fics.move_record import RobotMove
from gateway.fics.system_errors import RobotErrorRecord
from protocols.fics.macros import RunMacro
from protocols.fics.positions import LAST_POSITION, DownloadPositions, StoredPosition
from protocols.fics.row import FicsCommand
from protocols.fics.status import AxisSensors, AxisStatus, MotionMode
from protocols.fics.system import GetCommunicationMode, SetCommunicationMode

PART = 16
"""Positions that are asked for at once: until all have come nothing else is answered, no proof of a stop."""
TRIES = 3
"""The most attempts at a part until the count of its answers is right."""
NOT_SET = "E09"
"""A possible answer where the first number is not set (C-HOST manual 2-12), instead of POE alone."""

Publish = Callable[[str, str, Data, str | None], Event]
"""Type, subject, data and correlation of an event."""

T = TypeVar("T")
UnknownReason = TypeAliasType(
    "UnknownReason", Literal["not_homed", "homing", "macro", "automatic", "no_conversion", "not_known"]
)
"""Why a robot does not tell where an axis stands (C-HOST manual 2-9), as far as the gateway can find out."""
_WHY: dict[UnknownReason, str] = {
    "not_homed": "it is not homed",
    "homing": "the robot is homing",
    "macro": "a macro is running",
    "automatic": "the robot is in automatic operation",
    "no_conversion": "its motors stand where no user coordinates exist",
    "not_known": "the robot does not say why",
}


class RobotUnit(AskedUnit):
    """The axes of a unit, and the robot's answers about them."""

    def __init__(self, axes: UnitAxes, conversation: Conversation) -> None:
        super().__init__(axes.robot_id, axes.number, axes.axes, axes.motor_axes, axes.systems)
        self._conversation = conversation
        self.known = conversation.known
        """All that is known of the robot."""
        self.move: RobotMove | None = None
        """The move that is not over yet."""
        self.trajectory: Trajectory[Places] | None = None
        """Samples of the move that is under way."""

    def claim(self, move: RobotMove) -> None:
        """Let no other move of the robot begin."""
        self.move = move
        self.known.motion.idle.clear()

    def release(self) -> None:
        """Let another move begin."""
        self.move = self.trajectory = None
        self.known.motion.idle.set()

    @property
    def stood_still(self) -> bool:
        """True if it stood still when it was last asked, and nothing was sent since that could move it."""
        return self.number in self.known.motion.still

    def frame_of(self, command: FicsCommand[Any]) -> str:
        """Show the exact frame of a command as text, with its terminator escaped."""
        return self._conversation.line.frame_of(command)

    async def read(self, query: FicsCommand[Any], lane: Lane = Lane.READ) -> Any:
        """Send a query and give its reply; errors as of `Conversation.ask`."""
        return (await self._conversation.ask(query, self.number, lane)).replies[0]

    async def change(self, command: FicsCommand[Any], *, since: int | None = None) -> Any:
        """Send a setting and give what was read back; errors as of `Conversation.change`."""
        return await self._conversation.change(command, self.number, since=since)

    async def as_expected(
        self, read: Callable[[], Awaitable[T]], expects: Callable[[T], None] | None
    ) -> int | None:
        """Require a reading to be as expected; result and errors as of `Conversation.as_expected`."""
        return await self._conversation.as_expected(read, expects)

    async def position(
        self, coordinates: CoordinateSystem = "user", lane: Lane = Lane.READ
    ) -> dict[str, float | None]:
        """Read the position; an axis is null while its position is not known (C-HOST manual 2-9, 4-4).

        :raises GatewayError: it was not read.
        """
        return (await self.position_at(coordinates, lane))[0]

    async def position_at(
        self, coordinates: CoordinateSystem = "user", lane: Lane = Lane.READ
    ) -> tuple[dict[str, float | None], float]:
        """Read the position as `position` does, and tell when the answer came, on the event loop's clock."""
        (reply,), at, _ = await self._conversation.ask(POSITIONS[coordinates], self.number, lane)
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
        (reply,), at, _ = await self._conversation.ask(STATUS, self.number, lane)
        self.known.motion.note_rest(self.number, still=at_rest(reply.axes))
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
        found = (await self.download(DownloadPositions(first=number, count=1), lane)).replies
        return list(found[0].coordinates) if found else None

    async def positions(
        self, first: int = 1, last: int = LAST_POSITION
    ) -> list[tuple[int, list[float | None]]]:
        """Read the stored positions in turn; errors as of `download`."""
        if not 1 <= first <= last <= LAST_POSITION:
            raise InvalidRequest(f"Positions go from 1 to {LAST_POSITION}; nothing was sent.")
        replies = (await self.download(DownloadPositions(first=first, count=last - first + 1))).replies
        found = [list(reply.coordinates) for reply in replies if isinstance(reply, StoredPosition)]
        return list(enumerate(found, first))

    async def download(self, wanted: DownloadPositions, lane: Lane = Lane.READ) -> Answers:
        """Read stored positions in turn, up to the first number that is not set (C-HOST manual 2-19).

        That a robot ends there, even with more positions behind it, is an assumption.

        :raises RobotBusy: a stop has come before all were read.
        :raises GarbledReply: answers were lost or doubled again and again.
        :raises GatewayError: they were not read; the error says why.
        """
        line = self._conversation.line
        epoch = line.stop_epoch
        first = wanted.first or 1
        last = min(first + (wanted.count or LAST_POSITION) - 1, LAST_POSITION)
        parts: list[Answers] = []
        while first <= last:
            if line.stop_epoch != epoch:
                raise RobotBusy(
                    f"A stop of {self.robot_id} came first: not all of its positions were read.",
                    "Read them again.",
                )
            count = min(PART, last - first + 1)
            parts.append(await self._part(first, count, lane))
            if len(parts[-1].replies) < count:
                break
            first += count
        replies = tuple(reply for part in parts for reply in part.replies)
        return Answers(replies, parts[0].at, tuple(text for part in parts for text in part.texts))

    async def _part(self, first: int, count: int, lane: Lane) -> Answers:
        """Read a part; fewer than `count` positions only where the table ends.

        A robot sends positions without their numbers, so the answers of a part are counted.
        """
        for _ in range(TRIES):
            told = await self._read_part(first, count, lane)
            if (
                _is_doubtful(told, count)
                and (await self._read_part(first, count, lane)).replies != told.replies
            ):
                continue
            found = len(told.replies)
            if found == count or (found < count and await self._ends_after(first, found, lane)):
                return told
        raise GarbledReply(
            f"Of the positions of {self.address} from {first} on some answers were lost or doubled, so "
            "nobody knows their numbers.",
            "Ask again.",
            DownloadPositions(first=first, count=count),
        )

    async def _ends_after(self, first: int, found: int, lane: Lane) -> bool:
        """True if the table ends after the positions that were found: the last is set, the next is not."""
        return not found or len((await self._read_part(first + found - 1, 2, lane)).replies) == 1

    async def _read_part(self, first: int, count: int, lane: Lane) -> Answers:
        try:
            return await self._conversation.ask(
                DownloadPositions(first=first, count=count), self.number, lane
            )
        except ControllerRefused as refused:
            if refused.error_code != NOT_SET:
                raise
            return answered_now()

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
            ours = isinstance(self.known.motion.command, RunMacro)
            return dict.fromkeys(missing, "macro" if ours else "automatic")
        return {axis: self._why(axis, at) for axis in missing}

    async def require_places(self, places: Places, command: FicsCommand[Any]) -> None:
        """Refuse a command that needs to know where axes stand.

        :raises NotHomed: an axis is not homed.
        :raises PositionUnknown: it is not known for another reason.
        """
        missing: Places = {name: None for name, place in places.items() if place is None}
        if not missing:
            return
        reasons = await self.why_unknown(missing)
        axis, reason = next(iter(reasons.items()))
        detail = (
            f"The position of axis {axis} of {self.address} is not known, for {_WHY[reason]}; "
            f"{command.wire_name()} was not sent."
        )
        if reason == "not_homed":
            raise NotHomed(detail, HOME_FIRST)
        raise PositionUnknown(detail, "Read the status of the unit and the errors of the robot.")

    def _why(self, axis: str, at: Places) -> UnknownReason:
        """Why an axis has no place: its motors have theirs if they are homed and answer (2-9, 4-4)."""
        unknown = [motor for motor in self.motors_behind(axis) if at[motor] is None]
        if not unknown:
            return "no_conversion"
        silent = all(self.known.error.is_silent(self.number, motor) for motor in unknown)
        return "not_known" if silent else "not_homed"


class AskedRobot:
    """A robot as far as it is asked and told, behind a line of its own; its motion is that of `Robot`."""

    def __init__(
        self,
        robot_id: str,
        name: str,
        line: FicsLine,
        units: Sequence[UnitAxes],
        publish: Publish,
        bits: Bits | None = None,
    ) -> None:
        self.id = robot_id
        self.name = name
        self.line = line
        self._publish = publish
        self.known = Knowledge(robot_id, line, units, self.publish, bits)
        self.conversation = Conversation(robot_id, line, self.known)
        self.units = [RobotUnit(axes, self.conversation) for axes in units]

    @property
    def online(self) -> bool:
        """True if it can be asked now, as far as is known."""
        return self.line.online

    @property
    def mode(self) -> int:
        """Its communication mode (C-HOST manual 1-1-1)."""
        return self.line.mode

    @property
    def moving(self) -> bool | None:
        """True if it moves, as far as is known; None where it was not looked at since it was out of reach."""
        return self.known.motion.moving

    @property
    def power_cycled(self) -> bool:
        """True while it has lost its power and the loss is not acknowledged."""
        return self.known.power.cycled

    @property
    def latched_error(self) -> RobotErrorRecord | None:
        """The error of the system that stands, as far as is known."""
        return self.known.error.latched

    def unit(self, number: int) -> RobotUnit:
        """Find a unit.

        :raises NotFound: it is not configured.
        """
        return unit_of(self.units, number)

    async def read(self, query: FicsCommand[Any], unit: int | None = None) -> Any:
        """Send a query and give its reply; errors as of `Conversation.ask`."""
        return (await self.conversation.ask(query, unit)).replies[0]

    async def change(
        self, command: FicsCommand[Any], unit: int | None = None, *, since: int | None = None
    ) -> Any:
        """Send a setting and give what was read back; errors as of `Conversation.change`."""
        return await self.conversation.change(command, unit, since=since)

    async def as_expected(
        self, read: Callable[[], Awaitable[T]], expects: Callable[[T], None] | None
    ) -> int | None:
        """Require a reading to be as expected; result and errors as of `Conversation.as_expected`."""
        return await self.conversation.as_expected(read, expects)

    async def change_mode(self, mode: int) -> None:
        """Bring the robot into another mode until the gateway ends (C-HOST manual 1-1-1, 2-37).

        :raises RobotBusy: it moves, or a stop is not confirmed; nothing was sent.
        :raises NotDone: it is in another mode, and is still to be brought into this one.
        :raises GatewayError: it is not known yet, and tried again; the error says why.
        """
        command = SetCommunicationMode(mode=mode)
        self.line.require_fit()
        async with self.line.sequence_lock.held(Lane.COMMAND, deadline_of(Lane.COMMAND)):
            self.known.motion.require_still(command)
            if self.line.mode != mode:
                self.line.change_mode(mode)
        found = (await self.read(GetCommunicationMode())).mode
        if found != mode:
            raise NotDone(f"{self.id} is in mode {found}, not in mode {mode}.", command)

    def publish(
        self, kind: str, data: Data, unit: UnitAxes | None = None, correlation: str | None = None
    ) -> Event:
        """Tell what has happened to the robot, or to a unit."""
        return self._publish(kind, f"/robots/{unit.address if unit else self.id}", data, correlation)


def _is_doubtful(told: Answers, count: int) -> bool:
    """True if answers may be lost, doubled, or both: then the count is right, and neighbours are equal."""
    return len(told.replies) != count or any(one == other for one, other in pairwise(told.replies))
