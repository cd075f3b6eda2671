"""What is read to decide something: on a line that garbles frames it has to be read twice."""

import asyncio
from collections import deque
from collections.abc import AsyncGenerator, Awaitable, Callable, Coroutine, Iterable
from operator import eq
from typing import Any, TypeVar

from gateway.core.errors import NotSent
from gateway.rorze.asked_body import AskedBody, AskedLine
from protocols.rorze.notation import PositionReference
from protocols.rorze.position_table import GetNumberedPositionEntry

CLEAN_AFTER_S = 10.0
"""A line without an error for this time is clean: a body that answers no question and no fence is gone."""
MOST_READINGS = 8
"""What differs so often cannot be known."""

AHEAD = 2
"""So many questions of one reader are at the line, that it has no rest; more would hold up others."""

T = TypeVar("T")


def errs(line: AskedLine) -> bool:
    """Whether the line has lately garbled or lost a frame."""
    error_at = line.last_error_at
    return error_at is not None and asyncio.get_running_loop().time() - error_at < CLEAN_AFTER_S


async def believed(
    line: AskedLine, read: Callable[[], Awaitable[T]], agree: Callable[[Any, Any], bool] = eq
) -> T:
    """Give a reading; while the line errs, one that came twice in a row.

    :raises NotSent: no two readings agree.
    :raises GatewayError: it was not read.
    """
    found = await read()
    for _ in range(MOST_READINGS):
        if not errs(line):
            return found
        again = await read()
        if agree(found, again):
            return again
        found = again
    raise NotSent(
        f"Line {line.id} garbles its frames: no two readings agree; only questions were sent.", "Try again."
    )


async def read_pulses(body: AskedBody, number: int) -> int:
    """Read one stored position (3ND); on a line that errs it is believed when it came twice.

    :raises GatewayError: it was not read.
    """
    command = GetNumberedPositionEntry(entry=PositionReference(position=number))

    async def ask() -> int:
        return (await body.ask(command))[0].pulses

    return await believed(body.line, ask)


async def closely(questions: Iterable[Coroutine[Any, Any, T]]) -> AsyncGenerator[T, None]:
    """Give answers in order; the next question waits at the line while the one before is answered.

    :raises GatewayError: one was not answered.
    """
    asked: deque[asyncio.Task[T]] = deque()
    try:
        for question in questions:
            asked.append(asyncio.create_task(question))
            if len(asked) == AHEAD:
                yield await asked.popleft()
        while asked:
            yield await asked.popleft()
    finally:
        for task in asked:
            task.cancel()
        await asyncio.gather(*asked, return_exceptions=True)
