"""A SCARA robot on a bad wire, with axes that fail: what is called done was done, and what is over stands.

Commands and replies are lost, replies garbled and doubled; the simulator's truth is the judge. A seed that
fails is named in the test's id.
"""

import asyncio
from collections import Counter
from random import Random

import pytest

from gateway.core.errors import GatewayError
from gateway.core.move_record import MoveStatus
from gateway.rorze_scara.record import ScaraMove
from simulator.faults import Direction, Fault, Switch
from simulator.rorze.world import EMS
from tests.drawing import drawn
from tests.gateway.rorze_scara.cell import START, Cell, cell, mm
from tests.virtual_time import run_virtual

SEEDS = range(4)
MOVES = 12
BAD_WIRE = (
    Switch(Fault.LOST, Direction.REQUESTS, 0.03),
    Switch(Fault.LOST, Direction.REPLIES, 0.03),
    Switch(Fault.GARBLED, Direction.REPLIES, 0.02),
    Switch(Fault.DOUBLED, Direction.REPLIES, 0.02, delay_s=0.01, spread_s=0.3),
)
ENDED = (MoveStatus.SUCCEEDED, MoveStatus.STOPPED, MoveStatus.FAILED)
FAILING = 0.25
"""The share of moves in which an axis fails."""


async def fail(robot: Cell, dice: Random) -> None:
    """An axis is held by EMS for a while, or loses its power."""
    await asyncio.sleep(dice.uniform(0.5, 3.0))
    number = dice.choice(robot.numbers)
    if dice.random() < 0.5:
        robot.rig.touch(number, lambda axis: axis.world.forced.update({EMS: True}))
        await asyncio.sleep(1.0)
        robot.rig.touch(number, lambda axis: axis.world.forced.clear())
    else:
        robot.switch(number, on=False)
        await asyncio.sleep(dice.choice((0.0, 0.5)))
        robot.switch(number, on=True)


async def make_fit(robot: Cell) -> None:
    """Act as a person: home the robot, give it its geometry and speeds, and bring it back, all by hand."""
    robot.rig.machine.faults.clear()
    await asyncio.sleep(10)
    await robot.teach()
    await robot.put(*START)
    for switch in BAD_WIRE:
        robot.rig.machine.faults.set(switch)


async def story(seed: int) -> Counter[str]:
    dice, done = Random(seed), Counter[str]()
    async with cell(baud=115_200, seed=seed) as robot:
        for switch in BAD_WIRE:
            robot.rig.machine.faults.set(switch)
        for _ in range(MOVES):
            failing = asyncio.create_task(fail(robot, dice)) if dice.random() < FAILING else None
            try:
                x, y = mm(dice.randrange(-80, 80)), mm(dice.randrange(120, 320))
                move = await robot.start("line", x=x, y=y, pattern=5)
                over = await robot.moves.log.wait(move.id, 600.0)
            except GatewayError as error:
                done[f"moved: {error.moved}"] += 1
                over = None
            if over is not None:
                done[over.status] += 1
                judge(robot, over)
            if failing is not None:
                await failing
            if over is None or over.status is not MoveStatus.SUCCEEDED or failing is not None:
                await make_fit(robot)
        starts = robot.frames_of("HMM").count("&8AHMM")
        for number in robot.numbers:
            assert len(robot.rig.executed("HMM", number)) <= starts
    return done


def judge(robot: Cell, over: ScaraMove) -> None:
    """The truth decides."""
    if over.status in ENDED:
        assert not any(robot.moving()), over
    if over.status is MoveStatus.SUCCEEDED:
        for axis, really in zip(over.axes, robot.positions(), strict=True):
            assert abs(really - axis.target_position) <= robot.scara.tolerance_pulses, over
    else:
        assert over.status is MoveStatus.STOPPED or over.failed_axes, over


@pytest.mark.parametrize("seed", drawn(SEEDS, 1, "faulty_scara"))
def test_what_is_done_was_done(seed: int) -> None:
    done: Counter[str] = Counter()

    async def run() -> None:
        done.update(await story(seed))

    run_virtual(run())
    assert done[MoveStatus.SUCCEEDED] > 2
    assert done.keys().isdisjoint({"moved: yes", "moved: unknown"})
