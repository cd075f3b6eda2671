"""Saying one command and finding out what became of it: in Ver.3 the robot tells, in Ver.2 ERR does."""

import asyncio
from collections.abc import Awaitable, Callable
from contextlib import suppress
from typing import Any

from gateway.core.errors import GatewayError, NoReply, NotSent
from gateway.core.lanes import Lane
from gateway.core.session import READ_REPEATS
from gateway.fics.bits import BITS_TOLD_BY, Bits
from gateway.fics.errors import NotProved
from gateway.fics.exchange import FicsExchange, Outcome, Proof, RobotAnswered, answered
from gateway.fics.line import FicsLine
from protocols.fics.alarms import (
    CurrentError,
    ErrorDetail,
    GetErrorDetail,
    ResetErrors,
    TakeCurrentError,
)
from protocols.fics.errors import FicsErrorKind, lookup
from protocols.fics.link import FicsRefusal, SystemFailure
from protocols.fics.positions import EndPositionUpload
from protocols.fics.row import FicsCommand, WhenAnswered
from protocols.fics.system import HostMode

ALARM_STANDS = "E02"
"""The refusal of a motion because an error of the system stands (C-HOST manual 2-12)."""
STATE_FORBIDS = ("E01", "E03")
"""The refusals of a command by a state of the system (C-HOST manual 1-7)."""


async def _unheeded(_: str) -> None:
    """Nobody keeps errors of the system."""


