"""The line of a robot is cut for a while, with its power or without: the record says which of both it was.

A terminal server that restarts, a cable that was pulled and a bus that stalls take no power from a robot:
what moves, moves on. A loss of power as long looks the same while it lasts. The simulator's truth judges.
"""

import asyncio
from abc import ABC, abstractmethod
from collections.abc import AsyncIterator, Awaitable, Callable, Coroutine
from contextlib import asynccontextmanager, suppress
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from random import Random
from typing import Any, NamedTuple

import pytest

from gateway.config import parse
from gateway.core.errors import GatewayError, PowerCycled
from gateway.core.events import Event
from gateway.core.move_record import MoveStatus
from gateway.fics.move_record import RobotMove
from gateway.fics.robot import Robot
from protocols.fics.homing import HomeRobot
from protocols.fics.macros import RunMacro
from protocols.fics.moves import MoveRelative
from protocols.fics.row import FicsCommand
from protocols.fics.speeds import SetSpeedPercent
from simulator.fics.layout import Layout
from simulator.fics.line import SimulatedFics, build_line
from tests import dpram_board
from tests.dpram_board import HOST_MODE, Board
from tests.fics_plants import SCARA, SET_UP_S, Cable
from tests.tested_plant import TestedPlant
from tests.virtual_time import run_virtual
from transports import Transport, create, dpram

CUTS_S = (0.05, 0.3, 1.0, 3.0)
"""Within a question and its answer, shorter than a deadline, longer than one, longer than three fences."""
BAUD = 9600
UNDER_WAY_S = 0.4
"""Seconds from the start of a motion to the cut: it is seen to run."""
SEEN_WITHIN_S = 25.0
"""Within this an idle robot has been set up and looked at, if its line works."""
LONGEST_S = 300.0
SLOW = SetSpeedPercent(percents=[2.0, 2.0, 2.0])
FASTER = SetSpeedPercent(percents=[40.0, 40.0, 40.0])
DOWN = MoveRelative(coordinates=[None, None, -20.0])


def now() -> float:
    return asyncio.get_running_loop().time()


class Wiring(ABC):
    """How the gateway reaches the robot, and how that is cut."""

    machine: SimulatedFics
    address: str
    """Address of the line, as in the configuration."""
    open_transport: Callable[[str], Transport] = staticmethod(create)
    """Gives the gateway's end."""

    async def run(self) -> None:  # noqa: B027  # a wire needs nothing
        """Serve the robot's end until cancelled."""

    @abstractmethod
    def cut(self) -> None:
        """Let nothing pass."""

    @abstractmethod
    def mend(self) -> None:
        """Let all pass again."""

    def brown_out(self, for_s: float) -> None:
        """Take the robot's power away for a while."""
        self.machine.brown_out(now(), for_s)


class Wire(Wiring):
    """A cable of bytes."""

    address = "tcp://127.0.0.1:1"

    def __init__(self, machine: SimulatedFics, _folder: Path) -> None:
        self.machine, self.cable = machine, Cable(machine, BAUD)
        self.open_transport = lambda _: self.cable

    def brown_out(self, for_s: float) -> None:
        super().brown_out(for_s)
        self.cable.turn()


class Tcp(Wire):
    """A connection that breaks: the gateway's end notices at once."""

    def cut(self) -> None:
        self.cable.unplug()

    def mend(self) -> None:
        self.cable.plugged_in = True


class Untouched(Wire):
    """A cable that carries all: the power alone is cut."""

    def cut(self) -> None:
        pass

    def mend(self) -> None:
        pass


class Serial(Wire):
    """A cable that is pulled at the robot: the gateway's port notices nothing."""

    def cut(self) -> None:
        self.cable.broken = True

    def mend(self) -> None:
        self.cable.broken = False


class Dpram(Wiring):
    """A board whose bus stalls."""

    def __init__(self, machine: SimulatedFics, folder: Path) -> None:
        self.machine, self.board = machine, Board(folder / "ram", machine)
        self.address = f"dpram://{self.board.path}"

    async def run(self) -> None:
        await self.board.run()

    def cut(self) -> None:
        self.board.stalled = True

    def mend(self) -> None:
        self.board.stalled = False

    def brown_out(self, for_s: float) -> None:
        super().brown_out(for_s)
        self.board.ram[HOST_MODE] = 1


Wired = type[Wire] | type[Dpram]


