"""The runner that asks for all that a command needs before the command is written."""

from collections.abc import Awaitable, Callable, Iterable, Sequence
from typing import Generic, NamedTuple, TypeVar

from gateway.core.exchange import current_series
from gateway.core.sequence_lock import SequenceLock

Q = TypeVar("Q")
"""A family's questions."""
A = TypeVar("A")
"""The outcomes of its questions."""


class Asked(NamedTuple, Generic[Q, A]):
    """A question that was asked, and its outcome."""

    question: Q
    outcome: A


Missing = Callable[[Sequence[Asked[Q, A]]], Q | None]
"""Gives the next question of a need, after the ones that were asked for it; None when nothing is missing.

It is pure: it reads what is known and asks nothing. It raises the refusal where the command must not be sent.
"""


async def prepare(
    lock: SequenceLock | None, needs: Iterable[Missing[Q, A]], ask: Callable[[Q], Awaitable[A]]
) -> None:
    """Ask for what is missing, need by need, with the sequence lock held.

    Without a lock every answer names its controller: then questions of others may come in between.

    A need is looked at when all before it are met, so it may depend on what they have told.

    :raises GatewayError: the command must not be sent; the error is that of the need.
    :raises RuntimeError: another task could write in between, for the lock is not held here.
    """
    if lock is not None and (lock.holder is None or lock.holder is not current_series()):
        raise RuntimeError("a preparation needs the sequence lock")
    for missing in needs:
        heard: list[Asked[Q, A]] = []
        while (question := missing(heard)) is not None:
            heard.append(Asked(question, await ask(question)))
