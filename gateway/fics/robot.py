"""A robot as the gateway sees it: its units, what stands in its way, and how to ask it something."""

import asyncio
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from datetime import UTC, datetime
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

from pydantic import Field

from gateway.errors import Expired, GatewayError, InvalidRequest, NoReply, NotFound, StoppedFirst
from gateway.exchange import Lane
from gateway.fics.errors import (
    ErrorStands,
    PowerCycled,
    RobotBusy,
    RobotFailed,
    RobotRefused,
    UnitNotSelected,
)
from gateway.fics.exchange import Answered, Exchange, Outcome
from gateway.fics.jogs import Jogs, JogSession
from gateway.fics.line import SILENT, FicsLine
from gateway.fics.stops import RobotStopReport, RobotStops
from gateway.fics.uploads import UPLOAD, runs_of
from gateway.records import Record
from gateway.stops import StopMode
from protocols.fics import homing, inputs_outputs, macros, stops, system, variables
from protocols.fics.alarms import (
    CurrentError,
    DetailKind,
    ErrorDetail,
    GetErrorDetail,
    ResetErrors,
    TakeCurrentError,
)
from protocols.fics.errors import ErrorKind, lookup
from protocols.fics.jog import StartJog, StopJog
from protocols.fics.link import Completion, Failure, Refusal
from protocols.fics.motor_axes import GetMotorPosition
from protocols.fics.notation import AxisSystem
from protocols.fics.positions import (
    LAST_POSITION,
    BeginPositionUpload,
    DownloadPositions,
    EndPositionUpload,
    StoredPosition,
    UploadPosition,
)
from protocols.fics.row import Block, FicsCommand
from protocols.fics.status import AxisStatus, GetAxisStatus, GetUserPosition, MotionMode
from protocols.fics.system import CommunicationMode, GetCommunicationMode, GetUnit, SelectUnit, UnitNumbers
from protocols.table import Reply, Retry

if TYPE_CHECKING:
    from gateway.fics.moves import RobotMove

Publish = Callable[[str, str, dict[str, Any], str | None], str]
"""Type, subject, data and correlation of an event; gives its cursor."""

HEALTH_POLL_S = 5.0
"""A robot that does nothing for us is asked for its mode and status this often."""

BUSY = "E01"
"""The refusal of a selection of units while something moves (C-HOST manual 1-7)."""

Coordinates = Literal["user", "motor"]

_WHOLE_SYSTEM = (homing.HomeRobot, macros.RunMacro, ResetErrors, TakeCurrentError, GetErrorDetail)
_SYSTEM_TOPICS = (system, inputs_outputs, variables, stops)
_KEPT_BACK: dict[type[FicsCommand[Any]], str] = {
    BeginPositionUpload: "Upload positions as a whole: an open upload takes no stop.",
    UploadPosition: "Upload positions as a whole: an open upload takes no stop.",
    EndPositionUpload: "Upload positions as a whole: the gateway ends each upload itself.",
    StartJog: "Open a JOG session, whose heartbeat keeps the axis moving.",
    system.SetCommunicationMode: "Set the mode of the line in the configuration.",
}


class RobotErrorRecord(Record):
    """An error of the system that stands until it is reset (C-HOST manual 2-12, 2-13)."""

    code: str | None = Field(description="Three digits; null where the answer that named it was lost.")
    en: str
    ja: str
    remedy_en: str
    remedy_ja: str
    kind: DetailKind | None = Field(description="Which kind of error the details tell of; null if not known.")
    detail: str | None = Field(description="What ERD has answered.")
    unit: int | None = None
    axis: str | None = Field(default=None, description="The motor axis.")
    at: datetime


class Accepted(NamedTuple):
    """A motion command that was written: its exchange, and what will become of it."""

    exchange: Exchange
    outcome: "asyncio.Future[Outcome]"
    """Ver.2: only a refusal ever comes here."""


