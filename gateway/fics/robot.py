"""A robot as the gateway sees it: its units, what stands in its way, and how to ask it something."""

import asyncio
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from gateway.core.errors import Expired, InvalidRequest, NotFound
from gateway.core.lanes import Lane
from gateway.core.stops import StopMode
from gateway.fics.commander import Commander, in_time
from gateway.fics.downloads import download
from gateway.fics.errors import ErrorStands, NotProved, RobotBusy
from gateway.fics.exchange import Answered, FicsExchange, Outcome, Proof
from gateway.fics.jogs import Jogs
from gateway.fics.line import FicsLine
from gateway.fics.power import Power
from gateway.fics.read_back import read_back
from gateway.fics.selection import Selection
from gateway.fics.shared_reads import Heard, Queries, deadline_of, heard_now
from gateway.fics.stops import RobotStopReport, RobotStops
from gateway.fics.system_errors import RobotErrorRecord, SystemErrors
from gateway.fics.tables import clear, store
from gateway.fics.units import RobotUnit, coordinates_of
from gateway.fics.uploads import UPLOAD
from protocols.fics.alarms import CurrentError, ResetErrors, TakeCurrentError
from protocols.fics.axis_settings import AxisSetting
from protocols.fics.commands import of_the_robot
from protocols.fics.homing import HomeRobot
from protocols.fics.jog import StartJog, StopJog
from protocols.fics.link import Completion, Failure, Frame, Garbage, Refusal
from protocols.fics.macros import RunMacro
from protocols.fics.positions import (
    LAST_POSITION,
    BeginPositionUpload,
    ClearPositions,
    DownloadPositions,
    EndPositionUpload,
    StoredPosition,
    UploadPosition,
)
from protocols.fics.row import Block, FicsCommand
from protocols.fics.stops import StopAllDecelerating, StopAllImmediately
from protocols.fics.system import (
    GetCommunicationMode,
    GetUnit,
    HostMode,
    SelectUnit,
    SetCommunicationMode,
)
from protocols.table import Reply

Publish = Callable[[str, str, dict[str, Any], str | None], str]
"""Type, subject, data and correlation of an event; gives its cursor."""

_MOVES_ALL_UNITS = (HomeRobot, RunMacro)
_KEPT_BACK: dict[type[FicsCommand[Any]], str] = {
    BeginPositionUpload: "Upload positions as a whole: an open upload takes no stop.",
    UploadPosition: "Upload positions as a whole: an open upload takes no stop.",
    EndPositionUpload: "Upload positions as a whole: the gateway ends each upload itself.",
    StartJog: "Open a JOG session, whose heartbeat keeps the axis moving.",
    StopJog: "Stop the axis, or its JOG session.",
    StopAllDecelerating: "Stop the robot, which sees to its standstill.",
    StopAllImmediately: "Stop the robot, which sees to its standstill.",
    SetCommunicationMode: "Set the mode of the line in the configuration.",
}


