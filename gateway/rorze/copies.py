"""Replies of which a copy may still be on its way, and whose answer such a copy would look like."""

from typing import NamedTuple

from gateway.rorze.exchange import Exchange
from protocols.rorze.link import Answer, GroupAnswer, Refusal

ReplyFrame = Answer | Refusal | GroupAnswer

REMEMBERED = 32
"""Different replies of one body to one code. After so many a fence goes before the next, whatever it asks."""


class _Reply(NamedTuple):
    """A reply that was credited."""

    request: bytes
    frame: ReplyFrame
    until: float
    """A copy that comes after this would be later than any reply may be."""


class Copies:
    """The replies of a line since each body's last fence.

    A reply may come twice, and the copy after other bodies have been heard. What a body says comes in order,
    though: after the echo of its fence come no copies of what it said before.
    """

    def __init__(self, late_reply_s: float) -> None:
        self._late_reply_s = late_reply_s
        self._replies: dict[int, dict[str, list[_Reply]]] = {}
        self._last: dict[int, ReplyFrame] = {}

    def note(self, exchange: Exchange, frame: ReplyFrame, now: float) -> None:
        """A reply was credited. Where all commands of a code ask the same, its copy can do no harm."""
        self._last[exchange.body] = frame
        if exchange.self_identifying or exchange.command.is_only_question():
            return
        replies = self._replies.setdefault(exchange.body, {}).setdefault(exchange.command.code, [])
        until = max(now, exchange.deadline or now) + self._late_reply_s
        said = _Reply(exchange.frame, frame, until)
        if replies and replies[-1][:2] == said[:2]:
            replies[-1] = said
        else:
            replies[:] = [it for it in replies if it.until > now and it[:2] != said[:2]]
            replies.append(said)

    def forget(self, body: int) -> None:
        """Its fence has passed: no copy of what it has said is on its way any more."""
        self._replies.pop(body, None)

    def could_answer(self, exchange: Exchange, now: float) -> bool:
        """Whether a copy would be taken for the reply to this command, and be wrong.

        It is right where the very same was asked, and asking changes nothing: that was true a moment ago.
        """
        replies = self._replies.get(exchange.body, {}).get(exchange.command.code)
        if not replies:
            return False
        same = exchange.frame if exchange.command.may_repeat() else None
        harmful = [it.frame for it in replies if it.until > now and it.request != same]
        return len(replies) > REMEMBERED or any(exchange.credit(frame, now) for frame in harmful)

    def is_one(self, frame: ReplyFrame) -> bool:
        """Whether a frame that nobody awaits has been heard, and credited, before."""
        replies = self._replies.get(frame.body, {}).get(frame.code, ())
        return frame == self._last.get(frame.body) or any(frame == it.frame for it in replies)
