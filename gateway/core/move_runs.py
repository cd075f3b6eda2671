"""The runs of moves: asked for, begun or refused, followed to their ends, and written down."""

import asyncio
import logging
from abc import ABC, abstractmethod
from collections.abc import Awaitable, Callable, Coroutine, Sequence
from datetime import UTC, datetime
from functools import partial
from typing import Any, Generic, TypeVar, cast

from gateway.core.errors import GatewayError
from gateway.core.events import Event
from gateway.core.move_log import MoveLog
from gateway.core.move_record import LOST_AFTER_S, MoveError, MoveRecord, MoveStatus
from gateway.core.next_calls import NextCall
from gateway.core.supervisor import do_each, insist, insist_after
from gateway.core.verdicts import Judged, Unbegun, Unwatched, Verdict, VerdictWords, judge

OUT_OF_REACH_S = 300.0
"""Seconds out of reach after which a move is followed no more, and its end is unknown."""


class Silence:
    """Counts the questions that were not answered, in seconds. It has no clock: times are given.

    Only what was written to a line that works counts as silence of the body. A line that is down, crowded or
    garbled, or a gateway that was held up, does not: that counts as being out of reach.
    """

    def __init__(self, now: float, longest_s: float) -> None:
        self._longest_s = longest_s
        """Longest time in seconds for which a question counts."""
        self._counted_until = now
        self.silent_s = 0.0
        self.out_of_reach_s = 0.0

    def answered(self, now: float) -> None:
        """The body has answered."""
        self._counted_until = now
        self.silent_s = self.out_of_reach_s = 0.0

    def unanswered(self, now: float, *, silent: bool) -> None:
        """Note that it has not answered: because it is silent, or because it could not be asked."""
        passed_s = min(now - self._counted_until, self._longest_s)
        self._counted_until = now
        if silent:
            self.silent_s += passed_s
        else:
            self.out_of_reach_s += passed_s

    @property
    def of_body(self) -> bool:
        """True if the body itself has been silent too long."""
        return self.silent_s >= LOST_AFTER_S

    @property
    def too_long(self) -> bool:
        """True if more questions are no use."""
        return self.of_body or self.out_of_reach_s >= OUT_OF_REACH_S

    @property
    def told(self) -> str:
        """Say for how long the body was not heard, as a sentence without its subject."""
        if self.of_body:
            return f"has not answered for {self.silent_s:.0f} s"
        return f"could not be asked for {self.out_of_reach_s:.0f} s"


log = logging.getLogger(__name__)

GiveUp = Callable[[str], None]
"""Gives a move up as unknown, with the reason."""
Beginning = asyncio.Future[GatewayError | None]
"""The beginning of a move: done when it is taken, or refused with an error."""


W = TypeVar("W")
"""The maker of a move."""
M = TypeVar("M", bound=MoveRecord)
T = TypeVar("T")


