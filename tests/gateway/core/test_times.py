"""Waiting: it ends with the event, or when the time is up."""

import asyncio

import pytest

from gateway.core.times import happens, together
from tests.gateway.rorze.far_end import virtual


@virtual
async def test_waiting_ends_with_the_event() -> None:
    event, loop = asyncio.Event(), asyncio.get_running_loop()
    loop.call_later(1.0, event.set)
    began_at = loop.time()
    assert await happens(event, 5.0)
    assert loop.time() - began_at == pytest.approx(1.0)
    assert await happens(event, 5.0)
    assert loop.time() - began_at == pytest.approx(1.0)


@virtual
async def test_waiting_ends_when_the_time_is_up() -> None:
    loop = asyncio.get_running_loop()
    began_at = loop.time()
    assert not await happens(asyncio.Event(), 5.0)
    assert loop.time() - began_at == pytest.approx(5.0)


@virtual
async def test_works_are_done_together_and_one_alone_where_it_stands() -> None:
    loop = asyncio.get_running_loop()
    began_at = loop.time()
    await together(asyncio.sleep(2.0), asyncio.sleep(3.0))
    await together(asyncio.sleep(1.0))
    assert loop.time() - began_at == pytest.approx(4.0)

    async def mine() -> None:
        assert asyncio.current_task() is here

    here = asyncio.current_task()
    await together(mine())
