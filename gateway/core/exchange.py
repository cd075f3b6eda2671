"""One command on its way to a controller and back, and everything that can come of it."""

import asyncio
from abc import ABC, abstractmethod
from collections.abc import Callable, Hashable
from contextvars import ContextVar
from dataclasses import dataclass, field
from enum import Enum, IntEnum, auto
from typing import Any, Generic, NamedTuple, TypeVar

from gateway.core.errors import Expired, GatewayError, NoReply, QueueFull
from gateway.core.origin import Origin, current
from protocols.members import at_hand
from protocols.table import Command, Retry


@at_hand
class Lane(IntEnum):
    """Priority on a line: the lower number goes first."""

    STOP = 0
    VERIFY = 1
    """Questions a motor waits for: whether a stop has worked, and what is to be known before a move."""
    COMMAND = 2
    STOP_REPEAT = 3
    """Stops repeated to a body that has not answered the last one and may be dead."""
    READ = 4
    BACKGROUND = 5
    """Questions of the gateway itself: health, and whether a motor still runs."""


STOPS = (Lane.STOP, Lane.STOP_REPEAT)
QUESTIONS = (Lane.READ, Lane.VERIFY, Lane.BACKGROUND)
IMPATIENT = (Lane.COMMAND, Lane.READ, Lane.BACKGROUND)
"""Lanes whose exchanges expire; each gets a turn before that."""

QUEUE_LIMIT = 64
"""Exchanges that may wait for one body, or robot, in one lane."""


def require_room(waiting: int, waits_for: str) -> None:
    """Turn away what would wait too long.

    :raises QueueFull: as many as may wait do so already.
    """
    if waiting >= QUEUE_LIMIT:
        raise QueueFull(
            f"{QUEUE_LIMIT} requests wait for this {waits_for} already; nothing was sent.", "Try again later."
        )


@dataclass(eq=False, slots=True)
class Series:
    """The frames of a holder of one or more sequence locks. A stop ends it: the rest is not written."""

    epochs: dict[int, int] = field(default_factory=dict)
    """The epochs of its targets at its beginning, where it has to end with them."""


SERIES: ContextVar[Series | None] = ContextVar("series", default=None)

current_series = SERIES.get
"""The series that a lock is held for here and now."""


C = TypeVar("C", bound=Command[Any])
"""A family's commands."""
F = TypeVar("F")
"""The frames that may be replies."""
O = TypeVar("O")  # noqa: E741  # outcome
"""A controller's response to a command: an answer, a refusal, a failure."""
X = TypeVar("X", bound="Exchange[Any, Any, Any]")
"""A family's exchanges."""


class RememberedReply(NamedTuple):
    """A reply that was credited, or may come at any time."""

    exchange: "Exchange[Any, Any, Any]"
    frame: Any
    kind: Hashable
    """Kind of the reply, which decides which exchanges a copy could deceive."""
    number: int
    """The place of the command's frame among all that were written."""
    until: float
    """A copy that comes after this would be later than any reply may be."""


@at_hand
class More(Enum):
    """A part of a reply: the rest is still to come."""

    MORE = auto()


@dataclass(eq=False, slots=True)
class ExpectedReply:
    """The reply that a command waits for: its names and its time, and what has come in its place."""

    timeout_s: float = 0.5
    """Seconds from the frame's last bit to the reply's deadline."""
    repeats: int = 0
    """Times that the session may repeat the command, each after a passed fence."""
    names: tuple[Hashable, ...] = ()
    """The names it may have: only what was said by one of them could be taken for it."""
    self_identifying: bool = False
    """True if it carries a number of its own, so that a late one can be taken for nothing else."""
    due_at: float = 0.0
    """Time at which it, or the next part of it, was expected."""
    deadline: float | None = None
    """Time after which it is overdue: `due_at`, later once a part has come; None for any time."""
    doubt: NoReply | None = None
    """Why there is no usable one, until a fence has shown whether one still comes."""
    late: Any = None
    """Outcome that came before that fence, once or more often."""

    def await_until(self, deadline: float | None) -> None:
        """Set the time at which it, or the next part of it, is overdue."""
        self.deadline, self.due_at = deadline, deadline or 0.0