class MoveRuns(ABC, Generic[W, M]):
    """All moves of a family: each is seen through in a task of its own, and remembered when it is over."""

    def __init__(self) -> None:
        self.log = MoveLog[M]()
        self._beginnings: dict[asyncio.Task[None], Beginning] = {}

    # what a family brings

    @abstractmethod
    def _move_of(self, who: W) -> M | None:
        """The move that is not over yet."""

    @abstractmethod
    def _publish(self, news: str, who: W, move: M, /) -> Event:
        """Tell the news of a move."""

    @abstractmethod
    def _claim(self, who: W, move: M, /) -> None:
        """Let no other move begin."""

    @abstractmethod
    def _free(self, who: W) -> None:
        """The move is over: another may begin."""

    @abstractmethod
    def _calls(self, who: W, error: GatewayError, /) -> Sequence[NextCall]:
        """The calls that help where a move did not succeed."""

    def _was_sent(self, who: W, move: M) -> None:
        """Note that its command is on the wire."""

    def _lose(self, who: W, why: str, /) -> None:
        """Stop following the move: what it has not written yet never is."""

    # finding

    def get(self, move_id: str) -> M:
        """Find a move by its id.

        :raises NotFound: there is none, or it is no longer kept.
        """
        return self.log.get(move_id)

    async def wait(self, move_id: str, timeout_s: float) -> M:
        """Give the move when it is over, or as it is when the time is up.

        :raises NotFound: there is none, or it is no longer kept.
        """
        return await self.log.wait(move_id, timeout_s)

    async def begun(self) -> None:
        """Wait until every move that was asked for has been taken or refused."""
        if self._beginnings:
            await asyncio.wait(self._beginnings.values())

    def let_go(self) -> None:
        """Give the waiters for moves what is known now."""
        self.log.let_go()

    async def close(self) -> None:
        """Follow no more, once all have begun and lines are closed; what moves goes on."""
        await self.begun()
        tasks = list(self._beginnings)
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    # beginning

    async def _start(
        self,
        moves: Sequence[tuple[W, M]],
        work: Callable[[], Coroutine[Any, Any, None]],
        beginning: Beginning,
    ) -> GatewayError | None:
        """Queue the moves of one command, see them through, and give its refusal; None when it is taken."""
        give_up = partial(self._give_up, moves)
        try:
            for who, move in moves:
                self._claim(who, move)
            for who, move in moves:
                self.log.add(move)
                move.event_cursor = self._publish("queued", who, move).cursor
                self.log.on_change(move)
            self._see_through(moves[0][1].id, work, beginning, give_up)
        except Exception:
            give_up("A fault of the gateway itself came before it was sent.")
            raise
        return await asyncio.shield(beginning)

    def _see_through(
        self,
        move_id: str,
        work: Callable[[], Coroutine[Any, Any, None]],
        beginning: Beginning,
        give_up: GiveUp,
    ) -> None:
        """See a move through; its `beginning` ends with the task at the latest.

        After a fault of the gateway itself the move is no longer followed: `give_up` is called.
        """
        task = asyncio.create_task(work(), name=f"move {move_id}")
        self._beginnings[task] = beginning
        insist_after(task, f"the end of move {move_id}", lambda _: self._over(task, move_id, give_up))

    def _over(self, task: asyncio.Task[None], move_id: str, give_up: GiveUp) -> None:
        beginning = self._beginnings.pop(task)
        fault = None if task.cancelled() else task.exception()
        if isinstance(fault, Exception):
            _not_followed(move_id, fault, give_up)
            if not beginning.done():
                beginning.set_exception(fault)
        beginning.cancel()

    def _take_over(self, who: W, move: M, *, begun: bool, asked: str, since: str) -> bool:
        """Say whether to go on with a move of an earlier life, whose command may have been written.

        `begun` says whether an intent of it was written, `asked` names the controller to ask, `since` the
        reason.
        """
        self._claim(who, move)
        if move.status is MoveStatus.QUEUED and not begun:
            self.end(who, move, judge(Unbegun.GATEWAY_ENDED))
            return False
        if move.status is MoveStatus.QUEUED:
            move.status = MoveStatus.SENT
            move.evidence.append("The journal does not tell whether the command was written.")
        move.evidence.append(in_the_middle(since, asked))
        return True

    # the record

    def advance(self, who: W, move: M, status: MoveStatus, error: GatewayError | None = None) -> None:
        """The only place where a move changes its status."""
        if error is not None:
            move.error = MoveError.of(error, self._calls(who, error))
        move.status = status
        if status is MoveStatus.SENT:
            move.sent_at = datetime.now(UTC)
            self._was_sent(who, move)
        elif status.final:
            move.ended_at = datetime.now(UTC)
            insist(f"the end of move {move.id}", partial(self._free, who))
            self.log.end(move)
        self._publish("started" if status is MoveStatus.MOVING else status, who, move)
        self.log.on_change(move)

    def seen_to_move(self, who: W, move: M) -> bool:
        """The motors of a move were seen to run; True the first time, when that is told."""
        if move.status is not MoveStatus.SENT:
            return False
        if move.acknowledged_at is None:
            move.acknowledged_at = datetime.now(UTC)
        self.advance(who, move, MoveStatus.MOVING)
        return True

    def unbegun(self, who: W, move: M, error: GatewayError, *, refused: bool) -> None:
        """End a move that never began: the one who was to move has `refused` it, or it was not written."""
        self.end(who, move, judge(Unbegun.REFUSED if refused else Unbegun.WITHHELD, given=error))

    def end(self, who: W, move: M, verdict: Verdict) -> None:
        """End a move as it is judged."""
        verdict.write_down(cast("Judged", move))  # each family describes its causes
        self.advance(who, move, verdict.status, verdict.error)

    def _give_up(self, moves: Sequence[tuple[W, M]], why: str) -> None:
        """End moves as unknown."""
        for who, move in moves:
            self._lose(who, why)
            if self._move_of(who) is move:
                self.end(who, move, judge(Unwatched.FAULT, VerdictWords(why=why)))


async def until_answered(
    question: Callable[[], Awaitable[T]],
    silence: Silence,
    *,
    shows_silence: Callable[[GatewayError], bool],
    pause_s: float,
    gives_up: Callable[[], bool] = lambda: False,
) -> T | None:
    """Repeat the question that follows a move until it is answered.

    None when there was `silence` for too long, or when `gives_up` has said so after a question without an
    answer. `pause_s` is the time between two questions, in seconds.
    """
    loop = asyncio.get_running_loop()
    while not silence.too_long:
        try:
            answer = await question()
        except GatewayError as error:
            silence.unanswered(loop.time(), silent=shows_silence(error))
            if gives_up():
                return None
            await asyncio.sleep(pause_s)
        else:
            silence.answered(loop.time())
            return answer
    return None


def in_the_middle(since: str, asked: str) -> str:
    """Tell that a move goes on with another gateway than it began with, or another life of it."""
    return f"{since[0].upper()}{since[1:]} in the middle of the move; {asked} was asked."


async def guarded(move_id: str, work: Callable[[], Coroutine[Any, Any, None]], give_up: GiveUp) -> None:
    """Follow one of several moves: a fault of the gateway itself ends the watch over this one alone."""
    try:
        await work()
    except Exception as fault:
        _not_followed(move_id, fault, give_up)


def _not_followed(move_id: str, fault: Exception, give_up: GiveUp) -> None:
    log.error("move %s has met a fault of the gateway itself", move_id, exc_info=fault)
    why = f"A fault of the gateway itself ({type(fault).__name__}) has ended its watch over the move."
    do_each(f"move {move_id}", partial(give_up, why))
