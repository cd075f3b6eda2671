"""Invariants of the whole gateway while its robot's dual-port RAM misbehaves."""

import asyncio
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass
from pathlib import Path
from random import Random

import pytest

from gateway.config import parse
from gateway.core.errors import NoReply, NotSent
from gateway.core.line_state import LineState
from gateway.core.move_record import MoveStatus
from gateway.fics.errors import RobotBusy
from gateway.fics.move_record import RobotMove
from gateway.fics.robot import Robot
from protocols.fics.homing import HomeRobot
from protocols.fics.moves import MoveRelative
from protocols.fics.variables import GetVariable, VariableValue
from simulator.fics.layout import Layout
from simulator.fics.line import build_line
from tests.dpram_board import FICS_FLAG, FROM_HOST, HOST_FLAG, HOST_MODE, TO_HOST, WIRINGS, Board, Wiring
from tests.fics_plants import SCARA
from tests.tested_plant import TestedPlant
from tests.virtual_time import run_virtual
from transports import dpram

DOWN = MoveRelative(coordinates=[None, None, -5.0])
REOPENED_S = 10.0
"""Within this a line that was lost is ready again."""


@pytest.fixture(autouse=True)
def _spinning_takes_no_virtual_time(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(dpram, "SPIN_S", 0.0)


@dataclass
class Cell:
    """A running plant with one robot on a board."""

    plant: TestedPlant
    board: Board

    def is_ready(self) -> bool:
        return self.robot.line.state is LineState.READY

    @property
    def robot(self) -> Robot:
        return self.plant.robots()[0]

    def heard(self, name: str) -> list[str]:
        texts = [str(fact.facts["text"]) for fact in self.board.machine.truth.of("command")]
        return [text for text in texts if text.startswith(name)]

    def types(self, prefix: str) -> list[str]:
        hub = self.plant.events
        found = [hub.event(number) for number in range(hub.first, hub.last + 1)]
        return [it.type for it in found if it.type.startswith(prefix)]

    async def start(self, command: HomeRobot | MoveRelative) -> RobotMove:
        return await self.plant.robot_moves.start(self.robot, self.robot.unit(1), command)

    async def move(self, command: HomeRobot | MoveRelative) -> MoveStatus:
        started = await self.start(command)
        return (await self.plant.robot_moves.wait(started.id, 60.0)).status


@asynccontextmanager
async def cell(
    tmp_path: Path,
    prepare: Callable[[Board], object] = lambda _: None,
    options: str = "",
    wiring: Wiring = WIRINGS[0],
) -> AsyncIterator[Cell]:
    """Start a plant over a real file; `prepare` may touch the RAM before, `options` end the address."""
    board = Board(tmp_path / "ram", build_line(Layout()), wiring)
    prepare(board)
    config = parse(
        f'[[lines]]\nid = "cell"\naddress = "dpram://{board.path}{options}"\nprotocol = "fics"\n'
        f'robot = {{id = "r1", units = [{SCARA}]}}\n',
        "test.toml",
    )
    plant = TestedPlant(config, rng=Random(0))
    fics = asyncio.create_task(board.run())
    await plant.start()
    try:
        await asyncio.sleep(1)
        yield Cell(plant, board)
    finally:
        await plant.close()
        fics.cancel()
        await asyncio.gather(fics, return_exceptions=True)


@pytest.mark.parametrize("wiring", WIRINGS, ids=lambda wiring: wiring.options)
def test_a_robot_is_served_however_its_board_is_wired(tmp_path: Path, wiring: Wiring) -> None:
    async def story() -> None:
        async with cell(tmp_path, options=wiring.options, wiring=wiring) as it:
            assert await it.move(HomeRobot()) is MoveStatus.SUCCEEDED
            assert it.robot.line.counters["garbage"] == 0

    run_virtual(story())


def test_a_board_whose_messages_have_no_cr_is_served(tmp_path: Path) -> None:
    async def story() -> None:
        async with cell(tmp_path, lambda board: setattr(board, "bare", True)) as it:
            assert it.is_ready()
            assert await it.move(HomeRobot()) is MoveStatus.SUCCEEDED
            assert it.robot.line.counters["garbage"] == 0

    run_virtual(story())


def test_a_board_that_was_switched_off_and_on_is_put_into_host_mode_again(tmp_path: Path) -> None:
    async def story() -> None:
        async with cell(tmp_path) as it:
            it.board.cycle_power()
            assert it.board.ram[HOST_MODE] == 1
            await asyncio.sleep(REOPENED_S)
            assert it.board.ram[HOST_MODE] == 0
            with pytest.raises(NotSent):
                await it.move(HomeRobot())
            assert "robot.power_cycled" in it.types("robot")
            assert "line.down" not in it.types("line")
            assert it.is_ready()

    run_virtual(story())


def test_h13_an_answer_left_from_an_earlier_life_is_thrown_away(tmp_path: Path) -> None:
    def leave(board: Board) -> None:
        board.ram[TO_HOST.start : TO_HOST.start + 6] = b"MOD 3\r"  # a lie: after power-on it is 2
        board.ram[FICS_FLAG] = 1

    async def story() -> None:
        async with cell(tmp_path, leave) as it:
            assert it.is_ready()
            assert it.board.machine.robot.mode == 3
            assert it.heard("MOD 3") == ["MOD 3"]
            assert await it.move(HomeRobot()) is MoveStatus.SUCCEEDED

    run_virtual(story())


def test_h14_a_flag_that_stays_at_1_takes_the_line_down_and_a_stop_is_not_called_sent(tmp_path: Path) -> None:
    async def story() -> None:
        async with cell(tmp_path) as it:
            it.board.stalled = True
            question = asyncio.create_task(it.robot.unit(1).position())  # fills the RAM
            await asyncio.sleep(0.1)
            assert it.board.ram[HOST_FLAG] == 1
            report = await it.robot.stop("immediate")
            assert report.state == "not_sent"
            assert not it.is_ready()
            assert "line.down" in it.types("line")
            assert not it.board.ram[FROM_HOST].startswith((b"AES", b"APS"))
            await asyncio.wait({question})
            assert question.exception() is not None
            with pytest.raises((NotSent, RobotBusy)):
                await it.move(HomeRobot())
            it.board.stalled = False
            await asyncio.sleep(REOPENED_S)
            assert it.is_ready()
            assert it.types("robot.stop")[-1] == "robot.stop.confirmed"
            assert it.heard("AES") != []

    run_virtual(story())


def stall_at(name: bytes, board: Board, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let Fics stand still just before the next message of this name comes into the RAM."""
    names, store = [name], dpram._Memory.store

    def stalling(memory: dpram._Memory, start: int, data: bytes) -> None:
        if start == HOST_MODE and data[2:].startswith(tuple(names)):
            names.clear()
            board.stalled = True
        store(memory, start, data)

    monkeypatch.setattr(dpram._Memory, "store", stalling)


def test_h14_a_move_that_fics_has_not_taken_is_not_carried_out_after_a_stop(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def story() -> None:
        async with cell(tmp_path) as it:
            assert await it.move(HomeRobot()) is MoveStatus.SUCCEEDED
            stall_at(b"LMI", it.board, monkeypatch)
            move = asyncio.create_task(it.move(DOWN))
            await asyncio.sleep(0.1)
            assert it.board.ram[HOST_FLAG] == 1
            assert it.board.ram[FROM_HOST].startswith(b"LMI ,,-5\r")
            await asyncio.sleep(2)
            assert (await it.robot.stop("immediate")).state == "not_sent"
            it.board.stalled = False
            assert await move is MoveStatus.UNKNOWN  # Fics could have taken it just before it was taken back
            await asyncio.sleep(REOPENED_S)
            assert it.types("robot.stop")[-1] == "robot.stop.confirmed"
            assert it.heard("AES") != []
            assert it.heard("LMI") == []

    run_virtual(story())


def test_h14_a_stop_that_fics_has_not_taken_is_said_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def story() -> None:
        async with cell(tmp_path) as it:
            started = await it.start(HomeRobot())
            await asyncio.sleep(0.5)
            stall_at(b"AES", it.board, monkeypatch)
            it.robot.stop("immediate")
            await asyncio.sleep(1.5)
            assert "line.down" in it.types("line")
            assert it.heard("AES") == []
            it.board.stalled = False
            await asyncio.sleep(REOPENED_S)
            assert it.heard("AES") != []
            assert it.types("robot.stop")[-1] == "robot.stop.confirmed"
            assert (await it.plant.robot_moves.wait(started.id, 60.0)).status is not MoveStatus.SUCCEEDED

    run_virtual(story())


@pytest.mark.parametrize("stuck_s", [3, 20])
def test_h14_a_slow_fics_is_waited_for_as_long_as_the_address_says(tmp_path: Path, stuck_s: int) -> None:
    async def story() -> None:
        async with cell(tmp_path, options=f"?stuck_ms={stuck_s}000") as it:
            it.board.stalled = True
            question = asyncio.create_task(it.robot.unit(1).position())
            await asyncio.sleep(stuck_s - 0.1)
            assert "line.down" not in it.types("line")
            await asyncio.sleep(0.2)
            assert it.types("line")[-1] == "line.down"
            it.board.stalled = False
            await asyncio.sleep(REOPENED_S)
            assert it.is_ready()
            await asyncio.wait({question})
            assert isinstance(question.exception(), NoReply)

    run_virtual(story())


def test_h15_no_answer_is_read_while_it_is_being_written(tmp_path: Path) -> None:
    async def story() -> None:
        async with cell(tmp_path) as it:
            it.board.machine.robot.variables = [1000.0 * number + 0.125 for number in range(100)]
            it.board.torn = True
            for number in range(100):
                reply = await it.robot.ask(GetVariable(number=number))
                assert reply == VariableValue(number=number, value=1000.0 * number + 0.125)
            assert it.robot.line.counters["garbage"] == 0
            assert await it.move(HomeRobot()) is MoveStatus.SUCCEEDED

    run_virtual(story())


def test_h16_a_command_without_its_flag_is_never_carried_out(tmp_path: Path) -> None:
    def crash_before_the_flag(board: Board) -> None:
        board.ram[FROM_HOST.start : FROM_HOST.start + 10] = b"LMI ,,-50\r"

    async def story() -> None:
        async with cell(tmp_path, crash_before_the_flag) as it:
            assert await it.move(DOWN) is MoveStatus.SUCCEEDED
            assert it.heard("LMI") == ["LMI ,,-5"]

    run_virtual(story())


@pytest.mark.parametrize("vanish", [Board.take_out, Board.cut_short])
def test_h17_a_ram_that_vanishes_takes_the_line_down_and_not_the_gateway(
    tmp_path: Path, vanish: Callable[[Board], None]
) -> None:
    async def story() -> None:
        async with cell(tmp_path) as it:
            assert await it.move(HomeRobot()) is MoveStatus.SUCCEEDED
            vanish(it.board)
            await asyncio.sleep(1)
            assert not it.is_ready()
            assert "line.down" in it.types("line")
            with pytest.raises(NotSent):
                await it.robot.unit(1).position()
            assert (await it.robot.stop("immediate")).state == "not_sent"
            it.board.put_in()
            await asyncio.sleep(REOPENED_S)
            assert it.is_ready()
            assert it.types("robot.stop")[-1] == "robot.stop.confirmed"
            await it.robot.conversation.reset_errors()
            assert await it.move(DOWN) is MoveStatus.SUCCEEDED

    run_virtual(story())


@pytest.mark.parametrize("vanish", [Board.take_out, Board.cut_short])
def test_h17_a_move_is_followed_on_after_the_ram_has_come_back(
    tmp_path: Path, vanish: Callable[[Board], None]
) -> None:
    async def story() -> None:
        async with cell(tmp_path) as it:
            started = await it.start(HomeRobot())
            vanish(it.board)
            await asyncio.sleep(0.5)
            it.board.put_in()
            move = await it.plant.robot_moves.wait(started.id, 60.0)
            assert move.status in (MoveStatus.SUCCEEDED, MoveStatus.UNKNOWN)
            assert move.completion == "inferred"
            assert len(it.heard("ORG")) == 1

    run_virtual(story())