@dataclass(eq=False, slots=True)
class Exchange(ABC, Generic[C, F, O]):
    """A command with its frame, and the waiters for its outcome."""

    command: C
    frame: bytes
    lane: Lane
    target: int = 0
    """The body, or the robot: what it is that a stop stops."""
    epoch: int = 0
    """The target's epoch at admission: a later stop forbids the write."""
    expires_at: float | None = None
    """Time after which it must not be written any more: the latest that a waiter allows."""
    rank: int = 0
    """Rank within the queue of its target: the lower goes first, and of equal ones the first."""
    reply: ExpectedReply = field(default_factory=ExpectedReply)
    on_written: Callable[[float], None] | None = None
    intent: str | None = None
    """Id of its intent in the journal, once that is written."""
    origin: Origin = field(default_factory=current)
    series: Series | None = None
    """The undivided series it belongs to."""
    waiters: dict["asyncio.Future[O | GatewayError]", float | None] = field(default_factory=dict)
    """The waiters, and the deadline of each for the write."""
    number: int = 0
    """The place of its frame among all that were written."""

    @abstractmethod
    def credit(self, frame: F, now: float) -> O | More | None:
        """Read a frame as the reply to this exchange; None unless the whole grammar matches."""

    @property
    def sent(self) -> str:
        """Say what was sent and where to, as a clause."""
        return f"{self.command.name()} was sent"

    @property
    def remedy(self) -> str:
        """Say what to do if the outcome is unknown."""
        return remedy_of(self.command)

    def unusable(self, kind: type[NoReply], what: str) -> NoReply:
        """The error of an exchange without a usable reply."""
        return kind(f"{self.sent}, and {what}.", self.remedy, self.command)

    # copies of replies

    @abstractmethod
    def mistakes(self, said: RememberedReply) -> bool:
        """Say whether a copy of an earlier reply would be taken for this one's reply, and be wrong."""

    # waiters

    def shares(self, other: "Exchange[C, F, O]") -> bool:
        """Say whether one trip on the wire serves both."""
        if self.lane is not other.lane or self.frame != other.frame or other.on_written is not None:
            return False
        return self.lane is Lane.STOP or (self.lane in QUESTIONS and self.command.may_repeat)

    def take_over(self, other: "Exchange[C, F, O]") -> None:
        """Take over the waiters of an equal exchange, each with its own deadline."""
        self.waiters |= other.waiters
        if self.on_written is None or other.on_written is None:
            self.on_written = self.on_written or other.on_written
        else:
            self.on_written = _both(self.on_written, other.on_written)
        if self.expires_at is None or other.expires_at is None:
            self.expires_at = None
        else:
            self.expires_at = max(self.expires_at, other.expires_at)

    def expire(self, now: float) -> bool:
        """Settle the waiters for which it is too late; whether it is for all of them."""
        late = [
            waiter
            for waiter, expires_at in self.waiters.items()
            if expires_at is not None and expires_at <= now
        ]
        for waiter in late:
            del self.waiters[waiter]
            _give(waiter, self.reply.doubt or Expired())
        return self.expires_at is not None and self.expires_at <= now

    def withdraw(self, reason: GatewayError) -> None:
        """Withdraw it, before it is written or written again: then it is known only that no reply came."""
        self.settle(self.reply.doubt or reason)

    def settle(self, outcome: O | GatewayError) -> None:
        """Give the outcome to all waiters that are left."""
        for waiter in self.waiters:
            _give(waiter, outcome)
        self.waiters.clear()


def remedy_of(command: Command[Any]) -> str:
    """Say what to do if the outcome of a command is unknown."""
    if command.may_repeat:
        return "Ask again."
    if command.retry_class() is Retry.SETTING:
        return "Read back whether it was set."
    return "Read status and position before anything else."


def _give(waiter: "asyncio.Future[O]", outcome: O) -> None:
    if not waiter.done():
        waiter.set_result(outcome)


def _both(first: Callable[[float], None], second: Callable[[float], None]) -> Callable[[float], None]:
    def both(now: float) -> None:
        first(now)
        second(now)

    return both