class RobotUnit:
    """Axes of a robot that are commanded together."""

    def __init__(
        self, robot: "Robot", number: int, axes: list[str], motor_axes: list[str], axis_system: AxisSystem
    ) -> None:
        self.robot = robot
        self.number = number
        self.axes = axes
        """Names of the user axes, in the order of coordinates."""
        self.motor_axes = motor_axes
        self.system = axis_system
        self.move: RobotMove | None = None
        """The move that is not over yet."""

    @cached_property
    def address(self) -> str:
        """Its address that is always unique, such as `ROBOT/units/1`."""
        return f"{self.robot.id}/units/{self.number}"

    def names(self, coordinates: Coordinates) -> list[str]:
        """The names of its axes in user or in motor coordinates."""
        return self.axes if coordinates == "user" else self.motor_axes

    async def position(self, coordinates: Coordinates = "user") -> dict[str, float | None]:
        """Read the position; an axis is null while its position is not known (C-HOST manual 2-9, 4-4).

        :raises GatewayError: it was not read.
        """
        query = GetUserPosition() if coordinates == "user" else GetMotorPosition()
        reply = await self.robot.read(query, self.number)
        values = reply.coordinates
        names = self.names(coordinates)
        if len(values) == 1 and values[0] is None:
            values = [None] * len(names)
        return self._by_axis(names, values)

    async def status(self) -> dict[str, AxisStatus]:
        """Read the status of its motor axes (C-HOST manual 2-10).

        :raises GatewayError: it was not read.
        """
        reply = await self.robot.read(GetAxisStatus(), self.number)
        return self._by_axis(self.motor_axes, reply.axes)

    def _by_axis(self, names: list[str], values: list[Any]) -> dict[str, Any]:
        if len(values) != len(names):
            raise InvalidRequest(
                f"{self.address} has {len(values)} axes, {len(names)} are configured.",
                "Correct the axes of the unit in the configuration.",
            )
        return dict(zip(names, values, strict=True))


def at_rest(axes: Iterable[AxisStatus]) -> bool:
    """Whether no axis moves, and nothing is under way that could move one."""
    still = (MotionMode.STANDING, MotionMode.STOPPED)
    return all(not axis.moving and axis.motion_mode in still for axis in axes)


def in_trouble(axis: AxisStatus) -> bool:
    """Whether the status of an axis tells of an error."""
    return axis.alarm or bool(axis.driver_error) or axis.motion_mode == MotionMode.STOPPED


