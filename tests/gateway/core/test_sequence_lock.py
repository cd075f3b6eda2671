"""One series is sent at a time: stops are seen to first, then commands, then reads."""

import asyncio

import pytest

from gateway.core.errors import QueueFull
from gateway.core.lanes import QUEUE_LIMIT, Lane
from gateway.core.sequence_lock import SequenceLock
from tests.plants import in_virtual_time

LANES = (Lane.STOP, Lane.PROOF, Lane.COMMAND, Lane.READ)


class Speakers:
    """Who has had the lock, in turn."""

    def __init__(self) -> None:
        self.lock = SequenceLock()
        self.spoken: list[str] = []

    async def speak(self, name: str, lane: Lane) -> None:
        async with self.lock.held(lane):
            self.spoken.append(name)
            await asyncio.sleep(1)

    def begin(self, name: str, lane: Lane) -> "asyncio.Task[None]":
        return asyncio.create_task(self.speak(name, lane))


@in_virtual_time
async def test_lanes_go_in_their_order_and_each_in_turn() -> None:
    it = Speakers()
    tasks = [it.begin("first", Lane.READ)]
    await asyncio.sleep(0)
    wanted = [
        ("r1", Lane.READ),
        ("r2", Lane.READ),
        ("c1", Lane.COMMAND),
        ("p", Lane.PROOF),
        ("s", Lane.STOP),
        ("c2", Lane.COMMAND),
    ]
    tasks += [it.begin(name, lane) for name, lane in wanted]
    await asyncio.sleep(0.5)
    assert {lane: it.lock.waiting(lane) for lane in LANES} == dict(zip(LANES, (1, 1, 2, 2), strict=True))
    await asyncio.gather(*tasks)
    assert it.spoken == ["first", "s", "p", "c1", "c2", "r1", "r2"]
    assert not any(it.lock.waiting(lane) for lane in Lane)


@in_virtual_time
async def test_who_gives_up_waiting_keeps_nobody_waiting() -> None:
    it = Speakers()
    first, second, third = (it.begin(name, Lane.COMMAND) for name in "abc")
    await asyncio.sleep(0.5)
    second.cancel()
    await asyncio.gather(first, third)
    await asyncio.wait({second})
    assert it.spoken == ["a", "c"]


@in_virtual_time
async def test_the_lock_goes_on_if_it_comes_to_somebody_who_has_just_given_up() -> None:
    lock, spoken = SequenceLock(), list[str]()

    async def speak(name: str) -> None:
        async with lock.held():
            spoken.append(name)

    async with lock.held():
        second, third = asyncio.create_task(speak("b")), asyncio.create_task(speak("c"))
        await asyncio.sleep(1)
    second.cancel()  # it has been given the lock, and has not run since
    await asyncio.wait({second, third})
    assert spoken == ["c"]
    await speak("d")


@in_virtual_time
async def test_too_many_are_told_at_once_but_never_the_proofs_of_stops_and_moves() -> None:
    it = Speakers()
    tasks = [it.begin(str(number), Lane.READ) for number in range(QUEUE_LIMIT + 1)]
    await asyncio.sleep(0)
    with pytest.raises(QueueFull, match="nothing was sent"):
        await it.speak("one too many", Lane.READ)
    tasks += [it.begin(lane.name, lane) for lane in (Lane.STOP, Lane.PROOF) for _ in range(QUEUE_LIMIT + 1)]
    await asyncio.gather(*tasks)
    assert len(it.spoken) == 3 * (QUEUE_LIMIT + 1)
