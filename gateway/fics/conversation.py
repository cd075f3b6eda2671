"""All that is said to one robot: questions, settings, and motion commands with all that goes before them."""

import asyncio
from collections.abc import Awaitable, Callable, Iterable, Mapping
from contextlib import AbstractContextManager, suppress
from functools import partial
from typing import Any, Final, NamedTuple, TypeVar

from gateway.core.errors import (
    ControllerRefused,
    Expired,
    GatewayError,
    InvalidRequest,
    NoReply,
)
from gateway.core.exchange import Lane
from gateway.core.move_runs import write_proved
from gateway.core.origin import Origin, acting
from gateway.core.preparation import prepare
from gateway.core.session import READ_REPEATS
from gateway.fics.agreement import READINGS, query_of, tells
from gateway.fics.axes import UnitAxes, unit_of
from gateway.fics.bits import BITS_TOLD_BY
from gateway.fics.errors import (
    ErrorRemains,
    NotDone,
    NotProved,
    NotReadBack,
    RobotFailed,
    UnitMissing,
    answered,
    preparing,
    refuse_before,
)
from gateway.fics.exchange import UNIT, FicsExchange, Outcome, Proof, RobotAnswered, RobotQuestion
from gateway.fics.knowledge import Knowledge
from gateway.fics.line import FicsLine
from gateway.fics.motion_state import MOVES_ALL_UNITS
from gateway.fics.power import SPEEDS, Missing
from protocols.fics.alarms import CurrentError, ErrorDetail, GetErrorDetail, ResetErrors, TakeCurrentError
from protocols.fics.commands import of_the_robot
from protocols.fics.errors import FicsErrorKind, lookup
from protocols.fics.link import FicsRefusal, SystemFailure
from protocols.fics.positions import DownloadPositions, EndPositionUpload
from protocols.fics.row import BLOCK_ERRORS, Block, FicsCommand, WhenAnswered
from protocols.fics.system import CommunicationMode, GetCommunicationMode, HostMode, SelectUnit
from protocols.table import Effect

TURN_WITHIN_S = 5.0
"""A read or a command waits this time for the robot, and then for the line; a move says how long."""
_TURN_WITHIN_S: Final[Mapping[Lane, float]] = dict.fromkeys((Lane.COMMAND, Lane.READ), TURN_WITHIN_S)
ALARM_STANDS = "E02"
"""The refusal of a motion because an error of the system stands (C-HOST manual 2-12)."""
STATE_FORBIDS = ("E01", "E03")
"""The refusals of a command by a state of the system (C-HOST manual 1-7)."""
NOTHING_TOLD: Final = RobotAnswered()

T = TypeVar("T")
Shared = tuple[int | None, str]
"""A unit, or none, and the text of a query."""


class Answers(NamedTuple):
    """The answers of a robot, and the time they came, on the event loop's clock."""

    replies: tuple[Any, ...]
    """Answers as they were read: none after an action, several after a download."""
    at: float
    texts: tuple[str, ...] = ()
    """The text behind the name in each answer, as it came; none where Ver.2 has answered nothing."""


class Accepted(NamedTuple):
    """A motion command that was written: its exchange, and its outcome to come."""

    exchange: FicsExchange
    outcome: "asyncio.Future[Outcome]"
    """Ver.2: only a refusal ever comes here."""

    def was_not_written(self) -> bool:
        """True if it was withdrawn before it was written."""
        outcome = self.outcome.result() if self.outcome.done() else None
        return isinstance(outcome, GatewayError) and outcome.moved == "no"

    def was_refused(self) -> bool:
        """True if nothing moved because of it."""
        return self.outcome.done() and isinstance(self.outcome.result(), FicsRefusal)


def answered_now(answered: RobotAnswered = NOTHING_TOLD) -> Answers:
    """Give an answer as one that came just now."""
    return Answers(answered.replies, asyncio.get_running_loop().time(), answered.texts)


def deadline_of(lane: Lane) -> float | None:
    """Until when a request that comes now may wait; proofs of stops and moves are never too late."""
    within_s = _TURN_WITHIN_S.get(lane)
    return None if within_s is None else asyncio.get_running_loop().time() + within_s


