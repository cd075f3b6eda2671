"""Replies of which a copy may still be on its way, and whose answer such a copy would look like.

A reply may come twice, and the copy later than what was said since. What one speaker says comes in order,
though: after the echo of its fence come no copies of what it said before.
"""

from collections.abc import Hashable
from typing import Generic

from gateway.core.exchange import F, RememberedReply, X


class Copies(Generic[X, F]):
    """The replies of a line since each speaker's last fence."""

    def __init__(self, remembered: int) -> None:
        self._remembered = remembered
        """Different replies of one name. After so many a fence goes before the next, whatever it asks."""
        self._said: dict[int, dict[Hashable, dict[Hashable, RememberedReply]]] = {}
        """By speaker, by name, and by the command's frame and the kind of reply."""

    def note(self, speaker: int, name: Hashable, said: RememberedReply, now: float) -> None:
        """A reply was credited, or may come; of one command and one kind the last is remembered."""
        names = self._said.get(speaker) or self._said.setdefault(speaker, {})
        others = names.get(name) or names.setdefault(name, {})
        if len(others) >= self._remembered:
            for key in [key for key, it in others.items() if it.until <= now]:
                del others[key]
        others[said.exchange.frame, said.kind] = said

    def forget(self, speaker: int) -> None:
        """Its fence has passed: no copy of what it has said is on its way any more."""
        self._said.pop(speaker, None)

    def could_answer(self, exchange: X, speaker: int, now: float) -> bool:
        """Whether a copy of what somebody said could be taken for the reply to this, and be wrong."""
        said = self._said.get(speaker, {})
        for name in exchange.reply_names if said else ():
            replies = said.get(name, {})
            if len(replies) > self._remembered:
                return True
            for it in replies.values():
                if it.until > now and exchange.mistakes(it):
                    return True
        return False

    def include(self, speaker: int, frame: F) -> bool:
        """Whether somebody has said this before."""
        names = self._said.get(speaker, {}).values()
        return any(it.frame == frame for replies in names for it in replies.values())
