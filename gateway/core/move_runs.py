"""How a move runs: it is queued, prepared, written, followed until it rests, judged, and recorded.

`MoveRuns` keeps all moves of a family. A `Motion` is one command on its way: it asks for what is missing, and
is written. It starts a move for each part that it moves; a `MoveRun` looks at one until it rests, and brings
the finding about its end, which the table of verdicts judges.
"""

import asyncio
import logging
from abc import ABC, abstractmethod
from collections.abc import Awaitable, Callable, Coroutine, Mapping, Sequence
from contextlib import AbstractAsyncContextManager, nullcontext
from dataclasses import dataclass, field
from datetime import UTC, datetime
from functools import partial
from typing import Any, ClassVar, Final, Generic, NamedTuple, Protocol, TypeVar, cast

from gateway.core.errors import (
    ControllerRefused,
    Expired,
    GatewayError,
    NoReply,
    refused_in_motion,
    restarted_in_motion,
)
from gateway.core.events import Event
from gateway.core.journal.intents import OF_MOVES
from gateway.core.move_log import MoveLog, Trajectories
from gateway.core.move_record import LOST_AFTER_S, MoveError, MoveRecord, MoveStatus
from gateway.core.next_calls import NextCall
from gateway.core.origin import working
from gateway.core.supervisor import Deed, FaultsTo, insist
from gateway.core.verdicts import (
    Begun,
    Finding,
    Heard,
    Judged,
    Sight,
    Stop,
    Unbegun,
    Unseen,
    Unwatched,
    VerdictWords,
    judge,
)

log = logging.getLogger(__name__)

OUT_OF_REACH_S: Final = 300.0
"""Seconds out of reach after which a move is followed no more, and its end is unknown."""

GiveUp = Callable[[str], None]
"""Gives moves up as unknown, with the reason."""
Beginning = asyncio.Future[GatewayError | None]
"""The beginning of a motion: done when it is taken, or refused with an error."""

M = TypeVar("M", bound=MoveRecord)
T = TypeVar("T")


class Found(NamedTuple):
    """A finding about the end of a move, and what its sentences need."""

    finding: Finding
    given: GatewayError | None
    """The error that was told of this one command."""
    words: Mapping[str, Any]


def found(finding: Finding, given: GatewayError | None = None, **words: Any) -> Found:
    """Give a finding with the words of its sentences."""
    return Found(finding, given, words)


class Silence:
    """Counts the questions that were not answered, in seconds. It has no clock: times are given.

    Only what was written to a line that works counts as silence of the part. A line that is down, crowded or
    garbled, or a gateway that was held up, does not: that counts as being out of reach.
    """

    def __init__(self, now: float) -> None:
        self._counted_until = now
        self.silent_s = 0.0
        self.out_of_reach_s = 0.0

    def answered(self, now: float) -> None:
        """The part has answered."""
        self._counted_until = now
        self.silent_s = self.out_of_reach_s = 0.0

    def unanswered(self, now: float, longest_s: float, *, silent: bool) -> None:
        """Note that it has not answered: because it is silent, or because it could not be asked.

        A question counts for `longest_s` seconds at most.
        """
        passed_s = min(now - self._counted_until, longest_s)
        self._counted_until = now
        if silent:
            self.silent_s += passed_s
        else:
            self.out_of_reach_s += passed_s

    @property
    def of_body(self) -> bool:
        """True if the part itself has been silent too long."""
        return self.silent_s >= LOST_AFTER_S

    @property
    def too_long(self) -> bool:
        """True if more questions are no use."""
        return self.of_body or self.out_of_reach_s >= OUT_OF_REACH_S

    @property
    def told(self) -> str:
        """Say for how long the part was not heard, as a sentence without its subject."""
        if self.of_body:
            return f"has not answered for {self.silent_s:.0f} s"
        return f"could not be asked for {self.out_of_reach_s:.0f} s"


class Look(Protocol):
    """The answer to a question how a motor is."""

    @property
    def runs(self) -> bool:
        """True while it has yet to come to rest."""


S = TypeVar("S", bound=Look)


