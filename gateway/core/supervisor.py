"""The place where unforeseen faults of the gateway itself end: they are logged, and the work goes on.

A task that has to last is supervised: it is begun again after a pause. The gateway insists on what a motor
waits for: it is done at once again. Deeds and observers are done each for itself.
"""

import asyncio
import logging
from collections.abc import Awaitable, Callable
from functools import partial
from inspect import isawaitable
from typing import Final, Generic, ParamSpec, TypeVar

from gateway.core.errors import GatewayError

log = logging.getLogger(__name__)

T = TypeVar("T")
P = ParamSpec("P")

Deed = Callable[[], object]

AGAIN_S: Final = (0.5, 30.0)
"""First and longest pause before supervised work is begun again; it doubles in between."""
WELL_S: Final = 60.0
"""Work that has gone on for this time is believed to go on well: the next pause is the first again."""
INSIST_S: Final = 0.05
"""The first pause before a deed is done a third time."""


# tasks that have to last


def supervise(
    what: str,
    work: Callable[[], Awaitable[None]],
    then: "Callable[[asyncio.Task[None]], object] | None" = None,
) -> "asyncio.Task[None]":
    """Begin a task that does work to its end, however often it meets a fault.

    `then` is insisted on when the task ends, however it ends.
    """
    task = asyncio.create_task(supervised(what, work), name=what)
    if then is not None:
        insist_after(task, what, then)
    return task


async def supervised(what: str, work: Callable[[], Awaitable[None]]) -> None:
    """Do work to its end here: after a fault it is begun again."""
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


# deeds that a motor waits for


def insist(what: str, *deeds: Callable[[], object]) -> None:
    """Do what a motor waits for, and may be done twice: after a fault at once again, until it is done."""
    for deed in deeds:
        try:
            deed()
        except Exception:
            log.exception("%s has met a fault of the gateway itself, and is done again at once", what)
            _insist(what, deed, INSIST_S)


def _insist(what: str, deed: Callable[[], object], pause_s: float) -> None:
    try:
        deed()
    except Exception:
        log.exception("%s has met a fault of the gateway itself, and is done again in %g s", what, pause_s)
        loop = asyncio.get_running_loop()
        loop.call_later(pause_s, _insist, what, deed, min(2 * pause_s, AGAIN_S[1]))


def insist_after(task: "asyncio.Task[T]", what: str, deed: "Callable[[asyncio.Task[T]], object]") -> None:
    """Do what a motor waits for when a task has ended, however it has ended."""
    task.add_done_callback(lambda ended: insist(what, partial(deed, ended)))


def twice(what: str, deed: Callable[P, T], *given: P.args, **named: P.kwargs) -> T:
    """Do what may be done twice, and give its result: after a fault at once again.

    :raises GatewayError: it is refused, which is no fault.
    :raises Exception: the second attempt has met a fault, too.
    """
    try:
        return deed(*given, **named)
    except GatewayError:
        raise
    except Exception:
        log.exception("%s has met a fault of the gateway itself, and is done again", what)
        return deed(*given, **named)


# several, each for itself


class Outcomes(list[T]):
    """The results of deeds that met no fault."""

    fault: Exception | None = None
    """The first fault of those that did."""

    def first(self, otherwise: T) -> T:
        """Give the first result; after a fault that of a cautious answer."""
        return self[0] if self else otherwise

    def or_raise(self) -> "Outcomes[T]":
        """Pass the first fault on."""
        if self.fault is not None:
            raise self.fault
        return self


def do_each(what: str, *deeds: Callable[[], T]) -> Outcomes[T]:
    """Do all of these: a fault in one keeps none of the others from it."""
    done: Outcomes[T] = Outcomes()
    for deed in deeds:
        try:
            done.append(deed())
        except Exception as fault:
            log.exception("%s has met a fault of the gateway itself", what)
            done.fault = done.fault or fault
    return done


async def do_in_turn(what: str, *deeds: Callable[[], object]) -> None:
    """Do all of these, awaited or not, which may be done twice: after a fault each is done once more.

    A deed that gives a tuple names others, which are done next.
    """
    for deed in deeds:
        for _ in range(2):
            try:
                done = deed()
                if isawaitable(done):
                    await done
                elif isinstance(done, tuple):
                    await do_in_turn(what, *done)
            except Exception:
                log.exception("%s has met a fault of the gateway itself", what)
            else:
                break


class Observers(list[Callable[P, object]], Generic[P]):
    """Callables that are told the same, each for itself."""

    __slots__ = ("_what",)

    def __init__(self, what: str | Callable[P, str]) -> None:
        """`what` names the news in the log."""
        super().__init__()
        self._what = what

    def __call__(self, *told: P.args, **named: P.kwargs) -> None:
        """Tell all of them."""
        for observer in self:
            try:
                observer(*told, **named)
            except Exception:
                what = self._what if isinstance(self._what, str) else self._what(*told, **named)
                log.exception("%s has met a fault of the gateway itself", what)
