"""The supervisor by the names that it had before."""

from collections.abc import Awaitable, Callable, Iterable
from typing import Any, TypeVar

from gateway.core.supervisor import do_each, do_in_turn, insist, insist_after, supervised, twice

T = TypeVar("T")

restart_after_faults = supervised
retry_until_done = insist
run_each_logging = do_each
await_each_logging = do_in_turn
retry_once = twice


def when_done(task: Any, what: str, deed: Callable[[], object]) -> None:
    """Do what a motor waits for when a task has ended, however it has ended."""
    insist_after(task, what, lambda _: deed())


def ask_safely(what: str, question: Callable[[], T], otherwise: T) -> T:
    """Ask; after a fault it is taken to be as it does the least harm."""
    return next(iter(do_each(what, question)), otherwise)


def run_all_then_raise(deeds: Iterable[Callable[[], T]]) -> list[T]:
    """Do all of these; the first error is raised when all are done."""
    return do_each("several deeds", *deeds).or_raise()


async def await_with_one_retry(what: str, deed: Callable[[], Awaitable[object]]) -> None:
    """Wait for what may be done twice."""
    await do_in_turn(what, deed)