class MoveRun(ABC, Generic[M, S]):
    """One move of one part, from its queue to its end."""

    controller: ClassVar[str]
    """Noun for the one who is asked, such as `the robot`."""
    _sight_acknowledges: ClassVar[bool] = False
    """True if a command is acknowledged by the motion that it makes."""

    def __init__(
        self,
        moves: "MoveRuns[M]",
        move: M,
        part: Any,
        line: Any,
        who: str,
        every_s: float,
    ) -> None:
        """`part` has one `move` at a time, and lets no other begin from its `claim` to its `release`.

        `who` is the address that is asked, `every_s` the pause between two looks.
        """
        self.move: M = move
        self.line, self.who = line, who
        self._moves, self._part, self._every_s = moves, part, every_s
        self.over = False
        self._doubt: NoReply | None = None
        """The reason why it is unknown if the command was executed."""
        self._silence = Silence(asyncio.get_running_loop().time())

    # what a family brings: news of the part

    def _free(self) -> tuple[Deed, ...]:
        """Let another move begin, and name what is to be done then."""
        self._part.release()
        return ()

    def _calls(self, error: GatewayError, /) -> Sequence[NextCall]:
        """The calls that help where the move did not succeed."""
        return error.next

    def _was_sent(self) -> None:
        """Note that the command is on the wire."""

    def _was_refused(self, error: GatewayError, /) -> bool:
        """Say whether an error is the controller's refusal of this command."""
        return isinstance(error, ControllerRefused)

    def _lose(self, why: str, /) -> None:
        """Follow the move no more: what it has not written yet never is."""

    # what a family brings: the way to the end

    @abstractmethod
    async def _look(self) -> S | None:
        """Ask how the motor is; None when there was silence for too long."""

    @abstractmethod
    async def _finding(self, seen: S, /) -> Found:
        """Find out how the move has ended that came to rest."""

    @abstractmethod
    def _words(self) -> VerdictWords:
        """The words of the family in the sentences of a verdict."""

    async def _resolve(self, _doubt: NoReply, /) -> Found | None:
        """Find out if a command without a usable reply was executed; None: look as if it was."""
        return None

    async def look_into(self, refusal: ControllerRefused) -> GatewayError:
        """Look into a refusal: what counts in its place."""
        return refusal

    async def _pause(self) -> None:
        """Wait until it is to be looked at again."""
        await asyncio.sleep(self._every_s)

    def _gives_up(self) -> bool:
        """Say after a question without an answer whether more are no use."""
        return False

    def _unseen(self) -> Found:
        """The finding about a move whose end was not seen."""
        return self._out_of_sight()

    # followed

    async def follow(self, doubt: NoReply | None = None) -> None:
        """Look until it rests, and end the move by what is found; `doubt`: no usable reply came."""
        self._doubt = doubt
        with working("followers"):
            ending = None if doubt is None else await self._resolve(doubt)
            if ending is None:
                seen = await self._come_to_rest()
                ending = self._unseen() if seen is None else await self._finding(seen)
        self.end(ending)

    async def _come_to_rest(self) -> S | None:
        """Look until it rests, and give the last answer; None when there was silence for too long."""
        while (seen := await self._look()) is not None and seen.runs:
            self._seen_to_move()
            await self._pause()
        return seen

    async def _answer_to(self, question: Callable[[], Awaitable[T]]) -> T | None:
        """Repeat a question until it is answered; None when there was silence for too long."""
        loop, line = asyncio.get_running_loop(), self.line
        while not self._silence.too_long:
            try:
                answer = await question()
            except GatewayError as error:
                longest_s = line.reply_timeout_s + line.late_reply_s + self._every_s
                self._silence.unanswered(loop.time(), longest_s, silent=line.shows_silence(error))
                if self._gives_up():
                    return None
                await asyncio.sleep(self._every_s)
            else:
                self._silence.answered(loop.time())
                return answer
        return None

    def _out_of_sight(self, heard: Heard = Heard.NOTHING, stop: Stop = Stop.NONE, **words: object) -> Found:
        sight = Sight.SILENT if self._silence.of_body else Sight.OUT_OF_REACH
        begun = Begun.SEEN if self._doubt is None else Begun.IN_DOUBT
        return found(Unseen(sight, heard, stop, begun), self._doubt, **{"who": self.who, **words})

    def _unbegun(self, error: GatewayError) -> Found:
        return found(Unbegun.REFUSED if self._was_refused(error) else Unbegun.WITHHELD, error)

    def _executed_after_all(self, refusal: str | None, motor: str) -> NoReply:
        """Note that a refusal as in motion hides a motion, and give the error that counts in its place."""
        self.move.evidence.append(
            f"It refused {self.move.command} as in motion ({refusal}), and had stood still: the line has "
            f"doubled the command, or something else moves the {motor}."
        )
        return refused_in_motion(self.move.body_id, self.move.command)

    # recorded

    def queue(self) -> None:
        """Let no other move of the part begin, and begin the record of this one."""
        self._part.claim(self.move)
        self._moves.log.add(self.move)
        self.move.event_cursor = self._tell("queued").cursor
        self._moves.log.on_change(self.move)

    def advance(self, status: MoveStatus, error: GatewayError | None = None) -> None:
        """The only place where a move changes its status."""
        move = self.move
        if error is not None:
            move.error = MoveError.of(error, self._calls(error))
        move.status = status
        if status is MoveStatus.SENT:
            move.sent_at = datetime.now(UTC)
            self._was_sent()
        elif status.final:
            self.over, move.ended_at = True, datetime.now(UTC)
            insist(f"the end of move {move.id}", self._free)
            self._moves.log.end(move)
        self._tell("started" if status is MoveStatus.MOVING else status)
        self._moves.log.on_change(move)

    def sent(self, _at: float) -> None:
        """Its command is on the wire."""
        self.advance(MoveStatus.SENT)

    def _tell(self, news: str) -> Event:
        return self._moves.tell(news, self._part, self.move)

    def _seen_to_move(self) -> None:
        """Note that its motor was seen to run; that is told once."""
        move = self.move
        if move.status is MoveStatus.SENT:
            if self._sight_acknowledges:
                move.acknowledged_at = move.acknowledged_at or datetime.now(UTC)
            self.advance(MoveStatus.MOVING)

    def hear(self, reply: object, *, written: bool) -> None:
        """Note the reply to its command; an error ends a move that never began, but for a lost reply."""
        if not isinstance(reply, GatewayError):
            self.move.acknowledged_at = datetime.now(UTC)
        elif not isinstance(reply, NoReply) or (self.move.status is MoveStatus.QUEUED and not written):
            self.end(self._unbegun(reply))

    def end(self, ending: Found) -> None:
        """End the move as the table judges the finding, unless it is over."""
        if self.over:
            return
        words = self._words()._replace(**{"unheard": self._silence.told, **ending.words})
        verdict = judge(ending.finding, words, ending.given)
        verdict.write_down(cast("Judged", self.move))  # each family describes its causes
        self.advance(verdict.status, verdict.error)

    def give_up(self, why: str) -> None:
        """End it as unknown, unless its part is free of it."""
        self._lose(why)
        if self._part.move is self.move:
            self.end(found(Unwatched.FAULT, why=why))

    def go_on(self, since: str, *, begun: bool) -> bool:
        """Say whether to follow it on after another life of the gateway; unwritten, it is over.

        `begun` says whether an intent of it was written, `since` the reason.
        """
        move = self.move
        self._part.claim(self.move)
        if move.status is MoveStatus.QUEUED and not begun:
            self.end(found(Unbegun.GATEWAY_ENDED))
            return False
        if move.status is MoveStatus.QUEUED:
            move.status = MoveStatus.SENT
            move.evidence.append("The journal does not tell whether the command was written.")
        move.evidence.append(
            f"{since[0].upper()}{since[1:]} in the middle of the move; {self.controller} was asked."
        )
        return True