class Robot:
    """One Fics with its units, behind a line of its own."""

    def __init__(
        self,
        robot_id: str,
        name: str,
        line: FicsLine,
        publish: Publish,
        *,
        poll_interval_s: float = 0.2,
    ) -> None:
        self.id = robot_id
        self.name = name
        self.line = line
        self.units: list[RobotUnit] = []
        self.poll_interval_s = poll_interval_s
        self.latched_error: RobotErrorRecord | None = None
        """The error of the system that stands, as far as is known."""
        self.power_cycled = False
        """Whether it has lost its power, and nobody has acknowledged that yet."""
        self.motion: FicsCommand[Any] | None = None
        """The motion command of ours that is under way."""
        self.moves_by_itself = False
        """Whether it was seen to move without a command of ours."""
        self.idle = asyncio.Event()
        """No unit has a move that is not over."""
        self.stopping = False
        """Whether a stop is not confirmed yet."""
        self._publish = publish
        self._selected: int | None = None
        """The unit the robot is known to act on."""
        self._error_is_stale = False
        """Ver.2: whether a silent command was sent whose error nobody has asked for."""
        self._floor = asyncio.Lock()
        """Held from the selection of a unit to the last command that depends on it."""
        self.stops = RobotStops(self)
        self.jogs = Jogs(self)
        self.idle.set()
        line.on_change = self._line_changed

    async def close(self) -> None:
        """Stop what jogs, give up repeating stops, and close the line; moves run on in the robot."""
        await self.jogs.close()
        await self.stops.close()
        await self.line.close()

    # what it is now

    @property
    def online(self) -> bool:
        """Whether it can be asked now, as far as is known."""
        return self.line.online

    @property
    def mode(self) -> int:
        """Its communication mode (C-HOST manual 1-1-1)."""
        return self.line.mode

    @property
    def moving(self) -> bool:
        """Whether it moves, as far as is known."""
        return self.motion is not None or self.moves_by_itself

    def unit(self, number: int) -> RobotUnit:
        """Find a unit.

        :raises NotFound: it is not configured.
        """
        for unit in self.units:
            if unit.number == number:
                return unit
        known = ", ".join(str(unit.number) for unit in self.units)
        raise NotFound(f"Robot {self.id} has no unit {number}, but {known}; nothing was sent.")

    # asking

    async def ask(self, command: FicsCommand[Any], unit: int | None = None) -> Reply | Completion:
        """Send a command and give its reply, the first where there are several.

        :raises RobotRefused: the robot answered `Enn`.
        :raises RobotFailed: it ended with an error of the system.
        :raises GatewayError: it was not sent, or not answered; the error says which.
        """
        replies = await self.ask_all(command, unit)
        return replies[0] if replies else Completion(command.wire_name())

    async def ask_all(self, command: FicsCommand[Any], unit: int | None = None) -> tuple[Reply, ...]:
        """Send a command and give all its replies; errors as of `ask`."""
        for kept_back, remedy in _KEPT_BACK.items():
            if isinstance(command, kept_back):
                raise InvalidRequest(f"{command.wire_name()} is not sent alone; nothing was sent.", remedy)
        if command.starts_motion():
            raise InvalidRequest(f"{command.wire_name()} starts a move; nothing was sent.", "Start a move.")
        if isinstance(command, TakeCurrentError):
            return (CurrentError(error=await self.take_error()),)
        if isinstance(command, ResetErrors):
            await self.reset_errors()
            return ()
        return (await self.converse(command, unit)).replies

    async def read(self, query: FicsCommand[Any], unit: int | None = None) -> Any:
        """Send a query and give its reply; errors as of `ask`."""
        return (await self.converse(query, unit)).replies[0]

    async def all_at_rest(self) -> bool:
        """Whether every unit says that it stands still; errors as of `ask`."""
        for unit in self.units:
            if not at_rest((await unit.status()).values()):
                return False
        return True

    async def converse(
        self, command: FicsCommand[Any], unit: int | None = None, *, afresh: bool = False
    ) -> Answered:
        """Send a command that starts no move, in turn; errors as of `ask`."""
        epoch = self.line.stop_epoch
        if command.retry is Retry.STOP:
            if not isinstance(command, StopJog):
                self.line.begin_stop()
            return self.answered(command, await self.send_stop(command))
        number = self._unit_of(command, unit)
        self.require_free(command)
        async with self._floor:
            if number is not None:
                await self._select(number, afresh=afresh)
            outcome = await self._say(command, epoch)
            if isinstance(command, SelectUnit):
                self._selected = None
        if isinstance(outcome, Failure):
            await self.look_for_errors()
        return self.answered(command, outcome)

    async def begin(
        self,
        command: FicsCommand[Any],
        unit: int | None,
        *,
        epoch: int,
        expires_at: float,
        on_written: Callable[[float], None],
    ) -> Accepted:
        """Write a motion command at most once, and give what will become of it; it ends with `end_motion`.

        :raises NotSent: it was not written; the error says why.
        :raises RobotRefused: the mode or the unit could not be made sure of.
        """
        loop = asyncio.get_running_loop()
        number = self._unit_of(command, unit)
        async with self._floor:
            if self.line.stop_epoch != epoch:
                raise StoppedFirst
            self.require_fit_for_motion(command)
            if self.motion is None:
                await self._know_mode()
            if number is not None:
                await self._select(number, afresh=True)
            if loop.time() >= expires_at:
                raise Expired("The robot was not free in time; nothing was sent.", "Try again.")
            await self._clear_error()
            exchange = self.line.exchange(command, Lane.COMMAND)
            exchange.epoch = epoch
            settled = asyncio.Event()

            def note(now: float) -> None:
                self.motion = command
                settled.set()
                on_written(now)

            exchange.on_written = note
            outcome = self.line.submit(exchange)
            await _written_or_settled(settled, outcome)
            if self.mode == SILENT and self.motion is command:
                outcome = await self._silent_outcome(exchange)
        return Accepted(exchange, outcome)

    def end_motion(self, accepted: Accepted | None = None) -> None:
        """The motion command that was begun is over; an answer it still owes is no longer waited for."""
        self.motion = None
        if accepted is not None and not accepted.outcome.done():
            self.line.give_up(accepted.exchange)

    async def send_stop(self, command: FicsCommand[Any]) -> Outcome:
        """Send a stop ahead of everything."""
        return await self.line.submit(self.line.exchange(command, Lane.STOP))

    def answered(self, command: FicsCommand[Any], outcome: Outcome) -> Answered:
        """Turn everything that is no answer into its error."""
        if isinstance(outcome, Refusal):
            raise RobotRefused(self.id, command.wire_name(), outcome.error)
        if isinstance(outcome, Failure):
            raise RobotFailed(self.id, command.wire_name(), outcome.error)
        if isinstance(outcome, GatewayError):
            raise outcome
        return outcome

    async def _say(self, command: FicsCommand[Any], epoch: int) -> Outcome:
        if not command.is_query():
            await self._clear_error()
        exchange = self.line.exchange(command, Lane.READ if command.is_query() else Lane.COMMAND)
        exchange.epoch = epoch
        outcome = await self.line.submit(exchange)
        if isinstance(outcome, Answered) and not outcome.confirmed:
            outcome = await self._verdict(exchange)
        return outcome

    async def _clear_error(self) -> None:
        """In Ver.2: see that no refusal of an earlier command is taken for that of the next."""
        if self.mode != SILENT:
            return
        if self._error_is_stale:
            with suppress(NoReply):
                await self._take_error()
        self._error_is_stale = True

    async def _verdict(self, exchange: Exchange) -> Outcome:
        """Ask for the error, in Ver.2 the only way to hear of a refusal (C-HOST manual 1-1-1, 2-12)."""
        had_error = self.latched_error is not None and not isinstance(exchange.command, ResetErrors)
        try:
            error = await self._take_error()
        except GatewayError:
            return _nobody_knows(exchange.command)
        if self.line.stop_epoch != exchange.epoch:
            return _nobody_knows(exchange.command)  # the error may be that of the stop
        kind = lookup(error).kind
        if kind is ErrorKind.NONE:
            return Answered()
        if error.startswith("E"):
            return Refusal(exchange.command.wire_name(), error)
        return _nobody_knows(exchange.command) if had_error else Failure(exchange.command.wire_name(), error)

    async def _silent_outcome(self, exchange: Exchange) -> "asyncio.Future[Outcome]":
        future: asyncio.Future[Outcome] = asyncio.get_running_loop().create_future()
        verdict = await self._verdict(exchange)
        if not isinstance(verdict, Answered):
            future.set_result(verdict)
        return future

    # what has to be right before

    def require_fit_for_motion(self, command: FicsCommand[Any]) -> None:
        """Refuse motion that somebody has to look after first.

        :raises NotSent: power was lost, an error stands, or a stop is not confirmed.
        :raises RobotBusy: something moves.
        """
        if self.power_cycled:
            raise PowerCycled(
                f"Robot {self.id} has been switched off and on: its speeds are 100 % again and nothing is "
                f"homed; {command.wire_name()} was not sent.",
                "Set its speeds, acknowledge the power cycle, then home it.",
            )
        if self.latched_error is not None:
            raise ErrorStands(
                f"{self.latched_error.en} {command.wire_name()} was not sent.", self.latched_error.remedy_en
            )
        if self.stopping:
            raise RobotBusy(
                f"The stop of {self.id} is not confirmed yet; {command.wire_name()} was not sent.",
                "Wait for standstill.",
            )
        self.require_free(command)

    def require_free(self, command: FicsCommand[Any]) -> None:
        """Refuse what the manual forbids during motion (C-HOST manual 1-7), as Ver.2 would do silently.

        :raises RobotBusy: a motion command is under way.
        """
        joins = isinstance(command, StartJog) and isinstance(self.motion, StartJog)
        if self.motion is not None and Block.MOTION in command.blocked and not joins:
            raise RobotBusy(
                f"{self.motion.wire_name()} of {self.id} is under way; {command.wire_name()} was not sent.",
                "Wait for its end or stop it.",
            )

    def _unit_of(self, command: FicsCommand[Any], unit: int | None) -> int | None:
        """The unit to be selected; None where the command means the whole system."""
        if unit is not None:
            return self.unit(unit).number
        if isinstance(command, _WHOLE_SYSTEM) or type(command).__module__ in {
            topic.__name__ for topic in _SYSTEM_TOPICS
        }:
            return None
        if len(self.units) == 1:
            return self.units[0].number
        raise InvalidRequest(f"{command.wire_name()} acts on one unit; nothing was sent.", "Say on which.")

    async def see_power(self) -> None:
        """See that the robot has not been switched off in the middle of a motion.

        :raises PowerCycled: it has.
        """
        async with self._floor:
            await self._know_mode()

    async def _know_mode(self) -> None:
        """See that the robot has not been switched off: then it is in Ver.2 and at full speed."""
        if self.mode == SILENT:
            return
        outcome = await self._say(GetCommunicationMode(), self.line.stop_epoch)
        if isinstance(outcome, Refusal):
            return  # only Ver.3 refuses
        reply = self._before(GetCommunicationMode(), outcome)
        if isinstance(reply, CommunicationMode) and reply.mode != self.mode:
            self.line.set_up_again(f"the robot is in mode {reply.mode}")
            self.lost_power(certain=True)
            raise PowerCycled(
                f"Robot {self.id} has been switched off and on; nothing was sent.",
                "Set its speeds, acknowledge the power cycle, then home it.",
            )

    async def _select(self, number: int, *, afresh: bool) -> None:
        """Make sure which unit the robot acts on: its answers do not tell (C-HOST manual 2-1)."""
        moving = self.motion is not None
        if self._selected == number and (moving or not afresh):
            return
        if moving and not isinstance(self.motion, macros.RunMacro):
            raise RobotBusy(
                f"Robot {self.id} moves, so unit {number} cannot be selected; nothing was sent.",
                "Wait for standstill.",
            )
        before, self._selected = self._selected, None
        epoch = self.line.stop_epoch
        found = await self._host_unit(epoch) if afresh else None
        if found is not None and before is not None and found != before:
            self.publish("robot.unit.changed", {"expected": before, "found": found})
        if found != number:
            outcome = await self._say(SelectUnit(unit=number), epoch)
            self._before(SelectUnit(unit=number), outcome)
            found = await self._host_unit(epoch)
        if found != number:
            raise UnitNotSelected(
                f"Robot {self.id} acts on unit {found}, not on unit {number}; nothing more was sent.",
                "See who else selects units, then try again.",
            )
        self._selected = number

    async def _host_unit(self, epoch: int) -> int:
        reply = self._before(GetUnit(), await self._say(GetUnit(), epoch))
        return reply.host_unit if isinstance(reply, UnitNumbers) else 0

    def _before(self, command: FicsCommand[Any], outcome: Outcome) -> Reply | None:
        """The reply to a preparation; without one, what was to follow is not sent."""
        if isinstance(outcome, NoReply):
            raise UnitNotSelected(
                f"Robot {self.id} did not answer {command.wire_name()}, so nobody knows which unit it acts "
                "on; nothing more was sent.",
                "Try again.",
            )
        replies = self.answered(command, outcome).replies
        return replies[0] if replies else None

    # what takes several commands

    def stop(self, mode: StopMode) -> "asyncio.Task[RobotStopReport]":
        """Stop all axes; the stop is queued before this returns, ahead of everything."""
        return self.stops.stop(mode)

    async def jog(self, unit: int, axis: str, direction: Literal["+", "-"]) -> JogSession:
        """Start to jog an axis, which stops when its heartbeat does; errors as of `Jogs.start`."""
        return await self.jogs.start(unit, axis, direction)

    def heartbeat(self, session_id: str) -> JogSession:
        """Keep an axis jogging; errors as of `Jogs.heartbeat`."""
        return self.jogs.heartbeat(session_id)

    async def end_jog(self, session_id: str) -> JogSession:
        """Stop an axis that jogs; errors as of `Jogs.end`."""
        return await self.jogs.end(session_id)

    async def upload_positions(
        self, positions: Sequence[tuple[int, Sequence[float | None]]], unit: int | None = None
    ) -> None:
        """Store positions of a unit, undivided (C-HOST manual 2-17, 2-18).

        :raises InvalidRequest: a number or a coordinate is not possible; nothing was sent.
        :raises GatewayError: it was broken off; positions before the one that failed may be stored.
        """
        runs = runs_of(positions)
        number = self._unit_of(UPLOAD, unit)
        self.require_free(UPLOAD)
        epoch = self.line.stop_epoch
        async with self._floor:
            if number is not None:
                await self._select(number, afresh=True)
            for first, commands in runs:
                await self._upload_run(first, commands, epoch)

    async def _upload_run(self, first: int, commands: list[UploadPosition], epoch: int) -> None:
        """One upload from its beginning to its end, which is sent whatever has happened in between."""
        self.answered(UPLOAD, await self._say(BeginPositionUpload(first=first), epoch))
        try:
            for command in commands:
                self.answered(command, await self._say(command, epoch))
        finally:
            if self.line.uploading:
                await self._say(EndPositionUpload(), self.line.stop_epoch)

    async def positions(
        self, first: int = 1, last: int = LAST_POSITION, unit: int | None = None
    ) -> list[tuple[int, list[float | None]]]:
        """Read the stored positions of a unit in turn; the robot ends at the first number without one.

        :raises GatewayError: they were not read.
        """
        if not 1 <= first <= last <= LAST_POSITION:
            raise InvalidRequest(f"Positions go from 1 to {LAST_POSITION}; nothing was sent.")
        query = DownloadPositions(first=first, count=last - first + 1)
        replies = (await self.converse(query, unit, afresh=True)).replies
        found = [list(it.coordinates) for it in replies if isinstance(it, StoredPosition)]
        return list(enumerate(found, first))

    # errors of the system

    async def take_error(self) -> str:
        """Ask for the present error; an error of the system is kept and published (C-HOST manual 2-12).

        :raises GatewayError: it was not told.
        """
        async with self._floor:
            error = await self._take_error()
        await self._note(error)
        return error

    async def _take_error(self) -> str:
        exchange = self.line.exchange(TakeCurrentError(), Lane.READ)
        reply = self.answered(exchange.command, await self.line.submit(exchange)).replies[0]
        self._error_is_stale = False
        return reply.error if isinstance(reply, CurrentError) else "E00"

    async def look_for_errors(self) -> None:
        """Find out which error stands; if the answer is lost, the details still tell (C-HOST manual 2-13)."""
        try:
            await self.take_error()
        except NoReply:
            with suppress(GatewayError):
                await self._note(None)
        except GatewayError:
            return

    async def _note(self, error: str | None) -> None:
        """Keep an error of the system, or forget one that was reset by somebody else."""
        if error is not None and lookup(error).kind is not ErrorKind.FICS:
            if self.latched_error is not None:
                self._errors_are_reset("elsewhere")
            return
        known = self.latched_error
        if known is not None and error is not None and known.code == error:
            return
        detail = await self._detail()
        if self.latched_error is not known:  # somebody else has looked at the same time
            return
        if error is None and (detail is None or detail.kind is DetailKind.NONE):
            return
        self.latched_error = _record(error, detail)
        self.publish("robot.error", self.latched_error.model_dump(mode="json"))

    async def _detail(self) -> ErrorDetail | None:
        try:
            reply = await self.read(GetErrorDetail())
        except GatewayError:
            return None
        return reply if isinstance(reply, ErrorDetail) else None

    async def errors(self) -> list[RobotErrorRecord]:
        """The error that stands, as the gateway knows it; the robot is not asked."""
        return [] if self.latched_error is None else [self.latched_error]

    async def reset_errors(self) -> None:
        """Reset the errors of the system, and see whether one still stands (DRT, C-HOST manual 2-14).

        :raises GatewayError: it was not done, or its cause is still there.
        """
        await self.converse(ResetErrors())
        if self.latched_error is not None:
            self._errors_are_reset("gateway")
        error = await self.take_error()
        if lookup(error).kind is ErrorKind.FICS:
            raise RobotFailed(self.id, ResetErrors.code, error)

    def _errors_are_reset(self, where: str) -> None:
        self.latched_error = None
        self.publish("robot.errors.reset", {"by": where})

    # power and presence

    def lost_power(self, *, certain: bool) -> None:
        """It has been switched off and on, or seems to: keep it from moving until somebody knows."""
        if not self.power_cycled:
            self.power_cycled = True
            self.latched_error = None
            self.publish("robot.power_cycled", {"certain": certain})

    async def acknowledge_power_cycle(self) -> None:
        """Let the robot move again: whoever calls this has set its speeds."""
        if self.power_cycled:
            self.power_cycled = False
            self.publish("robot.power_cycle.acknowledged", {})

    def publish(self, kind: str, data: dict[str, Any], correlation: str | None = None) -> str:
        """Tell what has happened to the robot; gives the event's cursor."""
        return self._publish(kind, f"/robots/{self.id}", data, correlation)

    def publish_of(self, unit: RobotUnit, kind: str, data: dict[str, Any], correlation: str) -> str:
        """Tell what has happened to a unit; gives the event's cursor."""
        return self._publish(kind, f"/robots/{unit.address}", data, correlation)

    def _line_changed(self, what: str, facts: dict[str, object]) -> None:
        if self.motion is None or what == "robot.power_cycled":
            self._selected = None  # in motion no other unit can be selected
        if what == "robot.power_cycled":
            self.lost_power(certain=bool(facts["certain"]))
        elif what.startswith("robot."):
            self.publish(what, dict(facts))
        else:
            self._publish(what, f"/lines/{self.line.id}", dict(facts), None)

    async def watch(self) -> None:
        """Notice what happens to the robot without us: lost power, errors, motion nobody here asked for."""
        while True:
            if self.line.state == "ready" and self.motion is None and not self.stopping:
                try:
                    await self._look()
                except PowerCycled:
                    pass
                except GatewayError as error:
                    self.publish("robot.unreadable", {"detail": error.detail})
            await asyncio.sleep(HEALTH_POLL_S)

    async def _look(self) -> None:
        await self.see_power()
        moves, troubled = False, False
        for unit in self.units:
            try:
                axes = (await unit.status()).values()
            except RobotRefused as refused:
                moves |= refused.fics_error == BUSY
                continue
            moves |= not at_rest(axes)
            troubled |= any(map(in_trouble, axes))
        if self.motion is not None:
            return
        if moves and not self.moves_by_itself:
            self.publish("robot.motion.foreign", {})
        self.moves_by_itself = moves
        if troubled or self.latched_error is not None:
            await self.look_for_errors()


def _record(error: str | None, detail: ErrorDetail | None) -> RobotErrorRecord:
    code = error
    if code is None and detail is not None and detail.error is not None:
        code = f"{detail.error:03d}"
    row = lookup(code or "999")
    return RobotErrorRecord(
        code=code,
        en=row.en if code else "An error of the system stands.",
        ja=row.ja if code else "Ficsのエラーが発生しています。",
        remedy_en=row.remedy_en,
        remedy_ja=row.remedy_ja,
        kind=detail.kind if detail else None,
        detail=detail.written() if detail else None,
        unit=detail.unit if detail else None,
        axis=detail.axis if detail else None,
        at=datetime.now(UTC),
    )


def _nobody_knows(command: FicsCommand[Any]) -> NoReply:
    return NoReply(
        f"{command.wire_name()} was sent, and in Ver.2 nobody can tell whether it was refused.",
        "Read back what it should have changed, and the errors of the robot.",
    )


async def _written_or_settled(settled: asyncio.Event, outcome: "asyncio.Future[Outcome]") -> None:
    """Wait until a command is written, or will not be."""
    outcome.add_done_callback(lambda _: settled.set())
    await settled.wait()
