"""Replies of which a copy may still be on its way, and commands that such a copy would seem to answer.

A reply may come twice, and the copy later than other frames. One speaker's frames come in order, though:
after the echo of its fence come no copies of its earlier replies.
"""

from collections.abc import Hashable
from typing import Generic

from gateway.core.exchange import F, RememberedReply, X


class Copies(Generic[X, F]):
    """The replies of a line since each speaker's last fence."""

    def __init__(self, remembered: int) -> None:
        self._remembered = remembered
        """Different replies of one name that are remembered; beyond them a fence goes before the next one."""
        self._said: dict[int, dict[Hashable, dict[Hashable, RememberedReply]]] = {}
        """Replies by speaker, by name, and by the command's frame and the kind of reply."""

    def note(self, speaker: int, name: Hashable, said: RememberedReply, now: float) -> None:
        """A reply was credited, or may come; of one command and one kind the last is remembered."""
        names = self._said.get(speaker) or self._said.setdefault(speaker, {})
        others = names.get(name) or names.setdefault(name, {})
        if len(others) >= self._remembered:
            for key in [key for key, reply in others.items() if reply.until <= now]:
                del others[key]
        others[said.exchange.frame, said.kind] = said

    def forget(self, speaker: int) -> None:
        """Forget a speaker's replies: its fence has passed, so no copy of them is on its way any more."""
        self._said.pop(speaker, None)

    def could_answer(self, exchange: X, speaker: int, now: float) -> bool:
        """Say whether a copy of an earlier reply could be taken for the reply to this, and be wrong."""
        said = self._said.get(speaker, {})
        for name in exchange.reply_names if said else ():
            replies = said.get(name, {})
            if len(replies) > self._remembered:
                return True
            for reply in replies.values():
                if reply.until > now and exchange.mistakes(reply):
                    return True
        return False

    def include(self, speaker: int, frame: F) -> bool:
        """Say whether the speaker has sent this frame before."""
        names = self._said.get(speaker, {}).values()
        return any(reply.frame == frame for replies in names for reply in replies.values())
