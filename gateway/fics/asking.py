"""Questions and actions go to the right unit; one question answers all who ask the same meanwhile."""

import asyncio
from collections.abc import Awaitable, Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final, NamedTuple, TypeVar

from gateway.core.errors import ControllerRefused, Expired, GatewayError, InvalidRequest, Outdated
from gateway.core.lanes import Lane
from gateway.fics.axes import UnitAxes, unit_of
from gateway.fics.commander import Commander
from gateway.fics.edges import AxisEdges
from gateway.fics.errors import ErrorRemains, NotReadBack, RobotFailed, preparing
from gateway.fics.exchange import Outcome, RobotAnswered, answered
from gateway.fics.motion_state import MOVES_ALL_UNITS, MotionState
from gateway.fics.power import RobotPower
from gateway.fics.read_back import read_back
from gateway.fics.selection import Selection
from gateway.fics.system_errors import SystemErrors
from protocols.fics.alarms import DetailKind, ResetErrors
from protocols.fics.axis_settings import AxisSetting, AxisTimes, SpeedPercents
from protocols.fics.commands import of_the_robot
from protocols.fics.errors import FicsErrorKind, lookup
from protocols.fics.link import SystemFailure
from protocols.fics.motor_axes import SetMotorSpeedPercent
from protocols.fics.positions import DownloadPositions
from protocols.fics.row import BLOCK_ERRORS, Block, FicsCommand, WhenAnswered
from protocols.fics.speeds import SetSpeedPercent
from protocols.fics.status import AxisCoordinates, AxisStatuses, SensorStates
from protocols.fics.system import SelectUnit
from protocols.table import Effect, Reply

TURN_WITHIN_S = 5.0
"""A read or a command waits this time for the robot, and then for the line; a move says how long."""
_TURN_WITHIN_S: Final[Mapping[Lane, float]] = dict.fromkeys((Lane.COMMAND, Lane.READ), TURN_WITHIN_S)

NOTHING_TOLD: Final = RobotAnswered()
T = TypeVar("T")
Question = tuple[int | None, str]
"""A unit, or none, and the text of a query."""
Learn = Callable[[UnitAxes, FicsCommand[Any], Any], None]
"""Called with a unit, what it was asked, and its reply."""


class Answers(NamedTuple):
    """What a robot has answered, and when, on the event loop's clock."""

    replies: tuple[Any, ...]
    """None after an action, several after a download."""
    at: float
    texts: tuple[str, ...] = ()
    """What followed the name in each answer, as it came; none where Ver.2 has answered nothing."""


def answered_now(answered: RobotAnswered = NOTHING_TOLD) -> Answers:
    """What was answered just now."""
    return Answers(answered.replies, asyncio.get_running_loop().time(), answered.texts)


def deadline_of(lane: Lane) -> float | None:
    """Until when a request that comes now may wait; proofs of stops and moves are never too late."""
    within_s = _TURN_WITHIN_S.get(lane)
    return None if within_s is None else asyncio.get_running_loop().time() + within_s


def _is_over(expires_at: float | None) -> bool:
    return expires_at is not None and asyncio.get_running_loop().time() >= expires_at