@dataclass
class Cell:
    """A running plant with one robot."""

    plant: TestedPlant
    wiring: Wiring
    moves: list[RobotMove] = field(default_factory=list)
    changes: list[Any] = field(default_factory=list)
    """Settings that the gateway has confirmed."""
    clients: list["asyncio.Task[None]"] = field(default_factory=list)

    @property
    def robot(self) -> Robot:
        return self.plant.robots()[0]

    @property
    def machine(self) -> SimulatedFics:
        return self.wiring.machine

    def percents(self) -> list[float]:
        """The speeds as they really are."""
        return [axis.percent for axis in self.machine.robot.units[1].users]

    def begin(self, work: Coroutine[Any, Any, None]) -> None:
        """Let a client do something meanwhile."""
        self.clients.append(asyncio.create_task(work))

    async def start(self, command: FicsCommand[Any]) -> RobotMove:
        return await self.plant.robot_moves.start(self.robot, self.robot.unit(1), command)

    async def move(self, command: FicsCommand[Any]) -> RobotMove:
        return await self.plant.robot_moves.wait((await self.start(command)).id, LONGEST_S)

    def events(self, prefix: str) -> list[Event]:
        hub = self.plant.events
        found = [hub.event(number) for number in range(hub.first, hub.last + 1)]
        return [event for event in found if event.type.startswith(prefix)]

    async def cut(self, for_s: float, *, power: bool) -> None:
        """Cut the line, and with it the power or not, and mend all."""
        self.wiring.cut()
        if not power:
            self.wiring.brown_out(for_s)
        await asyncio.sleep(for_s)
        self.wiring.mend()


@asynccontextmanager
async def cell(wiring: Wired, mode: int, folder: Path) -> AsyncIterator[Cell]:
    wired = wiring(build_line(Layout()), folder)
    config = parse(
        f'[[lines]]\nid = "cell"\naddress = "{wired.address}"\nprotocol = "fics"\nmode = {mode}\n'
        f'robot = {{id = "r1", units = [{SCARA}]}}\n',
        "test.toml",
    )
    plant = TestedPlant(config, rng=Random(0), open_transport=wired.open_transport)
    far_end = asyncio.create_task(wired.run())
    await plant.start()
    running = Cell(plant, wired)
    try:
        await asyncio.sleep(SET_UP_S)
        yield running
    finally:
        await asyncio.gather(*running.clients)
        await plant.close()
        far_end.cancel()
        await asyncio.gather(far_end, return_exceptions=True)


# the moments

Begin = Callable[[Cell], Awaitable[None]]


async def _rest(cell: Cell) -> None:
    """Nothing goes on."""


async def _move(command: FicsCommand[Any], cell: Cell) -> None:
    cell.moves.append(await cell.start(command))
    await asyncio.sleep(UNDER_WAY_S)


async def _jog(cell: Cell) -> None:
    jog = await cell.robot.jogs.start(1, "Z", "-")

    async def keep() -> None:
        with suppress(GatewayError):
            while True:
                cell.robot.jogs.heartbeat(jog.id)
                await asyncio.sleep(0.2)

    cell.begin(keep())
    await asyncio.sleep(UNDER_WAY_S)


async def _set(cell: Cell, after_s: float) -> None:
    async def change() -> None:
        with suppress(GatewayError):
            cell.changes.append((await cell.robot.change(FASTER, 1)).percents[:3])

    cell.begin(change())
    await asyncio.sleep(after_s)


MOMENTS: dict[str, Begin] = {
    "at rest": _rest,
    "in a move": partial(_move, DOWN),
    "in a home": partial(_move, HomeRobot()),
    "in a jog": _jog,
    "in a macro": partial(_move, RunMacro(macro="PCK", arguments=[100.0, 100.0, -20.0])),
    "before a setting": partial(_set, after_s=0.005),
    "in a setting": partial(_set, after_s=0.05),
    "in its read-back": partial(_set, after_s=0.09),
}
ENDLESS = ("in a jog",)


class Case(NamedTuple):
    """One cut."""

    wiring: Wired
    mode: int
    moment: str
    for_s: float
    power: bool
    """True if the power stays on."""
    homed: bool = True


async def story(case: Case, folder: Path) -> None:
    """Cut a line at a moment, and judge what is told of it."""
    async with cell(case.wiring, case.mode, folder) as stand:
        if case.homed:
            assert (await stand.move(HomeRobot())).status is MoveStatus.SUCCEEDED
            await stand.robot.change(SLOW, 1)
        await MOMENTS[case.moment](stand)
        ended = len(stand.machine.truth.of("motion_stop"))
        runs = stand.machine.robot.job is not None
        await stand.cut(case.for_s, power=case.power)
        for move in stand.moves:
            await stand.plant.robot_moves.wait(move.id, LONGEST_S)
        await asyncio.sleep(SEEN_WITHIN_S)
        ends = [fact.facts["why"] for fact in stand.machine.truth.of("motion_stop")[ended:]]
        if stand.moves or case.moment in ENDLESS:
            assert runs
            assert stand.machine.robot.job is None, "nothing runs on unseen"
            assert (ends == ["power"]) is not case.power
        (_judge_kept if case.power else _judge_lost)(stand)


