"""The targets of commands, and their results: all that the operations know of a family."""

from abc import ABC, abstractmethod
from collections.abc import Awaitable, Mapping, Sequence
from contextlib import AbstractAsyncContextManager, nullcontext
from dataclasses import dataclass
from typing import Any, ClassVar, Generic, TypeVar

from pydantic import BaseModel, ConfigDict

from gateway.core.errors import GatewayError, InvalidRequest, NotAllowed, NotFound
from gateway.core.move_log import MoveLog
from gateway.core.move_record import START_WITHIN_S, MoveRecord
from gateway.core.next_calls import NextCall
from gateway.core.records import Record
from gateway.core.stops import Report, StopMode
from gateway.core.times import together
from protocols.table import Command, Reply
from protocols.wording import as_given

R = TypeVar("R", bound=Reply)


@dataclass(frozen=True)
class CommandReplies:
    """All replies to one command, in turn; none where the command is silent."""

    replies: Sequence[Reply]
    at: float | None = None
    """Time of the first reply, on the event loop's clock; None where that means nothing."""
    listed: bool = False
    """True if there may be any number of replies."""
    texts: Sequence[str] = ()
    """The answers as they came, behind the name, where the family keeps them."""


@dataclass(frozen=True)
class MemberAnswers:
    """The answer of each member of a group, by the members' addresses."""

    group_id: str
    members: Mapping[str, Reply | GatewayError]


@dataclass(frozen=True)
class BegunMoves:
    """The moves of a command: one for each member of a group, else one."""

    path: str
    """Path of the target, such as `/bodies/line1.3F`."""
    moves: Sequence[MoveRecord]
    group_id: str | None = None


@dataclass(frozen=True)
class Opened:
    """A session in which a motor moves for as long as its client sends heartbeats."""

    path: str
    session: Record


@dataclass(frozen=True)
class Stopped:
    """Progress of stops, after two seconds at most, by the kind of part: `bodies`, `robots`."""

    reports: Mapping[str, Sequence[Report]]

    @property
    def confirmed(self) -> bool:
        """True if every controller reports standstill."""
        return all(report.state == "confirmed" for those in self.reports.values() for report in those)


async def stopped(what: str, stopping: Awaitable[Sequence[Report]]) -> Stopped:
    """Wait for the reports of stops that are queued already."""
    return Stopped({what: await stopping})


Result = CommandReplies | MemberAnswers | BegunMoves | Opened | Stopped
AnyCommand = Command[Any]


class Replies(BaseModel, Generic[R]):
    """All replies to one command, in turn."""

    model_config = ConfigDict(frozen=True, defer_build=True)

    replies: list[R]


class Looked(ABC):
    """A controller that may keep a trace of having been asked."""

    @abstractmethod
    def looking(self) -> AbstractAsyncContextManager[None]:
        """Leave no trace of what is asked inside."""


class Target(ABC):
    """A body, a group, a unit or a robot, as the operations see it."""

    address: str
    """Unique address, such as `line1.3F`."""
    path: str
    """Path among all resources, which is also the subject of its events."""
    log: MoveLog[Any]
    """The moves that its family remembers."""
    stop_modes: ClassVar[Mapping[type[AnyCommand], StopMode]] = {}
    """The rows that stop all of it."""

    @abstractmethod
    async def ask(self, command: AnyCommand) -> CommandReplies | MemberAnswers:
        """Send a command that starts no move.

        :raises GatewayError: it was refused, not sent, or not answered; the error says which.
        """

    async def start(
        self,
        command: AnyCommand,
        start_within_s: float = START_WITHIN_S,  # noqa: ARG002
    ) -> BegunMoves | Opened:
        """Send a command that starts a move, once the move has its record; it is sent in time, or never.

        :raises GatewayError: it was refused, or not sent.
        """
        raise InvalidRequest(f"{self.address} makes no moves by {command.name()}; nothing was sent.")

    async def start_and_wait(
        self, command: AnyCommand, wait_s: float, start_within_s: float
    ) -> BegunMoves | Opened:
        """Start a move, and give it when it is over, or when the time to wait is up; errors as of `start`."""
        return await self.wait_for(await self.start(command, start_within_s), wait_s)

    async def wait_for(self, begun: BegunMoves | Opened, wait_s: float) -> BegunMoves | Opened:
        """Give a move that was started when it is over, or when the time to wait is up."""
        if isinstance(begun, BegunMoves) and wait_s:
            await together(*(self.log.wait(move.id, wait_s) for move in begun.moves))
        return begun

    def at_own_speed(self, request: Any) -> AbstractAsyncContextManager[Any]:
        """See to the speed that a wish for a move names, and keep it until the move has begun.

        :raises GatewayError: the speed was not set, and the move must not start.
        """
        return nullcontext(request)

    def command_for(self, request: Any) -> AnyCommand:
        """Put a client's wish for a move into a command of the table.

        :raises InvalidRequest: it cannot be written so, or is in another unit.
        """
        raise InvalidRequest(f"{self.address} makes no moves of this kind ({request!r}); nothing was sent.")

    async def plan(self, command: AnyCommand, limit: Any = None) -> BaseModel:
        """Work out a move, with a highest speed of its own if given, without moving; only reads are sent.

        :raises GatewayError: it could not be worked out, or never be carried out.
        """
        raise InvalidRequest(
            f"{self.address} plans no moves by {command.name()} ({limit}); nothing was sent."
        )

    async def samples(self, move_id: str) -> BaseModel:
        """Give where it was seen during one of its moves.

        :raises NotFound: nothing is kept of it.
        """
        raise NotFound(f"{self.address} keeps no samples of a move {as_given(move_id)}.")

    async def stop(self, mode: StopMode) -> Stopped:
        """Stop it; every stop frame is queued before anything is awaited."""
        raise InvalidRequest(f"{self.address} has no motor to be stopped ({mode}); nothing was sent.")

    async def stop_by(self, command: AnyCommand) -> CommandReplies | MemberAnswers | Stopped:
        """Stop as a command of the table says."""
        return await self.stop(self.stop_modes[type(command)])

    def calls_for(self, error: GatewayError) -> Sequence[NextCall]:
        """The calls that help where a request about it has failed."""
        return error.next

    def read(self, text: str) -> AnyCommand:
        """Read a command as it stands on the line, without frame.

        :raises InvalidRequest: it is not in the table's form.
        """
        raise NotAllowed(f"{self.address} takes no plain text ({text}); nothing was sent.")