R = TypeVar("R", bound=MoveRun[Any, Any])
P = TypeVar("P")
"""The proof of what a motion depends on."""


async def write_proved(
    prove: Callable[[], Coroutine[Any, Any, P]],
    write: Callable[[P], Awaitable[T]],
    *,
    disproved: tuple[type[GatewayError], ...],
    expires_at: float,
    waits_for: str = "line",
) -> T:
    """Prove what a command depends on and write it; ask all again as often as the proof does not hold.

    `write` raises one of `disproved` where the proof holds no more and nothing was written. `waits_for` is
    what was not free where that takes too long.

    :raises Expired: the proof took too long, and none was disproved.
    :raises GatewayError: the command was not written; the last `disproved` where the time was up after it.
    """
    doubt: GatewayError | None = None
    while True:
        try:
            return await write(await in_time(expires_at, prove(), waits_for))
        except disproved as error:
            doubt = error
        except Expired as late:
            raise (doubt or late) from None


async def in_time(expires_at: float, preparation: Coroutine[Any, Any, T], waits_for: str = "line") -> T:
    """Do what goes before a command, until the command would come too late.

    :raises Expired: it took too long.
    """
    try:
        async with asyncio.timeout_at(expires_at):
            return await preparation
    except TimeoutError:
        raise Expired(waits_for) from None


