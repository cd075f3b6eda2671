"""Unforeseen faults of the gateway itself: they are logged, and the work goes on."""

import asyncio
import logging
from collections.abc import Awaitable, Callable, Iterable
from typing import Any, Final, TypeVar

from gateway.core.errors import GatewayError

log = logging.getLogger(__name__)

T = TypeVar("T")

AGAIN_S: Final = (0.5, 30.0)
"""First and longest pause before work that has met a fault is begun again; it doubles in between."""
WELL_S: Final = 60.0
"""Work that has gone on for this time is believed to go on well: the next pause is the first again."""
INSIST_S: Final = 0.05
"""The first pause before a deed is done again that a motor waits for."""


async def restart_after_faults(what: str, work: Callable[[], Awaitable[None]]) -> None:
    """Do work to its end: after a fault it is begun again."""
    pause_s = AGAIN_S[0]
    loop = asyncio.get_running_loop()
    while True:
        began_at = loop.time()
        try:
            await work()
        except Exception:
            if loop.time() - began_at > WELL_S:
                pause_s = AGAIN_S[0]
            log.exception("%s has met a fault of the gateway itself, and goes on in %g s", what, pause_s)
        else:
            return
        await asyncio.sleep(pause_s)
        pause_s = min(2 * pause_s, AGAIN_S[1])


def retry_until_done(what: str, deed: Callable[[], object], pause_s: float = INSIST_S) -> None:
    """Do what a motor waits for: after a fault soon again, until it is done."""
    try:
        deed()
    except Exception:
        log.exception("%s has met a fault of the gateway itself, and is done again in %g s", what, pause_s)
        loop = asyncio.get_running_loop()
        loop.call_later(pause_s, retry_until_done, what, deed, min(2 * pause_s, AGAIN_S[1]))


def when_done(task: "asyncio.Task[Any]", what: str, deed: Callable[[], object]) -> None:
    """Do what a motor waits for when a task has ended, however it has ended."""
    task.add_done_callback(lambda _: retry_until_done(what, deed))


def run_each_logging(what: str, *deeds: Callable[[], object]) -> None:
    """Do all of these: a fault in one is logged, and keeps none of the others from it."""
    for deed in deeds:
        try:
            deed()
        except Exception:
            log.exception("%s has met a fault of the gateway itself", what)


async def await_each_logging(what: str, *deeds: Callable[[], Awaitable[object]]) -> None:
    """Wait for all of these in turn: a fault in one is logged, and keeps none of the others from it."""
    for deed in deeds:
        try:
            await deed()
        except Exception:
            log.exception("%s has met a fault of the gateway itself", what)


def ask_safely(what: str, question: Callable[[], T], otherwise: T) -> T:
    """Ask; after a fault it is taken to be as it does the least harm."""
    try:
        return question()
    except Exception:
        log.exception("%s has met a fault of the gateway itself", what)
        return otherwise


def run_all_then_raise(deeds: Iterable[Callable[[], T]]) -> list[T]:
    """Do all of these; the first error is raised when all are done."""
    results: list[T] = []
    errors: list[Exception] = []
    for deed in deeds:
        try:
            results.append(deed())
        except Exception as error:
            errors.append(error)
    if errors:
        raise errors[0]
    return results


def retry_once(what: str, deed: Callable[[], T]) -> T:
    """Do what may be done twice: after a fault at once again, and what that raises is passed on."""
    try:
        return deed()
    except GatewayError:  # a refusal, and no fault
        raise
    except Exception:
        log.exception("%s has met a fault of the gateway itself, and is done again", what)
        return deed()


async def await_with_one_retry(what: str, deed: Callable[[], Awaitable[object]]) -> None:
    """Wait for what may be done twice: after a fault at once again, and what that raises is passed on."""
    try:
        await deed()
    except Exception:
        log.exception("%s has met a fault of the gateway itself, and is done again", what)
        await deed()
