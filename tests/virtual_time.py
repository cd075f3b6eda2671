"""An asyncio loop whose clock jumps to the next timer when nothing is ready: plant time without waiting."""

import asyncio
import selectors
from collections.abc import Coroutine
from math import inf
from typing import Any, TypeVar

from recordings.virtual_loop import Inline

T = TypeVar("T")

THREADS_S = 5.0
"""Seconds of real time for work in a thread, while there is nothing else to do."""


LONGEST_S = inf
"""A story that lasts longer has failed."""
MOST_TURNS: float = inf
"""Turns at one instant after which a story has failed."""


class NeverEnds(Exception):
    """A story that was given bounds does not end within them."""


class _JumpingSelector(selectors.SelectSelector):
    """Instead of waiting for a timer, moves the loop's clock to it."""

    def __init__(self, turn_s: float) -> None:
        super().__init__()
        self.now = 0.0
        self._turn_s = turn_s
        self._turns = 0
        self._is_over = False

    def select(self, timeout: float | None = None) -> list[tuple[selectors.SelectorKey, int]]:
        self.now += self._turn_s
        self._turns += 1
        if not self._is_over and (self.now > LONGEST_S or self._turns > MOST_TURNS):
            self._is_over = True  # what is left behind may be cleared up
            raise NeverEnds(
                f"It is not over after {self.now:.1f} s, with {self._turns} turns at this instant."
            )
        if timeout == 0:
            return []  # what is ready goes first
        if ready := super().select(0):
            return ready
        if timeout is None:
            if from_a_thread := super().select(THREADS_S):
                return from_a_thread
            raise RuntimeError("virtual time stands still: no timer is set and nothing is ready")
        self.now += timeout
        self._turns = 0
        return []


class VirtualLoop(asyncio.SelectorEventLoop):
    """Runs timers in their order without waiting for them. For in-memory transports only.

    `turn_s` is what each turn of the loop takes: other programs have the processor meanwhile.
    """

    def __init__(self, turn_s: float = 0.0) -> None:
        self._jumping = _JumpingSelector(turn_s)
        super().__init__(self._jumping)
        self.set_default_executor(Inline())

    def time(self) -> float:
        return self._jumping.now

    def be_held_for(self, seconds: float) -> None:
        """Let time pass in which the loop does nothing."""
        self._jumping.now += seconds


def run_virtual(
    story: Coroutine[Any, Any, T], turn_s: float = 0.0, survives: type[Exception] | None = None
) -> T:
    """Run a coroutine to its end in virtual time, in which each turn of the loop takes `turn_s`.

    An error in a callback ends it at once, unless it is of the kind that the story survives; that, or tasks
    it leaves behind, fails the test.
    """
    loop = VirtualLoop(turn_s)
    task = loop.create_task(story)
    errors: list[dict[str, Any]] = []

    def fail(_: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        if survives and isinstance(context.get("exception"), survives):
            return
        errors.append(context)
        task.cancel()

    loop.set_exception_handler(fail)
    try:
        result = _result(loop, task, errors)
        leaked = asyncio.all_tasks(loop)
        _clear_up(loop)
        assert not leaked, f"tasks left running: {leaked}"
        assert not errors, errors
    except NeverEnds:
        _clear_up(loop)
        raise
    finally:
        loop.close()
    return result


def _clear_up(loop: VirtualLoop) -> None:
    """End what is left behind."""
    leaked = asyncio.all_tasks(loop)
    for leak in leaked:
        leak.cancel()
    if leaked:
        loop.run_until_complete(asyncio.wait(leaked))


def _result(loop: VirtualLoop, task: "asyncio.Task[T]", errors: list[dict[str, Any]]) -> T:
    try:
        return loop.run_until_complete(task)
    except asyncio.CancelledError:
        raise AssertionError(errors) from (errors[0].get("exception") if errors else None)
