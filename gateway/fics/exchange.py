"""One C-HOST command on its way to a robot, and what its answers mean."""

from dataclasses import dataclass, field
from typing import Any

from gateway.core.errors import GatewayError
from gateway.core.exchange import Exchange, More
from gateway.core.exchange import Proof as Proof
from gateway.core.lanes import Lane
from protocols.fics.alarms import TakeCurrentError
from protocols.fics.link import Answer, Completion, Failure, Refusal, credit
from protocols.fics.row import FicsCommand
from protocols.table import Reply

ROBOT, SET_UP = 0, 1
"""The targets of a robot's line: itself, and its own set-up, which no stop takes back."""

ReplyFrame = Answer | Completion | Refusal | Failure


@dataclass(frozen=True, slots=True)
class Answered:
    """The replies to a query, several for a download; none for an action that is done, or was only sent."""

    replies: tuple[Reply, ...] = ()
    confirmed: bool = True
    """False where the mode is silent: the command has left, and nothing more is known."""


Outcome = Answered | Refusal | Failure | GatewayError


@dataclass(eq=False, slots=True)
class FicsExchange(Exchange[FicsCommand[Any], ReplyFrame, Answered | Refusal | Failure]):
    """A command for a robot."""

    unheard: int = 0
    """What `FicsLine.unheard` was when it had been written."""
    _replies: list[Reply] = field(default_factory=list)

    @property
    def sent(self) -> str:
        """The name."""
        return f"{self.command.wire_name()} was sent"

    @property
    def remedy(self) -> str:
        """An error that was taken is not told again."""
        if isinstance(self.command, TakeCurrentError):
            return "What it would have told is gone: read the details of the latest error (ERD)."
        return Exchange.remedy.fget(self)  # type: ignore[attr-defined,no-any-return]

    @property
    def speaker(self) -> int:
        """The robot, whatever is asked for."""
        return ROBOT

    def shares(self, other: Exchange[FicsCommand[Any], ReplyFrame, Answered | Refusal | Failure]) -> bool:
        """Equal stops are written once; reads are shared before they are put."""
        return self.lane is other.lane is Lane.STOP and self.frame == other.frame

    def credit(self, frame: ReplyFrame, _: float = 0.0) -> Answered | Refusal | Failure | More | None:
        """Read a frame as an answer to this command; None if it is for another."""
        found = credit(self.command, frame)
        if found is None or isinstance(found, Refusal | Failure):
            return found
        if isinstance(found, Reply):
            self._replies.append(found)
            if self.command.ends_with:
                return More.MORE
        replies = tuple(self._replies)
        self._replies.clear()
        return Answered(replies)

    def begin(self, number: int, deadline: float | None) -> None:
        """Its frame has been handed to the port; the answers to an earlier attempt are forgotten."""
        self._replies.clear()
        Exchange.begin(self, number, deadline)
