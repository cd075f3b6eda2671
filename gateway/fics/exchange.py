"""One C-HOST command on its way to a robot and back."""

import asyncio
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from gateway.core.errors import GatewayError, NoReply
from gateway.core.lanes import Lane
from gateway.core.origin import Origin, current
from protocols.fics.link import Completion, Failure, Frame, Refusal, credit
from protocols.fics.row import FicsCommand
from protocols.table import Reply


@dataclass(frozen=True, slots=True)
class Answered:
    """The replies to a query, several for a download; none for a deed that is done, or was only sent."""

    replies: tuple[Reply, ...] = ()
    confirmed: bool = True
    """False where the mode is silent: the command has left, and nothing more is known."""


@dataclass(eq=False, slots=True)
class Proof:
    """That a motion may be written: all it depends on was told, and nothing has raised a doubt since.

    What tells of a loss of power is asked last, and the motion follows at once.
    """

    doubts: int
    """What `Conversation.doubts` was before the first question."""
    last: int = 0
    """The number of the frame that asked the last question."""
    holds_until: float = 0.0
    """When the answer to it would have been overdue."""

    def note_asked(self, number: int, deadline: float) -> None:
        """The last question has been put, as far as is known."""
        self.last, self.holds_until = number, deadline


Outcome = Answered | Refusal | Failure | GatewayError


@dataclass(eq=False, slots=True)
class Exchange:
    """A command with its frame, and who waits for what becomes of it."""

    command: FicsCommand[Any]
    frame: bytes
    lane: Lane
    epoch: int = 0
    """The robot's stop epoch at admission: a later stop forbids the write."""
    expires_at: float | None = None
    """Not written by then, it is not written at all."""
    timeout_s: float = 0.5
    """From the frame's last bit to the reply's deadline; motion has none."""
    repeats: int = 0
    """How often it may still be repeated by itself after a passed fence."""
    needs: Proof | None = None
    """Without this, which has to hold, it is not written."""
    proves: Proof | None = None
    """It tells of a loss of power, so no copy of an earlier answer may be taken for its own."""
    fresh: bool = False
    """No copy of an earlier answer may be taken for its own."""
    on_written: Callable[[float], None] | None = None
    future: "asyncio.Future[Outcome] | None" = None
    joined: "list[Exchange]" = field(default_factory=list)
    """Equal stops that were asked for before this one was written: it serves them all."""
    number: int = 0
    """The place of its frame among all that were written."""
    unheard: int = 0
    """What `FicsLine.unheard` was when it had been written."""
    deadline: float | None = None
    origin: Origin = field(default_factory=current)
    """On whose behalf it is sent; of equal ones that share it, the first's."""
    doubt: NoReply | None = None
    """Why there is no usable reply, until a fence has shown whether one still comes."""
    late_answer: Outcome | None = None
    _replies: list[Reply] = field(default_factory=list)

    def take(self, frame: Frame) -> Outcome | Reply | None:
        """Credit a frame: the outcome, a reply before the last, or None if it is not for this command."""
        found = credit(self.command, frame)
        if isinstance(found, Completion):
            return Answered(tuple(self._replies))
        if isinstance(found, Reply):
            self._replies.append(found)
            return found if self.command.ends_with else Answered(tuple(self._replies))
        return found

    def tell_written(self, now: float) -> None:
        """Tell whoever wants to know when it was written."""
        for exchange in (self, *self.joined):
            if exchange.on_written is not None:
                exchange.on_written(now)

    def settle(self, outcome: Outcome) -> None:
        """Tell whoever waits."""
        for exchange in (self, *self.joined):
            if exchange.future is not None and not exchange.future.done():
                exchange.future.set_result(outcome)

    def start_over(self) -> None:
        """Forget the replies of an attempt that was not completed."""
        self._replies.clear()
        self.doubt = None
