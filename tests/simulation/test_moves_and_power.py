"""Moves on a bad day: power fails for moments, a port flaps, a line is crowded. The truth is the judge.

No move to a position is called `succeeded` at another place than was asked, and none is called `lost` whose
body kept its power. Moves that are failed or unknown are honest, and must not be the rule.
"""

import asyncio
from collections import Counter
from collections.abc import Callable, Coroutine
from contextlib import suppress
from dataclasses import dataclass, field
from random import Random
from typing import Any

import pytest

from gateway.core.errors import GatewayError, PowerCycled
from gateway.core.move_record import Move, MoveStatus
from gateway.rorze.bodies import Body
from protocols.rorze.moves import AbsoluteMove, MoveClockwise, MoveCounterclockwise, MoveTo, RelativeMove
from protocols.rorze.notation import PositionReference
from protocols.rorze.origin import HomeFastThenStop
from protocols.rorze.position_table import GetPositionEntry
from protocols.rorze.row import RorzeCommand
from protocols.table import Ack
from simulator.faults import Direction, Fault, Switch
from simulator.rorze.controller import Rc420
from simulator.rorze.world import Span
from tests.drawing import drawn
from tests.plants import Rig, rig
from tests.virtual_time import run_virtual

SEEDS = range(6)
BODIES = range(6)
MOVES_PER_BODY = 20
FARTHEST = 9_000
NEAR_HOME = Span(-2_000, -1_800)
LONGEST_DAY_S = 4_000.0
UNNOTICED_S = 60.0
"""A loss of power before a move may show in it, if nothing has shown it before."""
ORIGIN_OFFSET = -10
CUT_S = (0.01, 0.1)
BAD_LINE = (
    Switch(Fault.LATE, Direction.REPLIES, 0.01, delay_s=0.05, spread_s=1.0),
    Switch(Fault.LOST, Direction.REQUESTS, 0.005),
    Switch(Fault.LOST, Direction.REPLIES, 0.005),
)


@dataclass
class Axis:
    """One body with what really becomes of it."""

    body: Body
    truth: Rc420
    zero: int = 0
    """Place of position 0, as believed before a loss of power is known."""
    cuts: list[float] = field(default_factory=list)

    def place(self) -> int:
        return self.truth.motor.pulses(now())


@dataclass
class Day:
    """Everything that happened in a run."""

    ended: Counter[MoveStatus] = field(default_factory=Counter)
    refused: Counter[str] = field(default_factory=Counter)
    wrong: list[str] = field(default_factory=list)
    cuts: int = 0


def now() -> float:
    return asyncio.get_running_loop().time()


