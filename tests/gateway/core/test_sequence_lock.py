"""One series is sent at a time: stops are seen to first, then commands, then reads."""

import asyncio
from contextvars import copy_context
from typing import Any

import pytest

from gateway.core.errors import Expired, QueueFull, StoppedFirst
from gateway.core.exchange import QUEUE_LIMIT, Lane
from gateway.core.sequence_lock import SequenceLock
from gateway.fics.exchange import RobotAnswered as RobotAnswered
from gateway.rorze.line import Line, lane_of
from gateway.rorze.session import Answered
from protocols.fics.jog import StopJog
from protocols.fics.status import GetAxisStatus
from protocols.fics.variables import GetVariable, SetVariable
from protocols.rorze.moves import MoveTo
from protocols.rorze.position import GetPosition
from protocols.rorze.row import RorzeCommand
from protocols.rorze.status import GetControllerStatus
from protocols.rorze.stops import StopImmediately
from tests.fics_plants import fics_rig
from tests.gateway.rorze.far_end import FarEnd, running_line, virtual
from tests.plants import in_virtual_time

LANES = (Lane.STOP, Lane.VERIFY, Lane.COMMAND, Lane.READ)


class Speakers:
    """The holders of the lock, in turn."""

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
        ("p", Lane.VERIFY),
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
    tasks += [it.begin(lane.name, lane) for lane in (Lane.STOP, Lane.VERIFY) for _ in range(QUEUE_LIMIT + 1)]
    await asyncio.gather(*tasks)
    assert len(it.spoken) == 3 * (QUEUE_LIMIT + 1)


# a series on an RC-400's line

FIRST, SECOND, FOREIGN = MoveTo(position=1), MoveTo(position=2), MoveTo(position=3)


class Outsider:
    """A task without the lock."""

    def __init__(self, line: Line) -> None:
        self._line = line
        self._context = copy_context()

    def ask(
        self, command: RorzeCommand[Any], body: int = 2, lane: Lane | None = None
    ) -> "asyncio.Future[Any]":
        lane = lane_of(command) if lane is None else lane
        return self._context.run(self._line.submit, body, command, lane)


@virtual
async def test_a_series_to_a_body_is_divided_by_stops_and_their_proofs_alone() -> None:
    far = FarEnd()
    async with running_line(far) as line:
        others = Outsider(line)
        async with line.undivided([2]):
            kept_waiting = [others.ask(FOREIGN), others.ask(GetPosition())]
            await line.submit(2, FIRST, Lane.COMMAND)
            others.ask(GetPosition(), lane=Lane.VERIFY)
            await others.ask(StopImmediately())
            await asyncio.sleep(0.1)
            assert not any(it.done() for it in kept_waiting)
            assert far.frames == ["&021AM1", "&026PD", "&025IS"]
        outcomes = await asyncio.gather(*kept_waiting)
        assert all(isinstance(it, Answered) for it in outcomes)
        assert far.frames[3:] == ["fence 02", "&021AM3", "&026PD"]


@virtual
async def test_other_bodies_go_on_while_a_series_is_sent() -> None:
    far = FarEnd()
    async with running_line(far) as line:
        others = Outsider(line)
        async with line.undivided([2]):
            assert isinstance(await others.ask(FOREIGN, 3), Answered)


@virtual
async def test_a_series_to_a_group_keeps_its_members_and_groups_with_them_waiting() -> None:
    far = FarEnd()
    async with running_line(far, groups={0x80: [2, 3], 0x81: [3]}) as line:
        others = Outsider(line)
        async with line.undivided([0x80]):
            waiting = [others.ask(GetControllerStatus(), body) for body in (2, 3, 0x80, 0x81)]
            await asyncio.sleep(1)
            assert not any(it.done() for it in waiting)
        async with line.undivided([3]):
            waiting = [others.ask(GetControllerStatus(), 0x81)]
            await asyncio.sleep(1)
            assert not waiting[0].done()


@virtual
async def test_what_waits_for_a_series_is_too_late_some_day() -> None:
    async with running_line(FarEnd()) as line:
        others = Outsider(line)
        async with line.undivided([2]):
            assert isinstance(await others.ask(FOREIGN), Expired)


@virtual
async def test_a_stop_ends_a_series_and_not_what_is_begun_after_it() -> None:
    far = FarEnd()
    async with running_line(far) as line:
        async with line.undivided([2, 3]):
            await line.submit(2, FIRST, Lane.COMMAND)
            line.gate.stop(3)
            assert isinstance(await line.submit(3, SECOND, Lane.COMMAND), StoppedFirst)
            assert isinstance(await line.submit(2, SECOND, Lane.COMMAND), Answered)
        assert "&031AM2" not in far.frames
        assert isinstance(await line.submit(3, FIRST, Lane.COMMAND), Answered)


@virtual
async def test_two_series_over_the_same_bodies_follow_each_other_whatever_their_order() -> None:
    far = FarEnd()
    async with running_line(far) as line:

        async def send(bodies: list[int], position: int) -> None:
            async with line.undivided(bodies):
                for body in bodies:
                    await line.submit(body, MoveTo(position=position), Lane.COMMAND)

        await asyncio.gather(send([2, 3], 1), send([3, 2], 2))
        sent = [frame for frame in far.frames if not frame.startswith("fence")]
        assert sent == ["&021AM1", "&031AM1", "&031AM2", "&021AM2"]


@virtual
async def test_nobody_slips_in_between_two_who_hold_the_lock_in_turn() -> None:
    far = FarEnd()
    async with running_line(far) as line:
        others = Outsider(line)

        async def send(command: MoveTo) -> None:
            async with line.undivided([2]):
                await line.submit(2, command, Lane.COMMAND)

        async with line.undivided([2]):
            after = asyncio.create_task(send(SECOND))
            await asyncio.sleep(0.1)
            foreign = others.ask(FOREIGN)
            await line.submit(2, FIRST, Lane.COMMAND)
        await asyncio.gather(after, foreign)
        sent = [frame for frame in far.frames if not frame.startswith("fence")]
        assert sent == ["&021AM1", "&021AM2", "&021AM3"]


# a series on a robot's line


@in_virtual_time
async def test_a_series_to_a_robot_is_kept_even_from_those_who_do_not_ask_for_the_lock() -> None:
    async with fics_rig() as rig:
        line, context = rig.robot.line, copy_context()
        async with line.sequence_lock.held():
            foreign = context.run(lambda: line.submit(line.exchange(GetAxisStatus(), Lane.READ)))
            stop = context.run(lambda: line.submit(line.exchange(StopJog(axis="X"), Lane.STOP)))
            await stop
            for row in (SetVariable(number=1, value=1.0), GetVariable(number=1)):
                assert isinstance(await line.submit(line.exchange(row, Lane.COMMAND)), RobotAnswered)
            assert not foreign.done()
        assert isinstance(await foreign, RobotAnswered)