@dataclass(eq=False)
class Motion(ABC, Generic[R, P]):
    """One motion command on its way, with the run of each move that it starts."""

    _disproved: ClassVar[tuple[type[GatewayError], ...]] = ()
    """The errors of a writing whose proof does not hold any more: all is asked again."""
    _waits_for: ClassVar[str] = "line"
    """Noun for what was not free where a motion comes too late."""

    runs: Sequence[R]
    taken: Beginning = field(init=False)
    """The beginning of the motion, from its queue on."""
    written: bool = field(default=False, init=False)
    """True if the command is on the wire, whatever status a fault of the gateway has left its moves in."""

    @abstractmethod
    async def _prepare(self) -> P:
        """Ask for all that is missing before the command is written.

        :raises GatewayError: it must not be written.
        """

    @abstractmethod
    async def _write(self, proof: P, expires_at: float) -> Mapping[R, object]:
        """Write the command in time, at most once, and give the replies that came, or errors, by run.

        A run without a reply here tells the caller as it is followed.

        :raises GatewayError: it was not written, or no controller has answered.
        """

    def _held(self, _expires_at: float) -> AbstractAsyncContextManager[object]:
        """Hold what is held from the first question until the command is written."""
        return nullcontext()

    async def make(self, start_within_s: float) -> None:
        """Prepare and write it, and follow each of its moves to the end."""
        OF_MOVES.set([run.move.id for run in self.runs])
        expires_at = asyncio.get_running_loop().time() + start_within_s
        replies: Mapping[R, object]
        try:
            async with self._held(expires_at):
                replies = await write_proved(
                    self._prepare,
                    lambda proof: self._write(proof, expires_at),
                    disproved=self._disproved,
                    expires_at=expires_at,
                    waits_for=self._waits_for,
                )
        except GatewayError as error:
            replies = dict.fromkeys(self.runs, error)
        heard = await self._hear(replies)
        following = [self._follow(run, heard.get(run)) for run in self.runs if not run.over]
        await (following[0] if len(following) == 1 else asyncio.gather(*following))  # alone, without a task

    def was_written(self, at: float) -> None:
        """Note that the command is on the wire: before all else, for what follows may meet a fault."""
        self.written = True
        for run in self.runs:
            self._sent(run, at)

    def _sent(self, run: R, at: float) -> None:
        """Note for one move that the command is on the wire."""
        run.sent(at)

    async def _hear(self, replies: Mapping[R, object]) -> Mapping[R, object]:
        """Take the replies, refusals last, for these are looked into; and tell the caller."""
        heard = dict(replies)
        for run in sorted(heard, key=lambda run: isinstance(heard[run], ControllerRefused)):
            reply = heard[run]
            if isinstance(reply, ControllerRefused):
                heard[run] = reply = await run.look_into(reply)
            run.hear(reply, written=self.written)
        if heard:
            refusals = [reply for run, reply in heard.items() if run.over]
            nobody = all(run.move.sent_at is None for run in self.runs)
            counts = refusals and (len(self.runs) == 1 or nobody)  # of several, what moves is no refusal
            self.answer(cast("GatewayError", refusals[0]) if counts else None)
        return heard

    @staticmethod
    async def _follow(run: R, reply: object) -> None:
        """Follow a move; a fault of the gateway itself ends the watch over this one alone."""
        with FaultsTo(lambda fault: _not_followed(run.move.id, fault, run.give_up)):
            await run.follow(reply if isinstance(reply, NoReply) else None)

    def answer(self, refusal: GatewayError | None) -> None:
        """Tell the caller that it is taken, or why not; the first answer counts."""
        if not self.taken.done():
            self.taken.set_result(refusal)

    def give_up(self, why: str) -> None:
        """End all its moves as unknown."""
        for run in self.runs:
            run.give_up(why)


