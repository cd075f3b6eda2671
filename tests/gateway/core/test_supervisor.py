"""Work, deeds and observers that meet a fault of the gateway itself go on."""

import asyncio
from functools import partial
from itertools import pairwise

import pytest

from gateway.core.errors import NotFound
from gateway.core.supervisor import (
    AGAIN_S,
    WELL_S,
    FaultsTo,
    Observers,
    do_each,
    do_in_turn,
    insist,
    supervise,
)
from tests.plants import in_virtual_time


@in_virtual_time
async def test_work_is_begun_again_until_it_comes_to_its_end() -> None:
    begun: list[float] = []

    async def work() -> None:
        begun.append(asyncio.get_running_loop().time())
        if len(begun) < 4:
            raise ZeroDivisionError

    await supervise("the work", work)
    assert begun == [0.0, 0.5, 1.5, 3.5]


@in_virtual_time
async def test_what_has_gone_on_well_is_begun_again_at_once() -> None:
    begun: list[float] = []

    async def work() -> None:
        begun.append(asyncio.get_running_loop().time())
        if len(begun) == 10:
            return
        if len(begun) == 8:
            await asyncio.sleep(WELL_S + 1)
        raise ZeroDivisionError

    await supervise("the work", work)
    pauses = [later - earlier for earlier, later in pairwise(begun)]
    assert pauses[6] == AGAIN_S[1]
    assert pauses[7] == WELL_S + 1 + AGAIN_S[0]


@in_virtual_time
async def test_what_follows_a_task_is_done_however_the_task_ends() -> None:
    ended: list[bool] = []

    def note(task: asyncio.Task[None]) -> None:
        ended.append(task.cancelled())
        if len(ended) == 1:
            raise ZeroDivisionError

    task = supervise("the work", partial(asyncio.sleep, 10), note)
    task.cancel()
    await asyncio.sleep(0.1)
    assert ended == [True, True], "after a fault it is done again"


@in_virtual_time
async def test_work_that_is_waited_for_ends_with_the_one_who_waits() -> None:
    ends: list[str] = []

    async def work() -> None:
        try:
            await asyncio.sleep(60)
        finally:
            ends.append("work")

    async def owner() -> None:
        await supervise("the work", work)

    owning = asyncio.create_task(owner())
    await asyncio.sleep(1)
    owning.cancel()
    await asyncio.gather(owning, return_exceptions=True)
    assert ends == ["work"]


@in_virtual_time
async def test_a_deed_is_done_again_at_once_and_then_until_it_is_done() -> None:
    done_at: list[float] = []

    def deed(faults: int) -> None:
        done_at.append(asyncio.get_running_loop().time())
        if len(done_at) <= faults:
            raise ZeroDivisionError

    insist("the deed", partial(deed, 4))
    await asyncio.sleep(10)
    assert done_at == pytest.approx([0.0, 0.0, 0.05, 0.15, 0.35])


def test_a_deed_that_names_others_has_them_insisted_on_each_for_itself() -> None:
    done: list[str] = []

    def fail_once(name: str) -> None:
        done.append(name)
        if done.count(name) == 1:
            raise ZeroDivisionError

    insist("the deeds", lambda: (partial(fail_once, "a"), partial(done.append, "b")), lambda: ("no", "deeds"))
    assert done == ["a", "a", "b"]


def test_what_gives_a_result_is_done_twice_and_a_refusal_is_no_fault() -> None:
    outcomes: list[Exception | str] = [ZeroDivisionError(), "done", NotFound("There is none."), "never"]

    def deed() -> str:
        outcome = outcomes.pop(0)
        if isinstance(outcome, Exception):
            raise outcome
        return outcome

    assert do_each("the deed", deed).or_raise() == ["done"]
    with pytest.raises(NotFound):
        do_each("the deed", deed).or_raise()
    assert outcomes == ["never"]


def test_a_fault_in_one_keeps_none_of_the_others_from_it_and_can_be_passed_on() -> None:
    outcomes = do_each("the deeds", lambda: 1, lambda: 1 // 0, lambda: 3)
    assert outcomes == [1, 3]
    with pytest.raises(ZeroDivisionError):
        outcomes.or_raise()
    assert do_each("the deeds", lambda: 2).or_raise() == [2]


async def _fail(done: list[str], name: str, faults: int) -> None:
    done.append(name)
    if done.count(name) <= faults:
        raise ZeroDivisionError


@in_virtual_time
async def test_what_is_waited_for_in_turn_is_done_twice_at_most() -> None:
    done: list[str] = []
    await do_in_turn("the end", *(partial(_fail, done, name, faults) for name, faults in ENDS.items()))
    assert done == ["a", "b", "b", "c", "c", "d"]


@in_virtual_time
async def test_a_deed_names_others_which_are_done_before_those_that_follow() -> None:
    done: list[str] = []
    named = [partial(_fail, done, name, faults) for name, faults in ENDS.items()]
    await do_in_turn("the end", lambda: tuple(named), lambda: done.append("last"))
    assert done == ["a", "b", "b", "c", "c", "d", "last"]


ENDS = {"a": 0, "b": 1, "c": 9, "d": 0}


def test_an_observer_that_meets_a_fault_keeps_no_other_from_the_news() -> None:
    told: list[str] = []

    def fail(news: str) -> None:
        told.append(f"{news}, in vain")
        raise ZeroDivisionError

    observers = Observers[[str]]("the news")
    observers += [told.append, fail, told.append]
    observers("up")
    assert told == ["up", "up, in vain", "up"], "each is told once"


def test_a_fault_becomes_a_result_and_the_end_of_a_task_passes() -> None:
    told: list[Exception] = []
    survived = FaultsTo(told.append)
    with survived:
        raise ZeroDivisionError
    with survived:
        pass
    assert [type(fault) for fault in told] == [ZeroDivisionError]
    with pytest.raises(asyncio.CancelledError), survived:
        raise asyncio.CancelledError
