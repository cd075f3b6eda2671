"""What copies of answers look like on a robot's line (decision 12).

What an answer could be taken for is told by the rule that credits answers, so no row of the command table
has to be named here.
"""

from typing import Any

from gateway.core.copies import Said
from gateway.fics.exchange import FicsExchange, ReplyFrame
from protocols.fics.link import Failure, Refusal, credit
from protocols.fics.row import FicsCommand


class FicsReplies:
    """Answers go by their name, which several rows may have."""

    remembered = 1000

    def __init__(self) -> None:
        self.last_action = 0
        """The number of the last frame that was no mere read: what was asked before may be outdated."""

    def name(self, frame: ReplyFrame) -> str:
        """The name."""
        return frame.name

    def names(self, exchange: FicsExchange) -> set[str]:
        """Those of a refusal, of an answer, and of what ends several."""
        command: FicsCommand[Any] = exchange.command
        name = command.wire_name()
        return {name, command.answered_as or name, command.ends_with}

    def kind(self, frame: ReplyFrame) -> str:
        """What one fits depends on its kind and the command, whatever it says."""
        return type(frame).__name__

    def is_harmful(self, said: Said, exchange: FicsExchange) -> bool:
        """Whether a copy would be taken for the answer to this command, and be wrong.

        Equal reads are not kept apart, as long as nothing is done in between: a copy tells what was true a
        moment before. What has to be fresh is kept apart even from them.
        """
        command = exchange.command
        if credit(command, said.frame) is None:
            return False
        if isinstance(said.frame, Refusal | Failure):
            return True
        if said.exchange.frame == exchange.frame:
            return not command.may_repeat() or exchange.fresh or said.number < self.last_action
        return not (type(said.exchange.command) is type(command) and command.is_told_apart())
