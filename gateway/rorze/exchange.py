"""One command on its way to a controller and back: what is asked, and everything that can become of it."""

import asyncio
from collections.abc import Callable
from dataclasses import dataclass, field
from operator import methodcaller
from typing import Any

from gateway.core.errors import Expired, GatewayError, NoReply
from gateway.core.lanes import QUESTIONS, Lane
from gateway.core.origin import Origin, current
from protocols.rorze.link import Answer, GroupAnswer, Refusal
from protocols.rorze.row import FIRST_GROUP, LAST_GROUP, RorzeCommand
from protocols.table import Reply, WireFault

_IS_DONE = methodcaller("done")


@dataclass(frozen=True, slots=True)
class Answered:
    """A reply was credited; for a group, one reply or refusal for each member that is in it."""

    replies: dict[int, Reply | Refusal]
    at: float
    late: bool = False
    """It came after its deadline, but before the line was proved to be in step again."""

    def as_late(self) -> "Answered":
        """The same answer, marked as late."""
        return Answered(self.replies, self.at, late=True)


Outcome = Answered | Refusal | GatewayError
"""A refusal by the controller, an answer, or the reason why there is neither."""


@dataclass(eq=False, slots=True)
class Exchange:
    """A command with its frame, and who waits for what becomes of it."""

    body: int
    command: RorzeCommand[Any]
    frame: bytes
    lane: Lane
    epoch: int = 0
    """The body's stop epoch at admission: a later stop forbids the write."""
    expires_at: float | None = None
    """From when on it must not be written any more: the latest of those who wait allow."""
    timeout_s: float = 0.5
    """From the frame's last bit to the reply's deadline."""
    repeats: int = 0
    """How often it may still be repeated by itself after a passed fence."""
    self_identifying: bool = False
    """Its reply carries a number of its own, so a late one can be taken for nothing else."""
    on_written: Callable[[float], None] | None = None
    waiters: dict["asyncio.Future[Outcome]", float | None] = field(default_factory=dict)
    """Who waits, and until when it had to be written for each of them."""
    written_at: float | None = None
    deadline: float | None = None
    origin: Origin = field(default_factory=current)
    """On whose behalf it is sent; of equal ones that share it, the first's."""
    doubt: NoReply | None = None
    """Why there is no usable reply, until a fence has shown whether one still comes."""
    late_answer: Answered | Refusal | NoReply | None = None
    """What came before that fence, once or more often."""

    @property
    def key(self) -> tuple[int, str]:
        """What a reply is matched by first: body and code."""
        return self.body, self.command.code

    def shares(self, other: "Exchange") -> bool:
        """Whether one trip on the wire serves both."""
        if self.lane is other.lane is Lane.STOP:
            return self.frame == other.frame and other.on_written is None
        return (
            self.lane is other.lane
            and self.lane in QUESTIONS
            and self.frame == other.frame
            and self.command.may_repeat()
            and other.on_written is None
        )

    def credit(self, frame: Answer | Refusal | GroupAnswer, now: float) -> Answered | Refusal | None:
        """Read a frame as the reply to this exchange; None unless body, code and the whole grammar match."""
        if frame.code != self.command.code or frame.body != self.body:
            return None
        if isinstance(frame, Refusal):
            return None if self.self_identifying else frame  # a refusal does not carry the number
        try:
            if isinstance(frame, GroupAnswer):
                return Answered(self._member_replies(frame), now)
            return Answered({frame.body: self.command.read_reply(frame.payload)}, now)
        except WireFault:
            return None

    def _member_replies(self, frame: GroupAnswer) -> dict[int, Reply | Refusal]:
        return {
            member: self.command.read_reply(answer.payload) if isinstance(answer, Answer) else answer
            for member, answer in frame.members.items()
        }

    def wait_for(self, waiter: "asyncio.Future[Outcome]") -> None:
        """Add somebody who waits, for whom it has to be written before it expires."""
        self.waiters[waiter] = self.expires_at

    def take_over(self, other: "Exchange") -> None:
        """Serve those who wait for an equal one, each with a deadline of its own."""
        self.waiters |= other.waiters
        if self.expires_at is None or other.expires_at is None:
            self.expires_at = None
        else:
            self.expires_at = max(self.expires_at, other.expires_at)

    def expire(self, now: float) -> bool:
        """Tell those for whom it is too late; whether it is for all of them."""
        late = [it for it, expires_at in self.waiters.items() if expires_at is not None and expires_at <= now]
        for waiter in late:
            del self.waiters[waiter]
            _tell(waiter, self.doubt or Expired())
        return self.expires_at is not None and self.expires_at <= now

    def withdraw(self, reason: GatewayError) -> None:
        """It is not written, or not again: then what is known is that there was no reply."""
        self.settle(self.doubt or reason)

    def settle(self, outcome: Outcome) -> None:
        """Tell everybody who still waits."""
        for waiter in self.waiters:
            _tell(waiter, outcome)
        self.waiters.clear()

    def abandoned(self) -> bool:
        """Whether nobody waits any more: a read of this kind need not be sent."""
        return self.lane in QUESTIONS and all(map(_IS_DONE, self.waiters))


def _tell(waiter: "asyncio.Future[Outcome]", outcome: Outcome) -> None:
    if not waiter.done():
        waiter.set_result(outcome)


def is_group(body: int) -> bool:
    """Whether the number is a virtual body's."""
    return FIRST_GROUP <= body <= LAST_GROUP
