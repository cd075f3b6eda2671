"""What copies of replies look like on an RC-400's line (decision 10)."""

from collections.abc import Hashable

from gateway.core.copies import Said
from gateway.rorze.exchange import ReplyFrame, RorzeExchange


class RorzeReplies:
    """Replies go by their code. A row says which of its commands a reply fits."""

    remembered = 32

    def name(self, frame: ReplyFrame) -> str:
        """The code."""
        return frame.code

    def names(self, exchange: RorzeExchange) -> tuple[str]:
        """The code."""
        return (exchange.command.code,)

    def kind(self, frame: ReplyFrame) -> Hashable:
        """Whether one fits depends on what it says: a status is not a bit of it."""
        return frame

    def is_harmful(self, said: Said, exchange: RorzeExchange) -> bool:
        """Whether a copy would be taken for the reply to this command, and be wrong.

        It is right where the very same was asked, and asking changes nothing: that was true a moment ago.
        """
        if said.exchange.frame == exchange.frame and exchange.command.may_repeat():
            return False
        return exchange.credit(said.frame, 0.0) is not None