def _judge_kept(stand: Cell) -> None:
    """No power loss was told, what ran on was followed to its end, and a confirmed setting holds."""
    assert not stand.robot.power_cycled
    assert stand.events("robot.power_cycled") == []
    assert [move.status for move in stand.moves] == [MoveStatus.SUCCEEDED] * len(stand.moves)
    assert stand.changes in ([], [stand.percents()])


def _judge_lost(stand: Cell) -> None:
    """The loss was told, no move has ended well, and standstill is told only where it was seen."""
    assert stand.robot.power_cycled
    assert len(stand.events("robot.power_cycled")) == 1
    for move in stand.moves:
        assert (move.status, move.end_cause) == (MoveStatus.LOST, "power_cycled")
        assert move.error is not None
        assert "were seen to stand still since" in move.error.detail
        alarm = next(one for one in stand.plant.alarms.standing() if one.cause == "robot.move.lost")
        assert "Unless it was seen to stand since" in alarm.en.motor, "one sentence contradicts no other"
    assert stand.changes in ([], [list(FASTER.percents)])


@pytest.fixture(autouse=True)
def _polls_take_little_time(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(dpram, "SPIN_S", 0.0)
    monkeypatch.setattr(dpram, "LONGEST_PAUSE_S", 0.02)
    monkeypatch.setattr(dpram_board, "TURN_S", 0.02)


@pytest.mark.parametrize("moment", MOMENTS)
@pytest.mark.parametrize("mode", [2, 3])
@pytest.mark.parametrize("wiring", [Tcp, Serial, Dpram], ids=lambda wiring: wiring.__name__.lower())
def test_a_cut_line_is_no_loss_of_power_and_a_loss_of_power_no_cut_line(
    wiring: Wired, mode: int, moment: str, tmp_path: Path
) -> None:
    for for_s in CUTS_S:
        for power in (True, False):
            play(Case(wiring, mode, moment, for_s, power), tmp_path)


@pytest.mark.parametrize("moment", MOMENTS)
@pytest.mark.parametrize("mode", [2, 3])
def test_a_loss_of_power_on_a_line_that_works_is_told(mode: int, moment: str, tmp_path: Path) -> None:
    for for_s in (0.02, *CUTS_S):
        play(Case(Untouched, mode, moment, for_s, power=False), tmp_path)


@pytest.mark.parametrize("wiring", [Tcp, Serial])
@pytest.mark.parametrize("moment", ["at rest", "in a move", "in a jog"])
def test_a_cut_line_locks_no_robot_in_ver_2_that_has_nothing_to_lose(
    wiring: Wired, moment: str, tmp_path: Path
) -> None:
    """Nothing is homed, and all speeds are those of power-on."""

    async def locked(for_s: float) -> tuple[bool, list[MoveStatus]]:
        async with cell(wiring, 2, tmp_path) as stand:
            await asyncio.sleep(SEEN_WITHIN_S)
            await MOMENTS[moment](stand)
            await stand.cut(for_s, power=True)
            await asyncio.sleep(SEEN_WITHIN_S)
            return stand.robot.power_cycled, [move.status for move in stand.moves]

    for for_s in CUTS_S:
        was_locked, ends = run_virtual(locked(for_s))
        assert not was_locked
        assert all(status in (MoveStatus.SUCCEEDED, MoveStatus.UNKNOWN) for status in ends)


@pytest.mark.parametrize("wiring", [Tcp, Serial])
def test_in_ver_2_speeds_of_a_robot_that_is_not_homed_tell_of_a_loss_of_power(
    wiring: Wired, tmp_path: Path
) -> None:
    """The gateway has only read them: they were set elsewhere."""

    async def locked(for_s: float, *, power: bool) -> bool:
        async with cell(wiring, 2, tmp_path) as stand:
            stand.machine.robot.units[1].users[0].percent = 10.0
            await asyncio.sleep(SEEN_WITHIN_S)
            await stand.cut(for_s, power=power)
            await asyncio.sleep(SEEN_WITHIN_S)
            with suppress(PowerCycled):
                await stand.move(DOWN)
            return stand.robot.power_cycled

    for for_s in CUTS_S[1:]:
        assert run_virtual(locked(for_s, power=False))
        assert not run_virtual(locked(for_s, power=True))


def play(case: Case, folder: Path) -> None:
    """Run the story of a case, and name the case where it fails."""
    try:
        run_virtual(story(case, folder))
    except AssertionError as wrong:
        raise AssertionError(f"{case}: {wrong}") from wrong
