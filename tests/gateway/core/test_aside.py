"""Long work is done beside the loop, by one thread at a time, and its errors reach who asked."""

import asyncio
import threading
from time import monotonic

import pytest

from gateway.core.aside import aside

PATIENCE_S = 60.0


def test_the_loop_goes_on_while_work_is_done() -> None:
    async def story() -> None:
        go_on = threading.Event()
        work = asyncio.create_task(aside(go_on.wait, PATIENCE_S))
        await asyncio.sleep(0.01)
        assert not work.done()
        go_on.set()
        assert await work

    asyncio.run(story())


def test_one_works_at_a_time_in_the_order_of_coming() -> None:
    async def story() -> None:
        begun, at_work = list[int](), threading.Semaphore()

        def work(number: int) -> bool:
            begun.append(number)
            alone = at_work.acquire(blocking=False)
            until = monotonic() + 0.002
            while monotonic() < until:
                pass
            at_work.release()
            return alone

        assert all(await asyncio.gather(*(aside(work, number) for number in range(5))))
        assert begun == [0, 1, 2, 3, 4]

    asyncio.run(story())


def test_an_error_is_the_callers_and_the_next_has_its_turn() -> None:
    async def story() -> None:
        with pytest.raises(ValueError, match="invalid literal"):
            await aside(int, "x")
        assert await aside(int, "10", base=2) == 2

    asyncio.run(story())


def test_who_does_not_wait_any_more_leaves_the_turn_to_others() -> None:
    async def story() -> None:
        go_on = threading.Event()
        first = asyncio.create_task(aside(go_on.wait, PATIENCE_S))
        second = asyncio.create_task(aside(int, "1"))
        await asyncio.sleep(0.01)
        second.cancel()
        third = asyncio.create_task(aside(int, "3"))
        go_on.set()
        assert await first
        assert await third == 3
        assert second.cancelled()

    asyncio.run(story())
