"""Long work beside the event loop, in a thread, one piece at a time."""

import asyncio
from collections.abc import Callable
from typing import Final, ParamSpec, TypeVar
from weakref import WeakKeyDictionary

P = ParamSpec("P")
T = TypeVar("T")

SWITCH_S: Final = 0.0002
"""A thread lets the event loop go on after this time; the interpreter's own 5 ms would hold it several times
in each of a stop's dozen turns (`sys.setswitchinterval`)."""

_turns: "WeakKeyDictionary[asyncio.AbstractEventLoop, asyncio.Lock]" = WeakKeyDictionary()


async def aside(work: Callable[P, T], *args: P.args, **kwargs: P.kwargs) -> T:
    """Do work that computes for milliseconds beside the event loop, when others that wait have done theirs.

    Two threads that compute would take two turns of the interpreter for one of the loop. Work that only
    waits, as for a disk, has `asyncio.to_thread`. Not one call of the work into C may take longer than some
    milliseconds: the loop waits for its end.
    """
    loop = asyncio.get_running_loop()
    turn = _turns.get(loop)
    if turn is None:
        turn = _turns[loop] = asyncio.Lock()
    async with turn:
        return await asyncio.to_thread(work, *args, **kwargs)