class MoveRuns(Generic[M]):
    """All moves of a family: each motion is made in a task of its own, and its moves are remembered."""

    def __init__(
        self,
        tell: Callable[[str, Any, M], Event],
        on_trajectory: Callable[[Any], object] = lambda _part: None,
    ) -> None:
        self.tell = tell
        """Publishes the news of a part's move."""
        self.log = MoveLog[M]()
        self.get, self.wait, self.let_go = self.log.get, self.log.wait, self.log.let_go
        self._beginnings: dict[asyncio.Task[None], Beginning] = {}
        self.trajectories = Trajectories[Any]()
        self.on_trajectory = on_trajectory
        """Called with a part whose trajectory begins, or has ended."""

    async def begun(self) -> None:
        """Wait until every move that was asked for has been taken or refused."""
        if self._beginnings:
            await asyncio.wait(self._beginnings.values())

    async def close(self) -> None:
        """Follow no more, once all have begun and lines are closed; what moves goes on."""
        await self.begun()
        tasks = list(self._beginnings)
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    # beginning

    async def _begin(self, motion: Motion[Any, Any], start_within_s: float) -> None:
        """Queue the moves of a motion and see them through; return when it is taken.

        :raises GatewayError: it was refused, or not written in time.
        """
        motion.taken = asyncio.get_running_loop().create_future()
        try:
            for run in motion.runs:
                run.queue()
            first: MoveRecord = motion.runs[0].move
            self._see_through(first.id, partial(motion.make, start_within_s), motion.taken, motion.give_up)
        except Exception:
            motion.give_up("A fault of the gateway itself came before it was sent.")
            raise
        refusal = await asyncio.shield(motion.taken)
        if refusal is not None:
            raise refusal

    def _see_through(
        self, move_id: str, work: Callable[[], Coroutine[Any, Any, None]], taken: Beginning, give_up: GiveUp
    ) -> None:
        """See moves through; `taken` ends with the task at the latest.

        After a fault of the gateway itself they are no longer followed: `give_up` is called.
        """
        task = asyncio.create_task(work(), name=f"move {move_id}")
        self._beginnings[task] = taken
        over = partial(self._over, task, move_id, give_up)
        task.add_done_callback(lambda _: insist(f"the end of move {move_id}", over))

    def _over(self, task: asyncio.Task[None], move_id: str, give_up: GiveUp) -> None:
        taken = self._beginnings[task]
        fault = None if task.cancelled() else task.exception()
        if isinstance(fault, Exception) and not taken.done():
            taken.set_exception(fault)
        taken.cancel()
        if isinstance(fault, Exception):
            _not_followed(move_id, fault, give_up)
        del self._beginnings[task]

    def _go_on(self, run: MoveRun[M, Any], since: str, *, begun: bool) -> None:
        """Follow a move of an earlier life; `begun` and `since` as of `MoveRun.go_on`."""
        if run.go_on(since, begun=begun):
            taken: Beginning = asyncio.get_running_loop().create_future()
            taken.set_result(None)
            doubt = restarted_in_motion(run.who)
            self._see_through(run.move.id, partial(run.follow, doubt), taken, run.give_up)


def _not_followed(move_id: str, fault: Exception, give_up: GiveUp) -> None:
    log.error("move %s has met a fault of the gateway itself", move_id, exc_info=fault)
    why = f"A fault of the gateway itself ({type(fault).__name__}) has ended its watch over the move."
    give_up(why)
