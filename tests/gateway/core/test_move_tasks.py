"""Moves are seen through in tasks of their own, and what was asked for is told its beginning."""

import asyncio

import pytest

from gateway.core.move_tasks import Beginning, MoveTasks
from tests.gateway.rorze.far_end import virtual


class Run:
    """A move that begins after a second and ends after two."""

    def __init__(self) -> None:
        self.beginning: Beginning = asyncio.get_running_loop().create_future()
        self.over = False

    async def seen_through(self) -> None:
        await asyncio.sleep(1.0)
        self.beginning.set_result(None)
        await asyncio.sleep(1.0)
        self.over = True


def nobody(why: str) -> None:
    pytest.fail(why)


@virtual
async def test_after_a_fault_of_the_gateway_itself_a_move_is_given_up_and_its_caller_told() -> None:
    async def faulty() -> None:
        raise ZeroDivisionError

    told: list[str] = []
    tasks, run = MoveTasks(), Run()
    tasks.add("m1", faulty, run.beginning, told.append)
    with pytest.raises(ZeroDivisionError):
        await run.beginning
    await asyncio.sleep(0)
    assert told == ["A fault of the gateway itself (ZeroDivisionError) has ended its watch over the move."]


@virtual
async def test_a_beginning_is_waited_for_and_not_the_end() -> None:
    tasks, run = MoveTasks(), Run()
    await tasks.begun()
    tasks.add("m1", run.seen_through, run.beginning, nobody)
    await tasks.begun()
    assert run.beginning.done()
    assert not run.over
    await asyncio.sleep(1.0)
    assert run.over


@virtual
async def test_at_the_close_a_move_still_begins_and_is_followed_no_more() -> None:
    tasks, run = MoveTasks(), Run()
    tasks.add("m1", run.seen_through, run.beginning, nobody)
    await tasks.close()
    assert run.beginning.done()
    await asyncio.sleep(2.0)
    assert not run.over


@virtual
async def test_nobody_waits_for_a_beginning_that_will_not_come() -> None:
    async def broken_off() -> None:
        return

    tasks, run = MoveTasks(), Run()
    tasks.add("m1", broken_off, run.beginning, nobody)
    with pytest.raises(asyncio.CancelledError):
        await run.beginning
