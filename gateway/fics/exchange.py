"""One C-HOST command on its way to a robot, and what its answers mean."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Final, NamedTuple

from gateway.core.errors import GatewayError
from gateway.core.exchange import Exchange, Lane, More, RememberedReply, remedy_of
from protocols.fics.alarms import TakeCurrentError
from protocols.fics.link import Completion, FicsRefusal, QueryAnswer, SystemFailure, credit, line_of
from protocols.fics.motor_axes import GetMotorPosition
from protocols.fics.row import FicsCommand
from protocols.fics.status import GetAxisSensors, GetAxisStatus, GetUserPosition
from protocols.fics.system import GetCommunicationMode, GetUnit
from protocols.table import Reply

ROBOT, SET_UP = 0, 1
"""The targets of a robot's line: itself, and its own set-up, which no stop takes back."""

ReplyFrame = QueryAnswer | Completion | FicsRefusal | SystemFailure
_NOT_DONE = (FicsRefusal, SystemFailure)


@dataclass(frozen=True, slots=True)
class RobotAnswered:
    """The replies to a query, several for a download; none for an action that is done, or was only sent."""

    replies: tuple[Reply, ...] = ()
    confirmed: bool = True
    """False where the mode is silent: the command has left, and nothing more is known."""
    texts: tuple[str, ...] = field(default=(), compare=False)
    """The text behind the name in each answer, as it came."""


Outcome = RobotAnswered | FicsRefusal | SystemFailure | GatewayError


MODE: Final = GetCommunicationMode()
UNIT: Final = GetUnit()
STATUS: Final = GetAxisStatus()
SENSORS: Final = GetAxisSensors()
PLACES: Final = GetMotorPosition()
"""Question for the motors' places, which are known only of motors that are homed (C-HOST manual 4-4)."""
POSITIONS: Final[Mapping[str, FicsCommand[Any]]] = {"user": GetUserPosition(), "motor": PLACES}
"""The positions, by coordinates. Questions that are put again and again are built, and written out, once."""


@dataclass(eq=False, slots=True)
class Proof:
    """The proof that a motion may be written: all it depends on was asked and answered, with no doubt since.

    The question that shows a loss of power is asked last, and the motion follows at once.
    """

    doubts: int
    """`Session.doubts` before the first question."""
    last: int = 0
    """The number of the frame that asked the last question."""
    holds_until: float = 0.0
    """Time at which the answer to it would have been overdue."""

    def note_asked(self, number: int, deadline: float) -> None:
        """The last question has been put, as far as is known."""
        self.last, self.holds_until = number, deadline


class RobotQuestion(NamedTuple):
    """A question, or a setting, that goes before a command."""

    command: FicsCommand[Any]
    unit: int | None = None
    """The unit that is asked; of UNT, the unit that the robot is to act on."""
    fresh: bool = False
    """No copy of an earlier answer may be taken for this one."""
    proof: Proof | None = None
    """The proof that the answer is the last part of."""


@dataclass(eq=False, slots=True)
class FicsExchange(Exchange[FicsCommand[Any], ReplyFrame, RobotAnswered | FicsRefusal | SystemFailure]):
    """A command for a robot."""

    outdated_before: int = 0
    """The number of the last frame that was no mere read: what was asked before it may be outdated."""
    fresh: bool = False
    """True if no copy of an earlier answer may be taken for its own."""
    needs: Proof | None = None
    """Proof that has to hold for it to be written."""
    proves: Proof | None = None
    """Proof whose last part its answer is."""
    unheard: int = 0
    """`FicsLine.unheard` when it had been written."""
    parts: list[tuple[Reply, str]] = field(default_factory=list)
    """The answers to this attempt and their texts, while more are to come."""

    @property
    def sent(self) -> str:
        """The name."""
        return f"{self.command.wire_name()} was sent"

    @property
    def remedy(self) -> str:
        """An error that was taken is not told again."""
        if isinstance(self.command, TakeCurrentError):
            return "What it would have told is gone: read the details of the latest error (ERD)."
        return remedy_of(self.command)

    def mistakes(self, said: RememberedReply) -> bool:
        """True if a copy would be credited, and be wrong (decision 12).

        Equal reads are not kept apart, as long as nothing is done in between: a copy tells what was true a
        moment before. A command that has to be fresh is kept apart even from them.
        """
        return not self._is_right(said) and credit(self.command, said.frame) is not None

    def _is_right(self, said: RememberedReply) -> bool:
        command = self.command
        if isinstance(said.frame, _NOT_DONE):
            return False
        if said.exchange.frame == self.frame:
            return command.may_repeat and not self.fresh and said.number >= self.outdated_before
        return type(said.exchange.command) is type(command) and command.is_told_apart()

    def shares(
        self, other: Exchange[FicsCommand[Any], ReplyFrame, RobotAnswered | FicsRefusal | SystemFailure]
    ) -> bool:
        """Equal stops are written once; reads are shared before they are put."""
        return self.lane is other.lane is Lane.STOP and self.frame == other.frame

    def credit(
        self, frame: ReplyFrame, _: float = 0.0
    ) -> RobotAnswered | FicsRefusal | SystemFailure | More | None:
        """Read a frame as an answer to this command; None if it is for another."""
        found = credit(self.command, frame)
        if isinstance(found, SystemFailure) and line_of(found) == self.frame.strip():
            return None  # `POM 183` may be an echo of it: what the axes do tells whether it has failed
        if found is None or isinstance(found, _NOT_DONE):
            return found
        if isinstance(found, Completion):
            return self._whole() if self.command.is_query() else RobotAnswered(texts=("",))
        self.parts.append((found, frame.payload if isinstance(frame, QueryAnswer) else ""))
        return More.MORE if self.command.ends_with else self._whole()

    def _whole(self) -> RobotAnswered:
        replies, texts = tuple(reply for reply, _ in self.parts), tuple(text for _, text in self.parts)
        self.parts.clear()
        return RobotAnswered(replies, texts=texts)
