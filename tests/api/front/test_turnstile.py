"""Few requests begin in one turn of the loop, and in their order."""

import asyncio

from api.front.turnstile import STOP_PAUSE_S, STOP_TURNS, Turnstile
from tests.virtual_time import run_virtual


def test_in_each_turn_of_the_loop_a_few_begin_in_their_order() -> None:
    async def story() -> None:
        turnstile, begun = Turnstile(at_once=2), list[int]()
        for number in range(5):
            turnstile.enter(lambda number=number: begun.append(number))  # type: ignore[misc]
        seen = [list(begun)]
        for _ in range(4):
            await asyncio.sleep(0)
            seen.append(list(begun))
        assert seen == [[0, 1], [0, 1, 2, 3], [0, 1, 2, 3, 4], [0, 1, 2, 3, 4], [0, 1, 2, 3, 4]]

    run_virtual(story())


def test_of_a_crowd_one_begins_at_a_time() -> None:
    async def story() -> None:
        turnstile, begun = Turnstile(at_once=2, crowd=3), list[int]()
        for number in range(7):
            turnstile.enter(lambda number=number: begun.append(number))  # type: ignore[misc]
        counts = [len(begun)]
        for _ in range(2):
            await asyncio.sleep(0)
            counts.append(len(begun))
        for _ in range(4):
            turnstile.leave()
        for _ in range(2):
            await asyncio.sleep(0)
            counts.append(len(begun))
        assert counts == [2, 3, 4, 6, 7]

    run_virtual(story())


def test_who_comes_alone_begins_at_once() -> None:
    async def story() -> None:
        turnstile, begun = Turnstile(at_once=1), list[int]()
        for number in range(3):
            turnstile.enter(lambda number=number: begun.append(number))  # type: ignore[misc]
            assert begun[-1] == number
            await asyncio.sleep(0.001)

    run_virtual(story())


def test_who_comes_later_does_not_go_first() -> None:
    async def story() -> None:
        turnstile, begun = Turnstile(at_once=1), list[str]()
        for name in "ab":
            turnstile.enter(lambda name=name: begun.append(name))  # type: ignore[misc]
        asyncio.get_running_loop().call_soon(turnstile.enter, lambda: begun.append("c"))
        await asyncio.sleep(0.001)
        assert begun == ["a", "b", "c"]

    run_virtual(story())


def test_where_other_programs_have_the_processor_a_stop_has_turns_of_the_loop_before_others_begin() -> None:
    async def story() -> None:
        turnstile, begun = Turnstile(), list[int]()
        turnstile.begin_stop()
        for number in range(20):
            turnstile.enter(lambda number=number: begun.append(number))  # type: ignore[misc]
        for _ in range(3 * STOP_TURNS):
            await asyncio.sleep(0)
        assert len(begun) <= 3

    run_virtual(story(), turn_s=STOP_PAUSE_S)
