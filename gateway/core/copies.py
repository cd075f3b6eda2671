"""Replies of which a copy may still be on its way, and whose answer such a copy would look like.

A reply may come twice, and the copy later than what was said since. What one speaker says comes in order,
though: after the echo of its fence come no copies of what it said before.
"""

from collections.abc import Hashable, Iterable
from typing import Any, Generic, NamedTuple, Protocol, TypeVar

from gateway.core.exchange import Exchange

X = TypeVar("X", bound=Exchange[Any, Any, Any])
F = TypeVar("F")
X_contra = TypeVar("X_contra", bound=Exchange[Any, Any, Any], contravariant=True)
F_contra = TypeVar("F_contra", contravariant=True)


class Said(NamedTuple):
    """A reply that was credited, or may come at any time."""

    exchange: Exchange[Any, Any, Any]
    frame: Any
    number: int
    """The place of the command's frame among all that were written."""
    until: float
    """A copy that comes after this would be later than any reply may be."""


class Grammar(Protocol[X_contra, F_contra]):
    """What a family's replies look like."""

    remembered: int
    """Different replies of one name. After so many a fence goes before the next, whatever it asks."""

    def name(self, frame: F_contra, /) -> Hashable:
        """What a reply is called: only commands that await this name have to be looked at."""

    def names(self, exchange: X_contra, /) -> Iterable[Hashable]:
        """The names that replies to a command may have."""

    def kind(self, frame: F_contra, /) -> Hashable:
        """Of one command and one kind, only the last reply has to be remembered."""

    def is_harmful(self, said: Said, exchange: X_contra, /) -> bool:
        """Whether a copy would be taken for the reply to this command, and be wrong."""


class Copies(Generic[X, F]):
    """The replies of a line since each speaker's last fence."""

    def __init__(self, grammar: Grammar[X, F]) -> None:
        self._grammar = grammar
        self._said: dict[int, dict[Hashable, dict[Hashable, Said]]] = {}
        """By speaker, by name, and by the command's frame and the kind of reply."""

    def note(self, exchange: X, frame: F, now: float, until: float) -> None:
        """A reply was credited, or may come until then."""
        grammar = self._grammar
        said = self._said.setdefault(exchange.speaker, {}).setdefault(grammar.name(frame), {})
        if len(said) >= grammar.remembered:
            _drop_the_late(said, now)
        said[exchange.frame, grammar.kind(frame)] = Said(exchange, frame, exchange.number, until)

    def forget(self, speaker: int) -> None:
        """Its fence has passed: no copy of what it has said is on its way any more."""
        self._said.pop(speaker, None)

    def could_answer(self, exchange: X, now: float) -> bool:
        """Whether a copy could be taken for the reply to this command, and be wrong."""
        grammar = self._grammar
        said = self._said.get(exchange.speaker)
        if not said:
            return False
        for name in grammar.names(exchange):
            replies = said.get(name)
            if not replies:
                continue
            if len(replies) > grammar.remembered:
                return True
            if any(it.until > now and grammar.is_harmful(it, exchange) for it in replies.values()):
                return True
        return False

    def are_from(self, speaker: int, frame: F) -> bool:
        """Whether somebody has said this before."""
        replies = self._said.get(speaker, {}).get(self._grammar.name(frame), {})
        return any(it.frame == frame for it in replies.values())


def _drop_the_late(said: dict[Hashable, Said], now: float) -> None:
    for key in [key for key, it in said.items() if it.until <= now]:
        del said[key]
