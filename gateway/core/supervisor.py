"""The place where unforeseen faults of the gateway itself end: they are logged, and the work goes on.

`supervise` is for a task that has to last: it is begun again after a pause. `insist` is for what a motor
waits for: it is done until it is done. `do_each`, and `do_in_turn` for what is awaited, do several deeds each
for itself. `FaultsTo` makes a result of a fault. A fault in all else travels up to one of these, or to the
top of a request. Nothing else in the gateway survives a fault (`tests/test_survivors.py`).
"""

import asyncio
import logging
from collections.abc import Awaitable, Callable
from functools import partial
from inspect import isawaitable
from types import TracebackType
from typing import Any, Final, Generic, ParamSpec, TypeGuard, TypeVar

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
    """Begin a task that does work to its end, however often it meets a fault; it may be awaited at once.

    `then` is insisted on when the task ends, however it ends.
    """
    task = asyncio.create_task(_supervised(what, work), name=what)
    if then is not None:
        task.add_done_callback(lambda ended: insist(what, partial(then, ended)))
    return task


async def _supervised(what: str, work: Callable[[], Awaitable[None]]) -> None:
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


def insist(what: str, *deeds: Deed) -> None:
    """Do what may be done twice: after a fault at once again, and then again and again until it is done.

    A deed that gives a tuple names others, which are insisted on next.
    """
    for deed in deeds:
        _insist(what, deed, 0.0)


def _insist(what: str, deed: Deed, pause_s: float) -> None:
    try:
        done = deed()
    except Exception:
        log.exception("%s has met a fault of the gateway itself, and is done again in %g s", what, pause_s)
        if pause_s:
            loop = asyncio.get_running_loop()
            loop.call_later(pause_s, _insist, what, deed, min(2 * pause_s, AGAIN_S[1]))
        else:
            _insist(what, deed, INSIST_S)
    else:
        if _are_deeds(done):
            insist(what, *done)


def _are_deeds(done: object) -> TypeGuard[tuple[Deed, ...]]:
    return type(done) is tuple and all(map(callable, done))


# several deeds, each for itself


class Outcomes(list[T]):
    """The results of deeds that met no fault."""

    fault: Exception | None = None
    """The first fault, or refusal, of those that did."""

    def first(self, otherwise: T) -> T:
        """Give the first result; after a fault that of a cautious answer."""
        return self[0] if self else otherwise

    def or_raise(self) -> "Outcomes[T]":
        """Pass the first fault on."""
        if self.fault is not None:
            raise self.fault
        return self

    def note(self, what: str, error: Exception) -> None:
        """Note a fault, and log it; a refusal is none."""
        self.fault = self.fault or error
        if not isinstance(error, GatewayError):
            log.error("%s has met a fault of the gateway itself", what, exc_info=error)


def do_each(what: str, *deeds: Callable[[], T]) -> Outcomes[T]:
    """Do all of these: a fault in one keeps none of the others from it.

    Each may be done twice: after a fault it is done once more, at once.
    """
    outcomes: Outcomes[T] = Outcomes()
    for deed in deeds:
        try:
            outcomes.append(deed())
        except Exception as error:
            _once_more(outcomes, what, deed, error)
    return outcomes


def _once_more(outcomes: Outcomes[T], what: str, deed: Callable[[], T], error: Exception) -> None:
    if isinstance(error, GatewayError):
        outcomes.note(what, error)
        return
    log.error("%s has met a fault of the gateway itself, and is done again", what, exc_info=error)
    try:
        outcomes.append(deed())
    except Exception as fault:
        outcomes.note(what, fault)


async def do_in_turn(what: str, *deeds: Deed) -> Outcomes[Any]:
    """Do all of these as `do_each` does, and wait for each where it gives something to wait for.

    A deed that gives a tuple names others, which are done next.
    """
    outcomes: Outcomes[Any] = Outcomes()
    for deed in deeds:
        try:
            outcomes.append(await _awaited_twice(what, deed))
        except Exception as error:
            outcomes.note(what, error)
    return outcomes


async def _awaited_twice(what: str, deed: Deed) -> object:
    try:
        return await _awaited(what, deed)
    except GatewayError:
        raise
    except Exception:
        log.exception("%s has met a fault of the gateway itself, and is done again", what)
    return await _awaited(what, deed)


async def _awaited(what: str, deed: Deed) -> object:
    done = deed()
    if isawaitable(done):
        return await done
    return await do_in_turn(what, *done) if _are_deeds(done) else done


class Observers(list[Callable[P, object]], Generic[P]):
    """Callables that are told the same, each for itself."""

    __slots__ = ("_what",)

    def __init__(self, what: str) -> None:
        """`what` names the news in the log."""
        super().__init__()
        self._what = what

    def __call__(self, *told: P.args, **named: P.kwargs) -> None:
        """Tell all of them, each once: news that came twice would be other news."""
        for observer in self:
            try:
                observer(*told, **named)
            except Exception:
                log.exception("%s has met a fault of the gateway itself", self._what)


# a fault that becomes a result


class FaultsTo:
    """A block whose fault goes to `heed`; it is made once, and used again."""

    __slots__ = ("_heed",)

    def __init__(self, heed: Callable[[Exception], object]) -> None:
        self._heed = heed

    def __enter__(self) -> None:
        """Begin the block."""

    def __exit__(self, _: object, fault: BaseException | None, __: TracebackType | None) -> bool:
        """Let `heed` go on after a fault; an end of the task itself passes."""
        if not isinstance(fault, Exception):
            return False
        self._heed(fault)
        return True