class Accepted(NamedTuple):
    """A motion command that was written: its exchange, and what will become of it."""

    exchange: FicsExchange
    outcome: "asyncio.Future[Outcome]"
    """Ver.2: only a refusal ever comes here."""

    def was_refused(self) -> bool:
        """Whether nothing moved because of it."""
        return self.outcome.done() and isinstance(self.outcome.result(), Refusal)


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
        self.motion: FicsCommand[Any] | None = None
        """The motion command of ours that is under way."""
        self._moved: RobotUnit | None = None
        """The unit the last one was sent to."""
        self.moves_by_itself: bool | None = None
        """Whether it was seen to move without a command of ours; None until somebody has looked."""
        self.look_due = asyncio.Event()
        """Nobody knows whether it moves: it is to be looked at now, not at the next round."""
        self.idle = asyncio.Event()
        """No unit has a move that is not over."""
        self.stopping = False
        """Whether a stop is not confirmed yet."""
        self.tables_change = asyncio.Lock()
        """Held from a change of a table of positions until it is read back: nothing moves meanwhile."""
        self.dialogue = Commander(robot_id, line)
        self.queries = Queries(self)
        self.selection = Selection(self)
        self.power = Power(self)
        self.errors_of_system = SystemErrors(self)
        self.stops = RobotStops(self)
        self.jogs = Jogs(self)
        self._publish = publish
        self.idle.set()
        line.on_change = self._line_changed
        line.on_stray = self._heard_unasked

    async def close(self) -> None:
        """Stop what jogs, give up repeating stops, and close the line; moves run on in the robot."""
        await self.jogs.close()
        await self.stops.close()
        await self.errors_of_system.close()
        await self.line.close()
        await self.queries.close()

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
    def moving(self) -> bool | None:
        """Whether it moves, as far as is known; None where nobody has looked since it was out of reach."""
        return True if self.motion is not None else self.moves_by_itself

    @property
    def power_cycled(self) -> bool:
        """Whether it has lost its power, and nobody has acknowledged that yet."""
        return self.power.cycled

    @property
    def latched_error(self) -> RobotErrorRecord | None:
        """The error of the system that stands, as far as is known."""
        return self.errors_of_system.latched

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

        :raises ControllerRefused: the robot answered `Enn`.
        :raises RobotFailed: it ended with an error of the system.
        :raises GatewayError: it was not sent, or not answered; the error says which.
        """
        replies = (await self.ask_all(command, unit)).replies
        return replies[0] if replies else Completion(command.wire_name())

    async def ask_all(self, command: FicsCommand[Any], unit: int | None = None) -> Heard:
        """Send a command and give all its replies; errors as of `ask`."""
        _require_alone(command)
        if isinstance(command, TakeCurrentError):
            taken = await self.errors_of_system.take(expires_at=deadline_of(Lane.COMMAND))
            return heard_now(CurrentError(error=taken))
        if isinstance(command, ResetErrors):
            await self.errors_of_system.reset()
            return heard_now()
        if isinstance(command, DownloadPositions | ClearPositions):
            axes = self._only_unit(command) if unit is None else self.unit(unit)
            work = download(axes, command) if isinstance(command, DownloadPositions) else clear(axes, command)
            return await work
        return await self.converse(command, unit)

    async def read(self, query: FicsCommand[Any], unit: int | None = None, lane: Lane = Lane.READ) -> Any:
        """Send a query and give its reply; errors as of `ask`."""
        return (await self.converse(query, unit, lane)).replies[0]

    async def converse(
        self, command: FicsCommand[Any], unit: int | None = None, lane: Lane = Lane.READ
    ) -> Heard:
        """Send a command that starts no move, in turn; errors as of `ask`. `lane` is that of a query."""
        number = self._unit_of(command, unit)
        self.require_free(command)
        if command.is_query():
            return await self.queries.ask(command, number, lane, deadline_of(lane))
        await self._do(command, number, read=self.mode == HostMode.VER_2)
        return heard_now()

    async def change(self, command: FicsCommand[Any], unit: int | None = None) -> Any:
        """Send a setting, and give what the robot tells of it then, which agrees; errors as of `ask`, and

        :raises NotDone: the robot tells something else.
        :raises NotReadBack: it was sent, and the robot has not told what it is now.
        """
        number = self._unit_of(command, unit)
        self.require_free(command)
        return (await self._do(command, number, read=True)).replies[0]

    async def _do(self, command: FicsCommand[Any], number: int | None, *, read: bool) -> Answered:
        """Send a command that changes something, to a unit just confirmed, and `read` back what it is."""
        self.line.admission.require()
        epoch, lane = self.line.stop_epoch, Lane.COMMAND
        async with self.line.sequence_lock.held(lane, deadline_of(lane)):
            if self.line.stop_epoch != epoch:
                raise self.line.overtaken()
            if number is not None:
                await self.selection.make(number, afresh=True)
            outcome = await self.dialogue.say(command, epoch, expires_at=deadline_of(lane))
            if read:
                outcome = await read_back(self, command, outcome, epoch)
            self.learn(command, number, outcome)
        if isinstance(outcome, Failure):
            await self.errors_of_system.look()
        return self.dialogue.answered(command, outcome)

    def learn(self, command: FicsCommand[Any], number: int | None, outcome: Outcome) -> None:
        """Note what the gateway has to remember of what was said."""
        if isinstance(command, SelectUnit):
            self.selection.forget()
        if number is not None:
            self.power.note(self.unit(number), command, outcome)
        if isinstance(command, AxisSetting):
            self._forget_paces()

    def _forget_paces(self) -> None:
        for unit in self.units:
            unit.paces.clear()

    # motion

    async def begin(
        self,
        command: FicsCommand[Any],
        unit: int,
        *,
        epoch: int,
        expires_at: float,
        on_written: Callable[[float], None],
    ) -> Accepted:
        """Write a motion command at most once, and give what will become of it; it ends with `end_motion`.

        :raises NotSent: it was not written; the error says why.
        :raises ControllerRefused: the mode, the speeds or the unit could not be made sure of.
        """
        axes = self.unit(unit)

        def note(now: float) -> None:
            self.motion, self._moved = command, axes
            for it in self.units:
                it.stood_still &= it.number != unit and not isinstance(command, _MOVES_ALL_UNITS)
            if isinstance(command, _MOVES_ALL_UNITS):
                self.power.forget_origins()
            on_written(now)

        async with self.line.sequence_lock.held(Lane.COMMAND, expires_at):
            doubt: NotProved | None = None
            while True:
                try:
                    async with in_time(expires_at):
                        proof = await self._prove(command, axes, epoch)
                    written = await self.dialogue.start(
                        command, epoch=epoch, expires_at=expires_at, proof=proof, on_written=note
                    )
                except NotProved as error:
                    doubt = error  # all is asked again
                except Expired as late:
                    raise (doubt or late) from None
                else:
                    return Accepted(*written)

    async def _prove(self, command: FicsCommand[Any], unit: RobotUnit, epoch: int) -> Proof:
        """See to everything a motion depends on: the speeds, the unit, and last that the power is not lost.

        :raises NotSent: nobody knows, or something forbids the motion.
        :raises ControllerRefused: as of `begin`.
        """
        if self.line.stop_epoch != epoch:
            raise self.line.overtaken()
        self.require_fit_for_motion(command)
        proof = self.line.begin_proof(command, GetUnit(), *self.power.signs(command, unit))
        await self.dialogue.see_error()
        self.require_fit_for_motion(command)
        if self.motion is not None:
            await self.power.see_jogging(unit, proof)
        else:
            await self.power.restore()
            await self.selection.make(unit.number, afresh=True)
            await self.power.verify(unit, coordinates_of(unit, command), proof)
            await self.power.see(proof)
        self.require_fit_for_motion(command)
        return proof

    def end_motion(self, accepted: Accepted | None = None) -> None:
        """The motion command that was begun is over; an answer it still owes is no longer waited for."""
        self.motion = None
        if accepted is not None and not accepted.outcome.done():
            self.line.give_up(accepted.exchange)
        if self._moved is None or (accepted is not None and accepted.was_refused()):
            return
        self.moves_by_itself = False if self._moved.stood_still else None
        if self.moves_by_itself is None:
            self.look_due.set()

    def see_motion(self, *, moves: bool | None) -> None:
        """Note whether it moves without a command of ours, and tell when that begins."""
        if moves and not self.moves_by_itself:
            self.publish("robot.motion.foreign", {})
        self.moves_by_itself = moves

    def was_left_alone(self) -> None:
        """Nobody has looked after it for seconds: stop what jogs, and believe nothing read before."""
        self.jogs.end_all("lost")
        if self.motion is None:
            self.selection.forget()  # in motion no other unit can be selected
        self.moves_by_itself = self.moves_by_itself or None
        self.look_due.set()

    async def send_stop(self, command: FicsCommand[Any]) -> Outcome:
        """Send a stop ahead of everything."""
        return await self.line.submit(self.line.exchange(command, Lane.STOP))

    def require_fit_for_motion(self, command: FicsCommand[Any]) -> None:
        """Refuse motion that somebody has to look after first.

        :raises NotSent: power was lost, or an error stands.
        :raises RobotBusy: something moves, or a stop is not confirmed.
        """
        name = command.wire_name()
        self.power.require_known(name)
        if self.latched_error is not None:
            raise ErrorStands(f"{self.latched_error.en} {name} was not sent.", self.latched_error.remedy_en)
        if self.stopping:
            raise RobotBusy(
                f"The stop of {self.id} is not confirmed yet; {name} was not sent.", "Wait for standstill."
            )
        if self.tables_change.locked():
            raise RobotBusy(
                f"Positions of {self.id} are being changed and read back; {name} was not sent.", "Try again."
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
        if isinstance(command, _MOVES_ALL_UNITS) or of_the_robot(type(command)):
            return None
        return self._only_unit(command).number

    def _only_unit(self, command: FicsCommand[Any]) -> RobotUnit:
        if len(self.units) == 1:
            return self.units[0]
        raise InvalidRequest(f"{command.wire_name()} acts on one unit; nothing was sent.", "Say on which.")

    # what takes several commands

    def stop(self, mode: StopMode) -> "asyncio.Task[RobotStopReport]":
        """Stop all axes; the stop is queued before this returns, ahead of everything."""
        return self.stops.stop(mode)

    async def upload_positions(
        self, positions: Sequence[tuple[int, Sequence[float | None]]], unit: int | None = None
    ) -> None:
        """Store positions of a unit, undivided, and see that it holds them; errors as of `tables.store`."""
        await store(self._only_unit(UPLOAD) if unit is None else self.unit(unit), positions)

    async def positions(
        self, first: int = 1, last: int = LAST_POSITION, unit: int | None = None
    ) -> list[tuple[int, list[float | None]]]:
        """Read the stored positions of a unit in turn; errors as of `download`."""
        if not 1 <= first <= last <= LAST_POSITION:
            raise InvalidRequest(f"Positions go from 1 to {LAST_POSITION}; nothing was sent.")
        replies = (await self.ask_all(DownloadPositions(first=first, count=last - first + 1), unit)).replies
        found = [list(it.coordinates) for it in replies if isinstance(it, StoredPosition)]
        return list(enumerate(found, first))

    # power

    async def see_power(self) -> None:
        """See that the robot has not been switched off.

        :raises PowerCycled: it has.
        :raises GatewayError: it did not tell.
        """
        async with self.line.sequence_lock.held(Lane.COMMAND):
            await self.power.see()

    async def restore_speeds(self) -> None:
        """Set the speeds again that were lost with the power; errors as of `Power.restore`."""
        async with self.line.sequence_lock.held(Lane.COMMAND):
            await self.power.restore()

    # news

    def publish(self, kind: str, data: dict[str, Any], correlation: str | None = None) -> str:
        """Tell what has happened to the robot; gives the event's cursor."""
        return self._publish(kind, f"/robots/{self.id}", data, correlation)

    def publish_of(self, unit: RobotUnit, kind: str, data: dict[str, Any], correlation: str) -> str:
        """Tell what has happened to a unit; gives the event's cursor."""
        return self._publish(kind, f"/robots/{unit.address}", data, correlation)

    def _line_changed(self, what: str, facts: dict[str, object]) -> None:
        if self.motion is None or what == "robot.power_cycled":
            self.selection.forget()  # in motion no other unit can be selected
        self._forget_paces()
        self.moves_by_itself = self.moves_by_itself or None
        self.look_due.set()
        if what == "robot.power_cycled":
            self.power.lost(certain=bool(facts["certain"]))
        elif what.startswith("robot."):
            self.publish(what, dict(facts))
        else:
            self._publish(what, f"/lines/{self.line.id}", dict(facts), None)

    def _heard_unasked(self, frame: Frame) -> None:
        """An answer came that nobody had asked for: somebody else may select units, or change the mode."""
        if isinstance(frame, Garbage):
            return
        if frame.name == GetUnit.code:
            self.selection.doubt()
        elif frame.name == GetCommunicationMode.code:
            self.look_due.set()


def _require_alone(command: FicsCommand[Any]) -> None:
    """Refuse what is not sent by itself.

    :raises InvalidRequest: it is part of something larger, or moves something.
    """
    for kept_back, remedy in _KEPT_BACK.items():
        if isinstance(command, kept_back):
            raise InvalidRequest(f"{command.wire_name()} is not sent alone; nothing was sent.", remedy)
    if command.starts_motion():
        raise InvalidRequest(f"{command.wire_name()} starts a move; nothing was sent.", "Start a move.")
