"""A bridge ends when it is told to, whatever its parts do with that."""

import asyncio
from contextlib import suppress

import pytest

from bridges.common import process
from tests.plants import in_virtual_time


async def loses_one_cancellation() -> None:
    """As a library does that was just done with something when it was cancelled."""
    with suppress(asyncio.CancelledError):
        await asyncio.sleep(3600.0)
    await asyncio.sleep(3600.0)


async def in_a_group() -> None:
    async with asyncio.TaskGroup() as group:
        group.create_task(loses_one_cancellation())


async def fails_at_the_end() -> None:
    try:
        await asyncio.sleep(3600.0)
    finally:
        raise RuntimeError("at the end")


@in_virtual_time
async def test_a_part_that_loses_its_cancellation_keeps_nobody_from_ending() -> None:
    ending, clock = asyncio.Event(), asyncio.get_running_loop().time
    asyncio.get_running_loop().call_later(1.0, ending.set)
    await process._until(ending, in_a_group(), fails_at_the_end())
    assert clock() == pytest.approx(1.0 + process.ENDS_WITHIN_S, abs=0.1)
    left = asyncio.all_tasks() - {asyncio.current_task()}
    for task in left:  # as asyncio.run does
        task.cancel()
    await asyncio.wait(left)


@in_virtual_time
async def test_a_part_that_fails_ends_all_with_its_error() -> None:
    async def fails() -> None:
        raise ValueError("no room")

    with pytest.raises(ValueError, match="no room"):
        await process._until(asyncio.Event(), fails(), asyncio.sleep(3600.0))