def _is_over(expires_at: float | None) -> bool:
    return expires_at is not None and asyncio.get_running_loop().time() >= expires_at


class Conversation:
    """The conversation with one robot; each series of commands holds the line's sequence lock."""

    def __init__(self, robot_id: str, line: FicsLine, known: Knowledge) -> None:
        self.robot_id = robot_id
        self.line = line
        self.known = known
        self.on_told: Callable[[str, int], object] = lambda _error, _asked_after: None
        """Called with each answer of ERR, to any question, and `FicsLine.unheard` when it was asked."""
        self._waiting: dict[Shared, asyncio.Task[Answers | GatewayError]] = {}
        """Queries that wait for the sequence lock; an equal one shares the answer."""
        self._tasks: set[asyncio.Task[Any]] = set()

    async def close(self) -> None:
        """Look for no more errors, and end once the line is closed and all who wait were told so."""
        if self._tasks:
            await asyncio.wait(self._tasks)

    # one command

    async def say(
        self,
        command: FicsCommand[Any],
        epoch: int | None = None,
        *,
        within_s: float | None = None,
        fresh: bool = False,
        proof: Proof | None = None,
    ) -> Outcome:
        """Send a command that starts no move, unless there was a stop after `epoch`, or it comes too late.

        Without an `epoch` it is that of now. Without `within_s`, how long it may wait, it is never too late.
        In Ver.3 the robot tells what became of it, in Ver.2 ERR does.

        No copy of an earlier answer is taken for one that has to be `fresh`, or is the last of a `proof`.
        """
        is_query = command.answered is WhenAnswered.ALWAYS
        expires_at = None if within_s is None else asyncio.get_running_loop().time() + within_s
        if not is_query:
            epoch = self.line.stop_epoch if epoch is None else epoch
            await self.prepare([self.known.older_error_told])
        outcome: Outcome
        for _ in range(1 + READ_REPEATS):
            exchange = self.line.exchange(command, Lane.READ if is_query else Lane.COMMAND)
            exchange.epoch = exchange.epoch if epoch is None else epoch
            exchange.expires_at = expires_at
            exchange.fresh, exchange.proves = fresh or proof is not None, proof
            outcome = await self.line.say(exchange)
            if not (isinstance(outcome, NoReply) and self.line.may_be_silent(command)):
                break
            outcome = await self._why_unanswered(command, outcome)
            if not isinstance(outcome, NoReply):
                break
        if isinstance(outcome, RobotAnswered) and not outcome.confirmed:
            outcome = await self._verdict(exchange)
        if isinstance(outcome, SystemFailure):
            await self._heed(outcome.error)
        return self.known.bits.read(outcome) if isinstance(command, BITS_TOLD_BY) else outcome

    async def tell(self, command: FicsCommand[Any], epoch: int | None = None, **how: Any) -> RobotAnswered:
        """Send a command as `say` does, and give its answer.

        :raises NoReply: there was none.
        :raises GatewayError: it was refused, it failed, or it was not sent.
        """
        outcome = await self.say(command, epoch, **how)
        return outcome if isinstance(outcome, RobotAnswered) else answered(self.robot_id, command, outcome)

    async def _verdict(self, exchange: FicsExchange) -> Outcome:
        """Ask for the error, in Ver.2 the only way to hear of a refusal (C-HOST manual 1-1-1, 2-12).

        That none is told confirms nothing: the command may have been lost.
        """
        error = self.known.error
        command, cleared, older_may_hide = exchange.command, error.asked_after, error.older_may_hide
        try:
            told = await self._take_error()
        except GatewayError:
            return _nobody_knows(command)
        kind = lookup(told).kind
        if isinstance(command, ResetErrors):
            return _reset_told_by(told)
        if self.line.stop_epoch != exchange.epoch:
            return _nobody_knows(command)  # the error may be that of the stop
        if kind is FicsErrorKind.NONE:
            return RobotAnswered(confirmed=False)
        alone = cleared + 1 == exchange.unheard == error.asked_after
        if kind is FicsErrorKind.UNKNOWN or not alone:
            return _nobody_knows(command)  # it may be that of what else was said, or garbled, since the last
        if kind is FicsErrorKind.COMMUNICATION:
            return _nobody_knows(command) if older_may_hide else FicsRefusal(command.wire_name(), told)
        if command.starts_motion:
            return SystemFailure(command.wire_name(), told)
        return _nobody_knows(command)  # the error stands whatever was said, and hides a refusal

    async def _why_unanswered(self, query: FicsCommand[Any], unanswered: NoReply) -> Outcome:
        """In Ver.2 a question is refused by silence, and ERR tells why (C-HOST manual 1-7)."""
        with suppress(GatewayError):
            error = await self._take_error()
            if error in STATE_FORBIDS:
                self.line.note_forbidden(error)
                return FicsRefusal(query.wire_name(), error)
        return unanswered

    # errors of the system

    async def take_error(
        self, lane: Lane = Lane.COMMAND, expires_at: float | None = None, *, reset_by: str = "elsewhere"
    ) -> str:
        """Ask for the present error; an error of the system is kept and published, and so is its reset.

        :raises GatewayError: it was not told.
        """
        async with self.line.sequence_lock.held(lane, expires_at):
            error = await self._take_error()
            self.known.error.note_looked(error, reset_by)
        return error

    async def poll_error(self) -> str | None:
        """Find out which error stands, and give the answer of ERR.

        None where its answer is lost: then the details still tell of an error (C-HOST manual 2-13).
        """
        try:
            return await self.take_error()
        except NoReply:
            with suppress(GatewayError):
                async with self.line.sequence_lock.held(Lane.COMMAND):
                    await self._keep_error(None)
        except GatewayError:
            return None
        return None

    async def reset_errors(self) -> Answers:
        """Reset the errors of the system, and see whether one still stands (DRT, C-HOST manual 2-14).

        :raises ErrorRemains: its cause is still there.
        :raises NotReadBack: it was done, and the robot has not told what still stands.
        :raises GatewayError: it was not done.
        """
        try:
            told = await self.ask(ResetErrors())
        except RobotFailed as failed:
            raise self._remains(failed.error) from None
        try:
            error = await self.take_error(reset_by="gateway")
        except GatewayError as unread:
            raise NotReadBack(f"The errors of {self.robot_id} were reset", unread) from unread
        if lookup(error).kind is FicsErrorKind.FICS:
            raise self._remains(error)
        return told

    def _remains(self, error: str) -> ErrorRemains:
        return ErrorRemains(self.robot_id, ResetErrors.code, error, self.known.error.details_of(error))

    async def _take_error(self) -> str:
        """Ask for the present error, once: the answer clears what it tells (C-HOST manual 2-12).

        An error of the system is kept before this returns.

        :raises GatewayError: it was not told.
        """
        exchange = self.line.exchange(TakeCurrentError(), Lane.READ)
        asked_after = self.known.error.asked_after

        def written(_: float) -> None:
            nonlocal asked_after
            asked_after = self.line.unheard

        exchange.on_written = written
        reply = answered(self.robot_id, exchange.command, await self.line.say(exchange)).replies[0]
        error = reply.error if isinstance(reply, CurrentError) else "E00"
        self.known.error.note_told(error, asked_after)
        self.on_told(error, asked_after)
        await self._heed(error)
        return error

    async def _heed(self, error: str) -> None:
        if lookup(error).kind is FicsErrorKind.FICS:
            await self._keep_error(error)

    async def _keep_error(self, error: str | None) -> None:
        """Keep and publish an error, once; None where its answer was lost. The sequence lock is held."""
        if not self.known.error.is_known(error):
            self.known.error.keep(error, await self._details())

    async def _details(self) -> ErrorDetail | None:
        """Ask for the details of the latest error (C-HOST manual 2-13); None where they were not told."""
        if self.line.uploading:
            return None  # an upload takes positions only
        query = GetErrorDetail()
        try:
            outcome = await self.line.say(self.line.exchange(query, Lane.READ))
            reply = answered(self.robot_id, query, outcome).replies[0]
        except GatewayError:
            return None
        return reply if isinstance(reply, ErrorDetail) else None

    @acting(Origin("gateway: poll"))
    def _poll_error_soon(self) -> None:
        self._begin(self.poll_error(), f"errors of {self.robot_id}")

    async def leave_refusal(self, lane: Lane) -> int | None:
        """Leave a refusal unread: only ERR and a loss of power clear it (C-HOST manual 2-12).

        It is that of the end of an upload where none is open. Gives `FicsLine.unheard` then, None in trouble.
        """
        try:
            async with self.line.sequence_lock.held(lane):
                exchange = self.line.exchange(EndPositionUpload(), Lane.COMMAND)
                outcome = await self.line.say(exchange)
        except GatewayError:
            return None
        return exchange.unheard if isinstance(outcome, RobotAnswered) else None

    # what commands need

    async def prepare(self, needs: Iterable[Missing]) -> None:
        """Ask for all that a command needs, with the sequence lock held.

        :raises GatewayError: the command must not be sent; the error is that of the need.
        """
        try:
            await prepare(self.line.sequence_lock, needs, self._put)
        except UnitMissing as missing:
            self.known.unit.note_missing(missing.unit)
            raise

    async def _put(self, question: RobotQuestion) -> Outcome:
        if isinstance(question.command, TakeCurrentError):
            return await self._error_or_silence()
        if isinstance(question.command, GetCommunicationMode):
            return await self._ask_mode(question)
        self.known.sent(question)
        outcome = await self.say(question.command, fresh=question.fresh, proof=question.proof)
        self.known.heard(question, outcome)
        return outcome

    async def _error_or_silence(self) -> Outcome:
        try:
            return RobotAnswered((CurrentError(error=await self._take_error()),))
        except NoReply as unanswered:
            return unanswered

    async def _ask_mode(self, question: RobotQuestion) -> Outcome:
        """Ask for the mode; a robot in another one has lost its power, and is set up again."""
        outcome = await self.say(question.command, proof=question.proof)
        reply = outcome.replies[0] if isinstance(outcome, RobotAnswered) else None
        if isinstance(reply, CommunicationMode) and reply.mode != self.line.mode:
            self.line.power_was_lost(f"the robot is in mode {reply.mode}")
        return outcome

    async def select(self, number: int, *, afresh: bool) -> None:
        """Make sure that a unit is selected, with the sequence lock held; errors as of the need.

        `afresh` asks the robot even where the gateway knows.
        """
        await self.prepare([self.known.selected(number, afresh=afresh)])

    async def see_units(self) -> None:
        """Find out once which of its units the robot has, while it stands still; errors as of `select`.

        It acts on the one of before then.
        """
        unit = self.known.unit
        async with self.line.sequence_lock.held(Lane.READ, deadline_of(Lane.READ)):
            if self.known.motion.moving is not False or not (unseen := unit.unseen()):
                return
            await self.prepare([unit.told])
            before = unit.number or 0
            unit.note_seen(before)
            for number in unseen:
                with suppress(UnitMissing):
                    await self.select(number, afresh=False)
            if unit.number != before:
                await self.select(before, afresh=False)

    async def see_power(self, unit: UnitAxes | None = None, *, speeds: bool = True) -> bool:
        """True if the robot proves that it was not switched off; in Ver.2 a `unit` tells by its signs.

        Its `speeds` are one of them, where it is not homed.

        :raises PowerCycled: it was.
        :raises GatewayError: it did not tell.
        """
        async with self.line.sequence_lock.held(Lane.COMMAND):
            if unit is None:
                await self.prepare([self.known.power.mode_kept()])
                return self.line.mode != HostMode.VER_2
            if self.line.mode == HostMode.VER_2:
                await self.select(unit.number, afresh=False)
            return await self._see_signs(unit, speeds=speeds)

    async def _see_signs(self, unit: UnitAxes, *, speeds: bool) -> bool:
        """True if the robot proves that it has kept its power; in Ver.2 by what a loss would take away.

        These are the origins of a unit, or `speeds` below 100 % where it has none. The unit is selected.
        """
        power, absences = self.known.power, self.line.absences
        homed = power.origins.are_known(unit)
        await self.prepare([power.mode_kept()])
        if self.line.mode != HostMode.VER_2:
            return True
        await self.prepare([power.origins_seen(unit)])
        kept = homed and power.origins.are_known(unit)
        if speeds and not homed:
            kept = any(power.is_slower(unit, coordinates) for coordinates in SPEEDS)
            await self.prepare(power.speeds_kept(unit, coordinates) for coordinates in SPEEDS)
        power.require_kept()
        if kept:
            power.settle_doubt(absences)
        return kept

    async def restore_speeds(self) -> None:
        """Set the speeds again that were lost with the power; nothing may move before.

        :raises PowerCycled: it was lost again.
        :raises GatewayError: they are not restored.
        """
        async with self.line.sequence_lock.held(Lane.COMMAND):
            await self.prepare(self.known.speeds_restored())

    # motion

    async def begin(
        self,
        command: FicsCommand[Any],
        unit: UnitAxes,
        *,
        epoch: int,
        expires_at: float,
        on_written: Callable[[float], None],
    ) -> Accepted:
        """Write a motion command at most once, and give its outcome to come; it ends with `end`.

        :raises NotSent: it was not written; the error says why.
        :raises ControllerRefused: the mode, the speeds or the unit could not be made sure of.
        """

        def note(now: float) -> None:
            self.known.moves(command, unit.number)
            on_written(now)

        async with self.line.sequence_lock.held(Lane.COMMAND, expires_at):
            return await write_proved(
                partial(self._prove, command, unit, epoch),
                lambda proof: self._start(command, epoch, expires_at, proof, note),
                disproved=(NotProved,),
                expires_at=expires_at,
                waits_for="robot",
            )

    async def _prove(self, command: FicsCommand[Any], unit: UnitAxes, epoch: int) -> Proof:
        """Make sure of everything a motion depends on; errors as of `begin`."""
        if self.line.stop_epoch != epoch:
            raise self.line.overtaken()
        self.known.require_fit(command)
        joining = self.known.motion.command is not None
        signs = self.known.power.signs(command, unit, joining=joining)
        proof = self.line.begin_proof(command, UNIT, *signs)
        await self.prepare(self.known.of_motion(command, unit, proof))
        return proof

    async def _start(
        self,
        command: FicsCommand[Any],
        epoch: int,
        expires_at: float,
        proof: Proof,
        on_written: Callable[[float], None],
    ) -> Accepted:
        """Write a motion command at most once, and give what will become of it.

        It is withdrawn if it cannot be written in time, or if its caller has gone. In Ver.2 only a
        refusal ever comes.

        :raises NotProved: the proof does not hold any more; it was not written.
        """
        exchange = self.line.exchange(command, Lane.COMMAND)
        exchange.epoch, exchange.expires_at, exchange.needs = epoch, expires_at, proof
        written: asyncio.Future[None] = asyncio.get_running_loop().create_future()

        def note(now: float) -> None:
            written.set_result(None)
            on_written(now)

        exchange.on_written = note
        outcome = self.line.submit(exchange)
        either: set[asyncio.Future[Any]] = {written, outcome}
        try:
            await asyncio.wait(either, return_when=asyncio.FIRST_COMPLETED)
        except asyncio.CancelledError:
            self.line.forsake(exchange)
            raise
        if outcome.done() and isinstance(error := outcome.result(), NotProved):
            raise error
        if self.line.mode == HostMode.VER_2 and written.done():
            outcome = await self._silent_outcome(exchange)
        outcome.add_done_callback(self._heed_alarm)
        return Accepted(exchange, outcome)

    async def _silent_outcome(self, exchange: FicsExchange) -> "asyncio.Future[Outcome]":
        future: asyncio.Future[Outcome] = asyncio.get_running_loop().create_future()
        verdict = await self._verdict(exchange)
        if not isinstance(verdict, RobotAnswered):
            future.set_result(verdict)
        return future

    def _heed_alarm(self, motion: "asyncio.Future[Outcome]") -> None:
        """Look for the error that has refused a motion, where it is not read yet."""
        outcome = None if motion.cancelled() else motion.result()
        if isinstance(outcome, FicsRefusal) and outcome.error == ALARM_STANDS:
            self._poll_error_soon()

    def end(self, accepted: Accepted | None = None) -> None:
        """The motion command that was begun is over; an answer it still owes is no longer waited for."""
        self.known.motion.end(refused=accepted is not None and accepted.was_refused())
        if accepted is not None and not accepted.outcome.done():
            self.line.give_up(accepted.exchange)

    def sending(self, command: FicsCommand[Any], unit: UnitAxes) -> AbstractContextManager[None]:
        """Wait for the disk once, for a motion command and for all that has to go before it."""
        power = self.known.power
        return self.line.sending(lambda: [*power.restoring(), SelectUnit(unit=unit.number), command])

    # questions and settings

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
            return await self._ask(command, number, lane, expires_at)
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
        """Require a reading to be as expected; gives the count of commands before it, or None.

        :raises Outdated: it is otherwise.
        :raises GatewayError: it was not read.
        """
        if expects is None:
            return None
        said = self.known.said
        expects(await read())
        return said

    def only_unit(self, command: FicsCommand[Any]) -> int:
        """The unit of a command that names none.

        :raises InvalidRequest: there are several.
        """
        if len(self.known.units) > 1:
            raise InvalidRequest(
                f"{command.wire_name()} acts on one unit; nothing was sent.", "Say on which."
            )
        return next(iter(self.known.units))

    def _admit(self, command: FicsCommand[Any], unit: int | None) -> int | None:
        """Refuse what moves or stops something and what motion forbids, and give the unit to be selected."""
        if command.effect in (Effect.MOTION, Effect.STOP):
            raise InvalidRequest(
                f"{command.wire_name()} moves or stops something and is not merely asked; nothing was sent.",
                "Start a move, or stop the robot.",
            )
        number: int | None = None
        if unit is not None:
            number = unit if unit in self.known.units else unit_of(self.known.power.units, unit).number
        elif not (isinstance(command, MOVES_ALL_UNITS) or of_the_robot(type(command))):
            number = self.only_unit(command)
        if self.known.motion.command is not None:
            self.known.motion.require_free(command)
        return number

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
                    self.known.begin_to_say(since)
                if number is not None:
                    with preparing(self.robot_id, command):
                        await self.select(number, afresh=True)
                said = await self.say(command, epoch, within_s=TURN_WITHIN_S)
                outcome = await self._read_back(command, said, epoch)
                self.known.acted(command, number, outcome)
        if isinstance(outcome, SystemFailure):
            await self.poll_error()
        return said, answered(self.robot_id, command, outcome)

    async def _read_back(self, command: FicsCommand[Any], said: Outcome, epoch: int) -> Outcome:
        """Give what has become of a command that was `said`: its answer is then what was read back.

        Silence and E00 confirm nothing (C-HOST manual 1-1-1). A refusal stands, and so does what was not
        sent. The sequence lock is held, and the unit is selected.
        """
        if isinstance(said, FicsRefusal | SystemFailure) or (
            isinstance(said, GatewayError) and not isinstance(said, NoReply)
        ):
            return said
        sent = f"{command.text} was sent to {self.robot_id}"
        query = query_of(command)
        if query is None:
            return said if isinstance(said, NoReply) or said.confirmed else _unproved(sent, command)
        if self.line.stop_epoch != epoch:
            return (
                said if isinstance(said, NoReply) else NotReadBack(sent, GatewayError("a stop came first."))
            )
        for _ in range(READINGS):
            try:
                answer = await self.tell(query, epoch, fresh=True)
            except GatewayError as unread:
                return said if isinstance(said, NoReply) else NotReadBack(sent, unread)
            (reply,) = answer.replies
            if tells(command, reply):
                return answer
        told = f"{query.wire_name()} {reply.written()}"
        return NotDone(f"{sent}, and it tells {told}: that was not done as asked.", command)

    def _shared(
        self, query: FicsCommand[Any], number: int | None, expires_at: float | None
    ) -> "asyncio.Task[Answers | GatewayError]":
        """The equal question that waits, or a new one."""
        question = (number, query.text)
        if question not in self._waiting:
            asking = self._ask_for_all(query, question, expires_at)
            self._waiting[question] = self._begin(asking, f"question {query.text}")
        return self._waiting[question]

    async def _ask_for_all(
        self, query: FicsCommand[Any], question: Shared, expires_at: float | None
    ) -> Answers | GatewayError:
        mine = asyncio.current_task()

        def begun() -> None:
            """Let later callers wait for a later answer."""
            if self._waiting.get(question) is mine:
                del self._waiting[question]

        try:
            return await self._ask(query, question[0], Lane.READ, expires_at, begun)
        except GatewayError as error:
            return error
        finally:
            begun()

    async def _ask(
        self,
        query: FicsCommand[Any],
        number: int | None,
        lane: Lane,
        expires_at: float | None,
        begun: Callable[[], object] = lambda: None,
    ) -> Answers:
        async with self.line.sequence_lock.held(lane, expires_at):
            begun()
            self.line.admission.revise()  # after a suspension no unit is trusted
            afresh = isinstance(query, DownloadPositions)
            if number is not None and (afresh or not self._holds(number)):
                await self._select_to_read(query, number, afresh=afresh)
            answer = await self.tell(query, within_s=_TURN_WITHIN_S.get(lane))
            self.known.replied(query, number, answer.replies)
            return answered_now(answer)

    def _holds(self, number: int) -> bool:
        """True if a question can be put to a unit as things are."""
        unit = self.known.unit
        is_known = unit.number == number or unit.is_alone
        return is_known and (self.known.motion.command is not None or self._is_trusted())

    def _is_trusted(self) -> bool:
        """True if the robot has told its unit a moment ago, or keeps it: it moves, or has no other."""
        unit, now = self.known.unit, asyncio.get_running_loop().time()
        holds = bool(self.known.motion.foreign) or now < unit.holds_until
        return (unit.number is not None and holds) or unit.is_alone

    async def _select_to_read(self, query: FicsCommand[Any], number: int, *, afresh: bool) -> None:
        """Make sure of the unit whose values are told: no answer tells it, and a loss of power changes it.

        While the terminal is at work the robot does not tell its unit (C-HOST manual 1-7), and the one it has
        told before is trusted.
        """
        unit = self.known.unit
        try:
            await self.select(number, afresh=afresh or not self._is_trusted())
        except ControllerRefused as refused:
            if unit.number != number:
                refuse_before(self.robot_id, query, refused)
            unit.trust()
            if refused.error_code == BLOCK_ERRORS[Block.TERMINAL_RUNS]:
                self.known.motion.note_foreign(moves=True)

    def _begin(self, work: Any, name: str) -> "asyncio.Task[Any]":
        task = asyncio.create_task(work, name=name)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
        return task


def _reset_told_by(error: str) -> Outcome:
    """Tell the outcome of DRT, which nothing forbids, by whether an error stands (C-HOST manual 1-7, 2-14).

    A refusal is that of an older command, which the error has hidden; it stands no more.
    """
    kind = lookup(error).kind
    if kind is FicsErrorKind.UNKNOWN:
        return _nobody_knows(ResetErrors())
    return SystemFailure(ResetErrors.code, error) if kind is FicsErrorKind.FICS else RobotAnswered()


def _nobody_knows(command: FicsCommand[Any]) -> NoReply:
    return NoReply(
        f"{command.wire_name()} was sent, and in Ver.2 nobody can tell whether it was refused.",
        "Read back what it should have changed, and the errors of the robot.",
        command,
    )


def _unproved(sent: str, command: FicsCommand[Any]) -> NoReply:
    return NoReply(
        f"{sent}, which Ver.2 does not answer, and nothing tells whether it was done.",
        "Look whether it was.",
        command,
    )