class Simulation:
    """One line on a bad day."""

    def __init__(self, running: Rig, seed: int) -> None:
        self._rig = running
        self._dice = Random(seed)
        self.day = Day()
        self._axes = [Axis(running.body(f"{number:02X}"), running.axis(number)) for number in BODIES]
        for axis in self._axes:
            axis.truth.world.origin = NEAR_HOME
            axis.truth.keeps_position = self._dice.random() < 0.3

    async def run(self, *mischief: Coroutine[Any, Any, None]) -> Day:
        """Let everybody work while all that goes wrong."""
        tasks = [asyncio.create_task(work) for work in mischief]
        try:
            async with asyncio.timeout(LONGEST_DAY_S):
                await asyncio.gather(*map(self._work, self._axes))
        finally:
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)
        return self.day

    # the work

    async def _work(self, axis: Axis) -> None:
        for _ in range(MOVES_PER_BODY):
            await asyncio.sleep(self._dice.choice((0.0, 0.05, 0.5, 3.0)))
            command = self._any_command(axis)
            place, began_at = axis.place(), now()
            try:
                [move] = await self._rig.plant.moves.start(axis.body, command)
            except PowerCycled:
                await self._find_out(axis)
                continue
            except GatewayError as refusal:
                self.day.refused[refusal.kind] += 1
                await asyncio.sleep(0.5)
                continue
            while not (move := await self._rig.plant.moves.wait(move.id, 60.0)).status.final:
                pass
            self.day.ended[move.status] += 1
            self._judge(axis, command, move, place, began_at)

    def _any_command(self, axis: Axis) -> RorzeCommand[Ack]:
        dice = self._dice
        kind = dice.random()
        if kind < 0.7:
            return MoveTo(position=dice.randint(-1_000, FARTHEST))
        if kind < 0.85:
            row = MoveCounterclockwise if axis.place() > FARTHEST // 2 else MoveClockwise
            return row(distance=dice.randint(1, 2_000))
        return HomeFastThenStop()

    async def _find_out(self, axis: Axis) -> None:
        """Act as a person: look where the axis stands, and set it right."""
        self.day.refused["power-cycled"] += 1
        while axis.body.power.cycled:
            await asyncio.sleep(1.0)
            if axis.body.power.mark is None and axis.body.power.comment:
                continue
            axis.zero = axis.truth._zero
            with suppress(GatewayError):
                await axis.body.acknowledge_power_cycle()

    # the verdict

    def _judge(self, axis: Axis, command: RorzeCommand[Ack], move: Move, start: int, began_at: float) -> None:
        kept_its_power = not any(at > began_at - UNNOTICED_S for at in axis.cuts)
        wrong = move.status is MoveStatus.LOST and kept_its_power
        if move.status is MoveStatus.SUCCEEDED:
            if isinstance(command, HomeFastThenStop):
                axis.zero = axis.place()
                wrong = not NEAR_HOME.covers(axis.place() + ORIGIN_OFFSET)
            elif isinstance(command, AbsoluteMove):
                wrong = axis.place() != axis.zero + int(str(command.position))
            elif isinstance(command, RelativeMove):
                wrong = abs(axis.place() - start) != command.distance
        elif isinstance(command, HomeFastThenStop):
            axis.zero = axis.truth._zero  # somebody looks
        if wrong:
            self.day.wrong.append(f"{move} ended at {axis.place()}, where 0 is {axis.zero}")

    # what goes wrong

    async def cut_power(self) -> None:
        """Cut the power of one axis for a moment, again and again."""
        while True:
            await asyncio.sleep(self._dice.expovariate(1 / 1.5))
            self._cut(self._dice.choice(self._axes))

    async def cut_power_at_moves(self) -> None:
        """Cut the power of a body when it is asked for its mark, or sent to a place, before it hears that."""
        write = self._rig.wire.write

        def cut_and_write(data: bytes) -> None:
            if data[3:6] in (b"9VD", b"1AM") and self._dice.random() < 0.1:
                self._cut(self._axes[int(data[1:3], 16)], 0.0)
            write(data)

        self._rig.wire.write = cut_and_write  # type: ignore[method-assign]

    def _cut(self, axis: Axis, for_s: float | None = None) -> None:
        cut_s = self._dice.uniform(*CUT_S) if for_s is None else for_s
        self._rig.machine.brown_out(axis.body.number, cut_s, now())
        self._rig.wire.turn()
        axis.cuts.append(now())
        self.day.cuts += 1

    async def flap(self) -> None:
        """Pull the cable and plug it in again."""
        while True:
            await asyncio.sleep(self._dice.expovariate(1 / 10.0))
            self._rig.wire.unplug()
            await asyncio.sleep(self._dice.uniform(0.05, 2.0))
            self._rig.wire.plugged_in = True

    async def crowd(self, reader: int) -> None:
        """Read from everybody without a pause."""
        question = GetPositionEntry(entry=PositionReference(position=reader))
        while True:
            for axis in self._axes:
                try:
                    await axis.body.ask(question)
                except GatewayError:
                    await asyncio.sleep(0.1)

    async def spoil_the_line(self) -> None:
        """Lose and delay some frames."""
        for switch in BAD_LINE:
            self._rig.machine.faults.set(switch)


Mischief = Callable[[Simulation], list[Coroutine[Any, Any, None]]]


def day(seed: int, mischief: Mischief, baud: int = 115_200, body_options: str = "") -> Day:
    """A whole day on a line."""

    async def story() -> Day:
        async with rig(bodies=BODIES, groups={}, baud=baud, seed=seed, body_options=body_options) as running:
            simulation = Simulation(running, seed)
            return await simulation.run(*mischief(simulation))

    return run_virtual(story())


@pytest.mark.parametrize("seed", drawn(SEEDS, 1, "moves_and_power"))
def test_a_move_goes_where_it_was_asked_or_nobody_calls_it_a_success(seed: int) -> None:
    found = day(seed, lambda world: [world.cut_power(), world.cut_power_at_moves(), world.spoil_the_line()])
    assert found.wrong == []
    assert found.cuts > 40
    assert found.refused["power-cycled"] > 5
    assert found.ended[MoveStatus.SUCCEEDED] > 20


@pytest.mark.parametrize("seed", drawn(SEEDS, 1, "moves_and_power"))
def test_a_move_whose_body_has_kept_its_power_is_not_lost_through_cuts_and_crowds(seed: int) -> None:
    found = day(
        seed, lambda world: [world.flap(), world.spoil_the_line(), *map(world.crowd, range(20))], baud=9600
    )
    assert found.wrong == []
    assert found.ended[MoveStatus.LOST] == 0
    assert found.ended[MoveStatus.SUCCEEDED] > 40


def test_without_a_mark_some_moves_end_elsewhere_and_are_called_a_success() -> None:
    found = [
        day(seed, lambda world: [world.cut_power_at_moves()], body_options="power_comment = 0")
        for seed in SEEDS
    ]
    assert [wrong for one in found for wrong in one.wrong]
