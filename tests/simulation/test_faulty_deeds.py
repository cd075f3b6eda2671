"""The real gateway and a robot that loses its power on a bad wire: what it calls done was done.

Moves without a target, settings, outputs, variables and tables of positions, homed or not. The simulator's
truth is the judge; a seed that fails is named in the test's id.
"""

import asyncio
from collections import Counter
from random import Random

import pytest

from gateway.core.errors import GatewayError
from gateway.core.line_state import LineState
from gateway.core.move_record import MoveStatus
from gateway.fics.move_record import RobotMove
from protocols.fics.homing import HomeRobot
from protocols.fics.inputs_outputs import SwitchOutput
from protocols.fics.jog import StepAxis
from protocols.fics.macros import RunMacro
from protocols.fics.motor_axes import MoveMotorsRelative
from protocols.fics.moves import MoveRelative, MoveToPosition
from protocols.fics.positions import ClearPositions
from protocols.fics.row import FicsCommand
from protocols.fics.soft_limits import SetUpperSoftLimits
from protocols.fics.speeds import SetAccelerationTimes, SetSpeedPercent
from protocols.fics.variables import SetVariable
from protocols.table import Ack
from simulator.faults import Direction, Fault, Switch
from simulator.fics.line import SimulatedFics
from tests.drawing import drawn
from tests.fics_plants import FicsRig, fics_rig
from tests.simulation.test_faulty_line import InOrder
from tests.virtual_time import run_virtual

SEEDS = range(8)
DEEDS = 60
UNIT = 1
BAD_WIRE = (
    Switch(Fault.LATE, Direction.REPLIES, 0.02, delay_s=0.05, spread_s=1.0),
    Switch(Fault.LOST, Direction.REQUESTS, 0.05),
    Switch(Fault.LOST, Direction.REPLIES, 0.01),
    Switch(Fault.DOUBLED, Direction.REPLIES, 0.03, delay_s=0.01, spread_s=0.5),
)
OUTAGES = 0.3
"""The share of moves in which the power goes, for a moment or for longer."""

Bare = FicsCommand[Ack]


