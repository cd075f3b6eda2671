"""One command on its way to a body, a group or the link master, and what its replies mean."""

from dataclasses import dataclass, field
from typing import Any

from gateway.core.errors import GatewayError
from gateway.core.exchange import Exchange, RememberedReply, remedy_of
from protocols.rorze.link import Answer, GroupAnswer, Refusal
from protocols.rorze.row import RorzeCommand
from protocols.table import Reply, WireFault

ReplyFrame = Answer | Refusal | GroupAnswer


@dataclass(frozen=True, slots=True)
class Answered:
    """A reply was credited; for a group, one reply or refusal for each member that is in it."""

    replies: dict[int, Reply | Refusal]
    at: float
    late: bool = False
    """True if it came after its deadline, but before the line was proved to be in step again."""
    text: str = field(default="", compare=False)
    """The text behind the code in the reply of one body, as it came."""


Outcome = Answered | Refusal | GatewayError
"""A refusal by the controller, an answer, or the reason why there is neither."""


@dataclass(eq=False, slots=True)
class RorzeExchange(Exchange[RorzeCommand[Any], ReplyFrame, Answered | Refusal]):
    """A command for a body, a group or the link master."""

    @property
    def body(self) -> int:
        """The number of the body, group or link master."""
        return self.target

    @property
    def key(self) -> tuple[int, str]:
        """Body and code, by which a reply is matched first."""
        return self.target, self.command.code

    @property
    def sent(self) -> str:
        """Code and body."""
        return f"{self.command.code} was sent to body {self.target:02X}"

    @property
    def remedy(self) -> str:
        """A command that steps the position index may have changed that, too."""
        if self.command.steps_index:
            return "Read status, position and the position index (3ID) before anything else."
        return remedy_of(self.command)

    def credit(self, frame: ReplyFrame, now: float) -> Answered | Refusal | None:
        """Read a frame as the reply to this exchange; None unless body, code and the whole grammar match."""
        if frame.code != self.command.code or frame.body != self.target:
            return None
        if isinstance(frame, Refusal):
            return None if self.self_identifying else frame  # a refusal does not carry the number
        try:
            if isinstance(frame, GroupAnswer):
                replies, text = self._member_replies(frame), ""
            else:
                replies, text = {frame.body: self.command.read_reply(frame.payload)}, frame.payload
        except WireFault:
            return None
        return Answered(replies, now, self.doubt is not None, text)

    def mistakes(self, said: RememberedReply) -> bool:
        """True if a copy would be credited, and be wrong (decision 10).

        It is right where the very same was asked, and asking changes nothing: that was true a moment ago.
        """
        if said.exchange.frame == self.frame:
            return not self.command.may_repeat()
        return self.credit(said.frame, 0.0) is not None

    def _member_replies(self, frame: GroupAnswer) -> dict[int, Reply | Refusal]:
        return {
            member: self.command.read_reply(answer.payload) if isinstance(answer, Answer) else answer
            for member, answer in frame.members.items()
        }