@dataclass(eq=False)
class Asking:
    """The questions and actions of one robot that start no motion."""

    _units: Sequence[UnitAxes]
    _commander: Commander
    _motion: MotionState
    _selection: Selection
    _power: RobotPower
    _errors: SystemErrors
    _edges: AxisEdges
    settings_changed: int = 0
    """How often a setting of an axis may have changed."""
    said: int = 0
    """How often something was said that may have changed what was read before."""
    _waiting: dict[Question, "asyncio.Task[Answers | GatewayError]"] = field(default_factory=dict)
    """Those that wait for the sequence lock; an equal one shares the answer."""
    _tasks: set["asyncio.Task[Answers | GatewayError]"] = field(default_factory=set)

    def __post_init__(self) -> None:
        self.line = self._commander.line
        self._by_number = {unit.number: unit for unit in self._units}
        power, edges = self._power, self._edges
        self._learners: Mapping[type[Reply], Sequence[Learn]] = {
            AxisCoordinates: [power.origins.note],
            AxisStatuses: [power.origins.note, edges.note_status],
            SensorStates: [edges.note_sensors],
            AxisTimes: [self._motion.ramps.note],
            SpeedPercents: [power.note_speeds],
        }
        """Who learns from which reply of a unit."""

    async def close(self) -> None:
        """Ask nothing more: once the line is closed all who wait are told so."""
        if self._tasks:
            await asyncio.wait(self._tasks)

    async def ask(
        self, command: FicsCommand[Any], unit: int | None = None, lane: Lane = Lane.READ
    ) -> Answers:
        """Send a command that starts no move, in turn; `lane` is that of a query.

        :raises ControllerRefused: the robot answered `Enn`.
        :raises RobotFailed: it ended with an error of the system.
        :raises Expired: the robot was not free in time.
        :raises GatewayError: it was not sent, or not answered; the error says which.
        """
        number = self._admit(command, unit)
        if command.answered is not WhenAnswered.ALWAYS:
            said, _ = await self._do(command, number)
            return answered_now(said) if isinstance(said, RobotAnswered) else answered_now()
        expires_at = deadline_of(lane)
        if lane is not Lane.READ:
            return await self._put(command, number, lane, expires_at)
        answer = await asyncio.shield(self._shared(command, number, expires_at))
        while isinstance(answer, Expired) and not _is_over(expires_at):  # who asked earlier gives up earlier
            answer = await asyncio.shield(self._shared(command, number, expires_at))
        if isinstance(answer, GatewayError):
            raise answer
        return answer

    async def change(
        self, command: FicsCommand[Any], unit: int | None = None, *, since: int | None = None
    ) -> Any:
        """Send a setting, and give what the robot tells of it then, which agrees; errors as of `ask`, and

        :raises Outdated: something was said `since` what `as_expected` has read; it was not sent.
        :raises NotDone: the robot tells something else.
        :raises NotReadBack: it was sent, and the robot has not told what it is now.
        """
        number = self._admit(command, unit)
        _, found = await self._do(command, number, since=since)
        return found.replies[0]

    async def as_expected(
        self, read: Callable[[], Awaitable[T]], expects: Callable[[T], None] | None
    ) -> int | None:
        """How much was said when what can be read was as expected; None where anything will do.

        :raises Outdated: it is otherwise.
        :raises GatewayError: it was not read.
        """
        if expects is None:
            return None
        said = self.said
        expects(await read())
        return said

    def begin_to_say(self, since: int | None) -> None:
        """Something is about to be said that may change what was read; call it with the sequence lock held.

        :raises Outdated: something else was said `since`.
        """
        if since not in (None, self.said):
            raise Outdated
        self.said += 1

    async def reset_errors(self) -> Answers:
        """Reset the errors of the system, and see whether one still stands (DRT, C-HOST manual 2-14).

        :raises ErrorRemains: its cause is still there.
        :raises NotReadBack: it was done, and nobody knows what still stands.
        :raises GatewayError: it was not done.
        """
        try:
            told = await self.ask(ResetErrors())
        except RobotFailed as failed:
            raise self._remains(failed.error) from None
        try:
            error = await self._errors.take(reset_by="gateway")
        except GatewayError as unread:
            raise NotReadBack(f"The errors of {self._commander.robot_id} were reset", unread) from unread
        if lookup(error).kind is FicsErrorKind.FICS:
            raise self._remains(error)
        return told

    def _remains(self, error: str) -> ErrorRemains:
        return ErrorRemains(self._commander.robot_id, ResetErrors.code, error, self._errors.details_of(error))

    async def see_units(self) -> None:
        """Find out once which of its units the robot has; errors as of `Selection.see_all`."""
        async with self.line.sequence_lock.held(Lane.READ, deadline_of(Lane.READ)):
            if self._motion.moving is False:
                await self._selection.see_all()

    def is_silent(self, unit: int, motor: str) -> bool:
        """Whether the error that stands is that of a driver which does not answer (C-HOST manual 2-13)."""
        error = self._errors.latched
        if error is None or error.kind is not DetailKind.CONNECTION:
            return False
        return error.axis == motor and error.unit in (None, unit)

    def note_change(self) -> None:
        """Settings may be others now."""
        self.settings_changed += 1

    def only_unit(self, command: FicsCommand[Any]) -> int:
        """The unit of a command that names none.

        :raises InvalidRequest: there are several.
        """
        if len(self._units) > 1:
            raise InvalidRequest(
                f"{command.wire_name()} acts on one unit; nothing was sent.", "Say on which."
            )
        return self._units[0].number

    def _admit(self, command: FicsCommand[Any], unit: int | None) -> int | None:
        """Refuse what moves or stops something and what motion forbids, and give the unit to be selected."""
        if command.effect in (Effect.MOTION, Effect.STOP):
            raise InvalidRequest(
                f"{command.wire_name()} moves or stops something and is not merely asked; nothing was sent.",
                "Start a move, or stop the robot.",
            )
        number: int | None = None
        if unit is not None:
            number = unit if unit in self._by_number else unit_of(self._units, unit).number
        elif not (isinstance(command, MOVES_ALL_UNITS) or of_the_robot(type(command))):
            number = self.only_unit(command)
        if self._motion.command is not None:
            self._motion.require_free(command)
        return number

    # actions

    async def _do(
        self, command: FicsCommand[Any], number: int | None, *, since: int | None = None
    ) -> tuple[Outcome, RobotAnswered]:
        """Send a command that changes something, to a unit just confirmed: its answer, and what is read back.

        An answer of Ver.3 does not tell what was heard: a bit may have flipped on the way.
        """
        line, lane = self.line, Lane.COMMAND
        line.require_fit()
        epoch = line.stop_epoch
        with line.sending(lambda: [command]):
            async with line.sequence_lock.held(lane, deadline_of(lane)):
                if line.stop_epoch != epoch:
                    raise line.overtaken()
                if not isinstance(command, SelectUnit):
                    self.begin_to_say(since)
                if number is not None:
                    with preparing(self._commander.robot_id, command):
                        await self._selection.make(number, afresh=True)
                said = await self._commander.say(command, epoch, within_s=TURN_WITHIN_S)
                outcome = await read_back(self._commander, command, said, epoch)
                self._note(command, number, outcome)
        if isinstance(outcome, SystemFailure):
            await self._errors.poll()
        return said, answered(self._commander.robot_id, command, outcome)

    def _note(self, command: FicsCommand[Any], number: int | None, outcome: Outcome) -> None:
        """Note what an action may have changed."""
        if isinstance(command, SelectUnit):
            self._selection.forget()
        if isinstance(command, SetSpeedPercent | SetMotorSpeedPercent) and number is not None:
            self._power.note_set(self._by_number[number], command, outcome)
        if isinstance(command, AxisSetting):
            self.note_change()
        if isinstance(outcome, RobotAnswered):
            self._learn(command, number, outcome.replies)

    def _learn(self, command: FicsCommand[Any], number: int | None, replies: Sequence[Reply]) -> None:
        """Hand what a unit has told to those who learn from it."""
        if number is None:
            return
        for reply in replies:
            for learn in self._learners.get(type(reply), ()):
                learn(self._by_number[number], command, reply)

    # questions

    def _shared(
        self, query: FicsCommand[Any], number: int | None, expires_at: float | None
    ) -> "asyncio.Task[Answers | GatewayError]":
        """The equal question that waits, or a new one."""
        question = (number, query.text())
        if question not in self._waiting:
            asking = self._put_for_all(query, question, expires_at)
            task = asyncio.create_task(asking, name=f"question {query.text()}")
            self._waiting[question] = task
            self._tasks.add(task)
            task.add_done_callback(self._tasks.discard)
        return self._waiting[question]

    async def _put_for_all(
        self, query: FicsCommand[Any], question: Question, expires_at: float | None
    ) -> Answers | GatewayError:
        mine = asyncio.current_task()

        def begun() -> None:
            """Who asks from now on wants a later answer."""
            if self._waiting.get(question) is mine:
                del self._waiting[question]

        try:
            return await self._put(query, question[0], Lane.READ, expires_at, begun)
        except GatewayError as error:
            return error
        finally:
            begun()

    async def _put(
        self,
        query: FicsCommand[Any],
        number: int | None,
        lane: Lane,
        expires_at: float | None,
        begun: Callable[[], object] = lambda: None,
    ) -> Answers:
        line = self.line
        async with line.sequence_lock.held(lane, expires_at):
            begun()
            line.admission.revise()  # after a suspension no unit is trusted
            afresh = isinstance(query, DownloadPositions)
            if number is not None and (afresh or not self._selection.holds(number)):
                with preparing(self._commander.robot_id, query):
                    await self._select(number, afresh=afresh)
            answer = await self._commander.ask(query, within_s=_TURN_WITHIN_S.get(lane))
            self._learn(query, number, answer.replies)
            return answered_now(answer)

    async def _select(self, number: int, *, afresh: bool) -> None:
        """Make sure of the unit whose values are told: no answer tells it, and a loss of power changes it.

        While the terminal is at work the robot does not tell its unit (C-HOST manual 1-7), and the one it has
        told before is trusted.
        """
        selection = self._selection
        try:
            await selection.make(number, afresh=afresh or not selection.is_trusted(number))
        except ControllerRefused as refused:
            if selection.unit != number:
                raise
            selection.trust()
            if refused.error_code == BLOCK_ERRORS[Block.TERMINAL_RUNS]:
                self._motion.note_foreign(moves=True)