class Deeds:
    """One client that does this and that, and compares what it is told with the truth."""

    def __init__(self, seed: int, mode: int) -> None:
        self.mode = mode
        self.lies: list[str] = []
        self.done: Counter[str] = Counter()
        self._seed = seed
        self._dice = Random(seed)
        self._rig: FicsRig

    async def run(self) -> None:
        faults = InOrder(Random(self._seed + 1))

        def prepare(machine: SimulatedFics) -> None:
            machine.faults = machine._wire._faults = faults

        async with fics_rig(mode=self.mode, baud=38_400, prepare=prepare) as rig:
            self._rig = rig
            for switch in BAD_WIRE:
                faults.set(switch)
            for _ in range(DEEDS):
                deed = self._dice.choice((self._move, self._move, self._set, self._store, self._clear))
                try:
                    await deed()
                except GatewayError:
                    await self._make_fit()
                await asyncio.sleep(self._dice.uniform(0.0, 0.5))
            faults.clear()
            await asyncio.sleep(60)
            assert rig.robot.line.state is LineState.READY

    async def _make_fit(self) -> None:
        """Act as a person: wait a little, acknowledge, reset."""
        await asyncio.sleep(self._dice.uniform(0.1, 2.0))
        self._rig.robot.known.power.acknowledge()
        if self._rig.robot.latched_error is not None:
            try:
                await self._rig.robot.conversation.reset_errors()
            except GatewayError:
                return

    # moves

    async def _move(self) -> None:
        dice, rig = self._dice, self._rig
        command = self._motion()
        begun = len(rig.machine.truth.of("motion_start"))
        started = await rig.start(command, UNIT)
        if dice.random() < OUTAGES:
            await asyncio.sleep(dice.uniform(0.0, 1.0))
            await self._lose_power()
        move = await rig.plant.robot_moves.wait(started.id, 600.0)
        if move.status is MoveStatus.SUCCEEDED:
            self._judge(move, begun)
        elif move.status is not MoveStatus.FAILED:
            await self._make_fit()

    def _motion(self) -> Bare:
        dice = self._dice
        amount = round(dice.uniform(20.0, 60.0), 2) * dice.choice((-1, 1))
        commands: tuple[Bare, ...] = (
            MoveRelative(coordinates=[None, None, amount]),
            MoveRelative(coordinates=[None, None, amount]),
            MoveMotorsRelative(coordinates=[round(amount / 10, 2)]),
            StepAxis(axis="Z", steps=dice.choice((-255, 200))),
            HomeRobot(),
            RunMacro(macro="PCK", arguments=[150.0, 140.0, -5.0]),
            MoveToPosition(position=dice.randrange(1, 5)),
        )
        return dice.choice(commands)

    async def _lose_power(self) -> None:
        machine, loop = self._rig.machine, asyncio.get_running_loop()
        machine.power_off(loop.time())
        await asyncio.sleep(self._dice.choice((0.0, 0.0, 0.2, 3.0)))
        machine.power_on(loop.time())
        self._rig.cable.turn()

    def _judge(self, move: RobotMove, begun: int) -> None:
        """One that succeeded has run to its end, or stands where it should."""
        self.done[move.kind] += 1
        truth = self._rig.machine.truth
        starts = truth.of("motion_start")[begun:]
        ends = [fact.facts["why"] for fact in truth.of("motion_stop")[begun:]]
        if [fact.facts["name"] for fact in starts] == [move.command] and ends == ["done"]:
            return
        stands = dict(zip("XYZ", self._rig.fics.units[UNIT].user_places(truth.since(0)[-1].at), strict=True))
        target = {axis: place for axis, place in (move.target_position or {}).items() if place is not None}
        arrived = target and all(abs(stands[axis] - place) < 0.03 for axis, place in target.items())
        if not arrived or starts:
            self.lies.append(f"{move.frame} succeeded by {move.evidence}, in truth {starts}, {ends}")

    # settings

    async def _set(self) -> None:
        dice, rig = self._dice, self._rig
        value = round(dice.uniform(10.0, 90.0), 1)
        command: Bare = dice.choice(
            (
                SetVariable(number=dice.randrange(100), value=value),
                SwitchOutput(channel=1, bit=dice.randrange(8), on=dice.random() < 0.5),
                SetSpeedPercent(percents=[None, None, value]),
                SetAccelerationTimes(times_ms=[None, None, int(value) * 10]),
                SetUpperSoftLimits(coordinates=[None, None, 100.0 + value]),
            )
        )
        await rig.robot.ask(command, None if isinstance(command, SetVariable | SwitchOutput) else UNIT)
        self.done[command.code] += 1
        axis = rig.fics.units[UNIT].users[2]
        match command:
            case SetVariable():
                true = rig.fics.variables[command.number] == value
            case SwitchOutput():
                true = bool(rig.fics.outputs[0] >> command.bit & 1) is command.on
            case SetSpeedPercent():
                true = axis.percent == value
            case SetAccelerationTimes():
                true = axis.acceleration_ms == int(value) * 10
            case _:
                true = axis.plus_limit == 100.0 + value
        if not true:
            self.lies.append(f"{command.text} is not done")

    async def _store(self) -> None:
        first = self._dice.randrange(1, 4)
        places = [
            (number, [150.0 + self._dice.randrange(10), 150.0])
            for number in range(first, first + self._dice.randrange(1, 6))
        ]
        await self._rig.robot.upload_positions(places)
        self.done["positions"] += 1
        held = self._rig.fics.units[UNIT].positions
        if any(held.get(number) != tuple(place) for number, place in places):
            self.lies.append(f"{places} are {held}")

    async def _clear(self) -> None:
        first, count = self._dice.randrange(1, 4), self._dice.randrange(1, 4)
        await self._rig.robot.ask(ClearPositions(first=first, count=count), UNIT)
        self.done["cleared"] += 1
        if set(range(first, first + count)) & set(self._rig.fics.units[UNIT].positions):
            self.lies.append(f"{first},{count} are not cleared")


@pytest.mark.parametrize("seed", drawn(SEEDS, 2, "faulty_deeds"))
@pytest.mark.parametrize("mode", [2, 3])
def test_what_a_robot_is_said_to_have_done_it_has_done(mode: int, seed: int) -> None:
    deeds = Deeds(seed, mode)
    run_virtual(deeds.run())
    assert deeds.lies == []
    assert sum(deeds.done.values()) > DEEDS / 4, deeds.done