class Commander:
    """What is said to a robot, a command at a time, with the line's sequence lock held."""

    def __init__(self, robot_id: str, line: FicsLine, bits: Bits | None = None) -> None:
        self.robot_id = robot_id
        self.line = line
        self.bits = bits or Bits()
        self._asked_after = 0
        """What `FicsLine.unheard` was when the error was last asked for."""
        self._older_may_hide = False
        """Whether the last answer was an error that stands: behind it an older refusal may still wait."""
        self.on_error: Callable[[str], Awaitable[None]] = _unheeded
        """Called with every error of the system that is read, with the sequence lock held."""
        self.on_told: Callable[[str, int], object] = lambda _error, _asked_after: None
        """Called with each answer of ERR, to any question, and what `FicsLine.unheard` was then."""
        self.on_alarm: Callable[[], object] = lambda: None
        """Called when a motion was refused because of an error that is not read yet."""

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

        No copy of an earlier answer is taken for one that has to be `fresh`, or is the last of a `proof`.
        """
        is_query = command.answered is WhenAnswered.ALWAYS
        expires_at = None if within_s is None else asyncio.get_running_loop().time() + within_s
        if not is_query:
            epoch = self.line.stop_epoch if epoch is None else epoch
            await self.clear_error()
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
        return self.bits.read(outcome) if isinstance(command, BITS_TOLD_BY) else outcome

    async def ask(
        self,
        command: FicsCommand[Any],
        epoch: int | None = None,
        *,
        within_s: float | None = None,
        fresh: bool = False,
        proof: Proof | None = None,
    ) -> RobotAnswered:
        """Send a command as `say` does, and give its answer.

        :raises NoReply: there was none.
        :raises GatewayError: it was refused, it failed, or it was not sent.
        """
        outcome = await self.say(command, epoch, within_s=within_s, fresh=fresh, proof=proof)
        return answered(self.robot_id, command, outcome)

    async def start(
        self,
        command: FicsCommand[Any],
        *,
        epoch: int,
        expires_at: float,
        proof: Proof,
        on_written: Callable[[float], None],
    ) -> "tuple[FicsExchange, asyncio.Future[Outcome]]":
        """Write a motion command at most once, and give what will become of it.

        It is withdrawn if it cannot be written in time, or if nobody waits for that any more. In Ver.2 only a
        refusal ever comes, and `see_error` goes before.

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
        return exchange, outcome

    async def take_error(self) -> str:
        """Ask for the present error, once: the answer clears what it tells (C-HOST manual 2-12).

        An error of the system goes to `on_error` before this returns.

        :raises GatewayError: it was not told.
        """
        exchange = self.line.exchange(TakeCurrentError(), Lane.READ)
        asked_after = self._asked_after

        def written(_: float) -> None:
            nonlocal asked_after
            asked_after = self.line.unheard

        exchange.on_written = written
        reply = answered(self.robot_id, exchange.command, await self.line.say(exchange)).replies[0]
        self._asked_after = asked_after
        error = reply.error if isinstance(reply, CurrentError) else "E00"
        self._older_may_hide = lookup(error).kind is FicsErrorKind.FICS
        self.on_told(error, asked_after)
        await self._heed(error)
        return error

    async def leave_refusal(self) -> int | None:
        """Leave a refusal that nobody reads: only ERR and a loss of power clear it (C-HOST manual 2-12).

        It is that of the end of an upload where none is open. Gives what `FicsLine.unheard` is then, or None
        where it was not sent.
        """
        exchange = self.line.exchange(EndPositionUpload(), Lane.COMMAND)
        outcome = await self.line.say(exchange)
        return exchange.unheard if isinstance(outcome, RobotAnswered) else None

    async def _heed(self, error: str) -> None:
        if lookup(error).kind is FicsErrorKind.FICS:
            await self.on_error(error)

    async def take_detail(self) -> ErrorDetail | None:
        """Ask for the details of the latest error (C-HOST manual 2-13).

        :raises GatewayError: they were not told.
        """
        query = GetErrorDetail()
        outcome = await self.line.say(self.line.exchange(query, Lane.READ))
        reply = answered(self.robot_id, query, outcome).replies[0]
        return reply if isinstance(reply, ErrorDetail) else None

    async def clear_error(self) -> None:
        """In Ver.2: see that no refusal of an earlier command is taken for that of the next.

        :raises NotSent: the robot did not tell its error, so the next command must not be sent.
        """
        if self.line.mode == HostMode.VER_2 and self.line.unheard != self._asked_after:
            await self.see_error()

    async def see_error(self) -> None:
        """Ask for the error before a command: in Ver.2 one that stands would hide its refusal.

        :raises NotSent: the robot did not tell its error, so the command must not be sent.
        """
        try:
            await self.take_error()
        except NoReply:
            raise NotSent(
                f"Robot {self.robot_id} did not tell its last error, so nobody could tell whether it "
                "refuses the command; nothing was sent.",
                "Try again.",
            ) from None

    async def _verdict(self, exchange: FicsExchange) -> Outcome:
        """Ask for the error, in Ver.2 the only way to hear of a refusal (C-HOST manual 1-1-1, 2-12).

        That none is told confirms nothing: the command may have been lost.
        """
        command, cleared, older_may_hide = exchange.command, self._asked_after, self._older_may_hide
        try:
            error = await self.take_error()
        except GatewayError:
            return _nobody_knows(command)
        kind = lookup(error).kind
        if isinstance(command, ResetErrors):
            return _reset_told_by(error)
        if self.line.stop_epoch != exchange.epoch:
            return _nobody_knows(command)  # the error may be that of the stop
        if kind is FicsErrorKind.NONE:
            return RobotAnswered(confirmed=False)
        alone = cleared + 1 == exchange.unheard == self._asked_after
        if kind is FicsErrorKind.UNKNOWN or not alone:
            return _nobody_knows(command)  # it may be that of what else was said, or garbled, since the last
        if kind is FicsErrorKind.COMMUNICATION:
            return _nobody_knows(command) if older_may_hide else FicsRefusal(command.wire_name(), error)
        if command.starts_motion():
            return SystemFailure(command.wire_name(), error)
        return _nobody_knows(command)  # the error stands whatever was said, and hides a refusal

    async def _why_unanswered(self, query: FicsCommand[Any], unanswered: NoReply) -> Outcome:
        """In Ver.2 a question is refused by silence, and ERR tells why (C-HOST manual 1-7)."""
        with suppress(GatewayError):
            error = await self.take_error()
            if error in STATE_FORBIDS:
                self.line.note_forbidden(error)
                return FicsRefusal(query.wire_name(), error)
        return unanswered

    def _heed_alarm(self, motion: "asyncio.Future[Outcome]") -> None:
        outcome = None if motion.cancelled() else motion.result()
        if isinstance(outcome, FicsRefusal) and outcome.error == ALARM_STANDS:
            self.on_alarm()

    async def _silent_outcome(self, exchange: FicsExchange) -> "asyncio.Future[Outcome]":
        future: asyncio.Future[Outcome] = asyncio.get_running_loop().create_future()
        verdict = await self._verdict(exchange)
        if not isinstance(verdict, RobotAnswered):
            future.set_result(verdict)
        return future


def _reset_told_by(error: str) -> Outcome:
    """What became of DRT, which nothing forbids: whether an error stands tells (C-HOST manual 1-7, 2-14).

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
