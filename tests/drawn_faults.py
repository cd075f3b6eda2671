"""A fault of the gateway itself at a drawn place: one call of one of its functions raises, none is named.

A story runs once to count what it calls of the gateway. A seed draws one of these functions and one of its
calls; the story runs again, and that call raises. The profiler's hook does it: no function is replaced, so
a change of names or of shape changes no test.
"""

import dis
import sys
from collections import Counter
from collections.abc import Callable, Coroutine, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cache
from inspect import CO_ASYNC_GENERATOR, CO_GENERATOR
from pathlib import Path
from random import Random
from types import CodeType, FrameType
from typing import Any

from tests.virtual_time import run_virtual

ROOT = Path(__file__).parents[1]
_FOLDERS = tuple(f"{ROOT / folder}/" for folder in ("gateway", "api"))

AGAIN_S = 30.0
"""Seconds after which the gateway is itself again, whatever has happened."""
STRUCK = "functions struck by drawn faults"
"""The property of a test under which it reports them."""
_SURVIVORS = {str(ROOT / "gateway/core/supervisor.py")}
"""The functions that survive faults of others; a fault in one of these is a fault of Python itself."""


class DrawnFault(Exception):
    """An exception that the gateway does not foresee."""


@dataclass
class Strike:
    """The call that raises: of this function, the call with this number. Without one, calls are counted."""

    code: CodeType | None = None
    number: int = 0
    raised: bool = False
    counts: Counter[CodeType] = field(default_factory=Counter)

    @contextmanager
    def __call__(self) -> Iterator[None]:
        """Count, or strike, while the body of the `with` and the loop run."""
        sys.setprofile(self._count if self.code is None else self._raise)
        try:
            yield
        finally:
            sys.setprofile(None)

    def _count(self, frame: FrameType, event: str, _: Any) -> None:
        code = frame.f_code
        if event == "call" and _may_fail(code) and frame.f_lasti <= _first(code):
            self.counts[code] += 1

    def _raise(self, frame: FrameType, event: str, _: Any) -> None:
        code = frame.f_code
        if event == "call" and code is self.code and frame.f_lasti <= _first(code):
            self.number -= 1
            if self.number <= 0:
                self.raised = True
                sys.setprofile(None)
                raise DrawnFault(place(code))


Story = Callable[[Strike], Coroutine[Any, Any, None]]


@cache
def _may_fail(code: CodeType) -> bool:
    """Say whether faults are drawn in a function; a generator is also called to throw it away."""
    file = code.co_filename
    ours = file.startswith(_FOLDERS) and file not in _SURVIVORS
    return ours and not code.co_flags & (CO_GENERATOR | CO_ASYNC_GENERATOR)


@cache
def _first(code: CodeType) -> int:
    """The instruction at which a call begins; a coroutine that goes on is further."""
    return next(each.offset for each in dis.get_instructions(code) if each.opname == "RESUME")


def place(code: CodeType) -> str:
    """File, line and name of a function."""
    return f"{Path(code.co_filename).relative_to(ROOT)}:{code.co_firstlineno} {code.co_name}"


def functions(story: Story) -> list[tuple[CodeType, int]]:
    """The gateway's functions that a story calls, and how often each, in a fixed order."""
    count = Strike()
    run_virtual(story(count))
    return sorted(count.counts.items(), key=lambda found: place(found[0]))


def strike(story: Story, code: CodeType, calls: int, dice: Random) -> str | None:
    """Run a story in which a drawn call of a function raises; what it breaks, if anything."""
    drawn = Strike(code, dice.randint(1, calls))
    number = drawn.number
    try:
        run_virtual(story(drawn), survives=DrawnFault)
    except BaseException as error:
        return f"{place(code)}, call {number} of {calls}: {type(error).__name__}: {error}"
    return None
