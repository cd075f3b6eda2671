"""A line that says back what is written to it: told, asked seldom, and used again when the echo is over."""

import asyncio
from collections.abc import AsyncIterator, Callable, Coroutine
from contextlib import asynccontextmanager
from dataclasses import dataclass
from typing import Any

import pytest

from gateway.causes import LINE_DOWN
from gateway.core.alarms import Alarm
from gateway.core.errors import PortNotOpen
from gateway.core.exchange import Lane
from gateway.core.line import LineDriver
from gateway.core.line_state import LineState
from gateway.core.move_record import MoveStatus
from gateway.fics.session import FicsSession
from protocols.fics.alarms import ResetErrors
from protocols.fics.homing import HomeRobot
from protocols.fics.inputs_outputs import GetInputChannel
from protocols.fics.moves import MoveRelative, MoveToPosition
from protocols.fics.row import FicsCommand
from protocols.rorze.moves import MoveClockwise
from protocols.table import Ack
from simulator.fics.alarms import unreachable
from tests.fics_plants import fics_rig
from tests.gateway.rorze.far_end import until
from tests.plants import in_virtual_time, rig, start
from tests.simulated_line import SimulatedCable
from tests.tested_plant import TestedPlant

FRAMES_A_MINUTE = 120
AT_ONCE_S = 0.05
"""A frame at 9600 baud that is under way is written to its end."""
NOTED_WITHIN_S = 30.0
BACK_WITHIN_S = 5.0
QUIET_S = 60.0
CONFIRMED_WITHIN_S = 2.0


@dataclass
class Stand:
    """A plant with one line, whatever its family."""

    plant: TestedPlant
    cable: SimulatedCable
    move: Callable[[], Coroutine[Any, Any, Any]]
    ended: Callable[[str, float], Coroutine[Any, Any, Any]]
    stop: Callable[[], "asyncio.Task[Any]"]
    stop_frame: bytes
    moving: Callable[[], bool]

    @property
    def line(self) -> LineDriver[Any, Any, Any]:
        (port,) = self.plant.ports().values()
        assert isinstance(port, LineDriver)
        return port

    def told(self, kind: str) -> int:
        hub = self.plant.events
        return sum(it.type == kind for it in map(hub.event, range(hub.first, hub.last + 1)))

    def alarms(self) -> list[Alarm]:
        return [it for it in self.plant.alarms.standing() if it.cause == LINE_DOWN]

    async def frames_of_a_minute(self) -> int:
        before = len(self.cable.written)
        await asyncio.sleep(60.0)
        return len(self.cable.written) - before


@asynccontextmanager
async def rc_400() -> AsyncIterator[Stand]:
    async with rig(baud=9600) as it:
        yield Stand(
            it.plant,
            it.wire,
            lambda: start(it, MoveClockwise(distance=20_000)),
            it.plant.moves.wait,
            lambda: it.plant.stops.stop([it.body()], "immediate"),
            b"&3F5IS\r",
            lambda: it.axis().motor.moving,
        )


def fics(mode: int) -> Callable[[], Any]:
    @asynccontextmanager
    async def stand() -> AsyncIterator[Stand]:
        async with fics_rig(mode=mode, baud=9600) as it:
            assert (await it.move(HomeRobot())).status is MoveStatus.SUCCEEDED
            yield Stand(
                it.plant,
                it.cable,
                lambda: it.start(MoveRelative(coordinates=[100.0, None, None])),
                it.plant.robot_moves.wait,
                lambda: it.robot.stop("immediate"),
                b"AES\r",
                lambda: it.fics.job is not None,
            )

    return stand


LINES = {"RC-400": rc_400, "Fics in mode 2": fics(2), "Fics in mode 3": fics(3)}
ECHOES = {"local echo": "echoes", "joined wires": "is_looped"}
lines = pytest.mark.parametrize("line", LINES)
echoes = pytest.mark.parametrize("echo", ECHOES)


@lines
@echoes
@in_virtual_time
async def test_a_line_that_echoes_is_told_once_and_asked_a_few_times_a_second(line: str, echo: str) -> None:
    async with LINES[line]() as it:
        setattr(it.cable, ECHOES[echo], True)
        await asyncio.sleep(NOTED_WITHIN_S)
        for _ in range(3):
            assert await it.frames_of_a_minute() <= FRAMES_A_MINUTE
        assert it.line.state is LineState.SILENT
        assert "what is written comes back" in (it.line.trouble or "")
        assert it.told("line.down") == 1
        assert it.told("line.up") == 1
        [alarm] = it.alarms()
        assert "turn off the local echo" in str(alarm.en)
        assert "wires are joined" in str(alarm.en)
        assert "Stops are sent while its port is open" in alarm.en.motor


@lines
@echoes
@in_virtual_time
async def test_a_line_that_echoes_no_longer_is_set_up_and_its_alarm_ends(line: str, echo: str) -> None:
    async with LINES[line]() as it:
        setattr(it.cable, ECHOES[echo], True)
        await asyncio.sleep(NOTED_WITHIN_S)
        setattr(it.cable, ECHOES[echo], False)
        await until(lambda: it.line.state is LineState.READY, BACK_WITHIN_S)
        await asyncio.sleep(QUIET_S)
        assert it.line.state is LineState.READY
        assert it.told("line.up") == 2
        assert all(alarm.ended_at is not None for alarm in it.alarms())


@lines
@in_virtual_time
async def test_a_port_that_was_opened_anew_knows_of_no_echo(line: str) -> None:
    async with LINES[line]() as it:
        it.cable.echoes = True
        await asyncio.sleep(NOTED_WITHIN_S)
        it.cable.unplug()
        it.cable.echoes, it.cable.plugged_in = False, True
        assert not it.line.echoes
        await until(lambda: it.line.state is LineState.READY, BACK_WITHIN_S)


@lines
@pytest.mark.parametrize("later_s", [0.0, 0.21, 0.47, 0.93])
@in_virtual_time
async def test_a_stop_is_written_at_once_to_a_line_that_echoes(line: str, later_s: float) -> None:
    async with LINES[line]() as it:
        it.cable.echoes = True
        await asyncio.sleep(NOTED_WITHIN_S + later_s)
        written = len(it.cable.written)
        it.stop()
        await asyncio.sleep(AT_ONCE_S)
        assert it.stop_frame in it.cable.written[written:]


@lines
@pytest.mark.parametrize("later_s", [0.0, 0.05, 3.0])
@in_virtual_time
async def test_a_stop_is_confirmed_by_the_true_replies_beside_the_echoes(line: str, later_s: float) -> None:
    async with LINES[line]() as it:
        await it.move()
        it.cable.echoes = True
        await asyncio.sleep(later_s)
        report = it.stop()
        await asyncio.sleep(CONFIRMED_WITHIN_S)
        assert not it.moving()
        told = await report
        assert (told[0] if isinstance(told, list) else told).state == "confirmed"
        assert it.told("body.stop.unconfirmed") + it.told("robot.stop.unconfirmed") == 0


@lines
@echoes
@pytest.mark.parametrize("for_s", [0.3, 8.0])
@in_virtual_time
async def test_a_move_under_way_when_the_echo_begins_is_followed_to_its_end(
    line: str, echo: str, for_s: float
) -> None:
    async with LINES[line]() as it:
        move = await it.move()
        await asyncio.sleep(0.1)
        assert it.moving()
        setattr(it.cable, ECHOES[echo], True)
        await asyncio.sleep(for_s)
        setattr(it.cable, ECHOES[echo], False)
        over = await it.ended(move.id, 60.0)
        assert not it.moving()
        assert over.status is MoveStatus.SUCCEEDED


@lines
@echoes
@in_virtual_time
async def test_a_move_is_refused_at_once_on_a_line_that_echoes(line: str, echo: str) -> None:
    async with LINES[line]() as it:
        setattr(it.cable, ECHOES[echo], True)
        await asyncio.sleep(NOTED_WITHIN_S)
        written = len(it.cable.written)
        began_at = asyncio.get_running_loop().time()
        with pytest.raises(PortNotOpen, match=r"echoes what is written to it.* Nothing was sent"):
            await it.move()
        assert asyncio.get_running_loop().time() == began_at, "it was not refused at the start"
        await asyncio.sleep(10.0)
        assert not [it for it in it.cable.written[written:] if it[3:6] == b"1+M" or it.startswith(b"LMI")]


MOTIONS = {
    "homing": HomeRobot(),
    "a failure": MoveToPosition(position=183),
    "a position": MoveToPosition(position=1),
}


@pytest.mark.parametrize("command", MOTIONS.values(), ids=MOTIONS)
@pytest.mark.parametrize("mode", [2, 3])
@echoes
@in_virtual_time
async def test_a_motion_whose_own_echo_looks_like_its_answer_ends_as_it_did(
    command: FicsCommand[Ack], mode: int, echo: str
) -> None:
    """`ORG` is answered with `ORG` when it is done, and `POM 183` with `POM 183` where 183 is its error."""
    async with fics_rig(mode=mode, baud=9600) as it:
        await it.move(HomeRobot())
        it.fics.units[1].positions = {1: (None, None, 10.0), 183: (None, None, 20.0)}
        begun = len(it.machine.truth.of("motion_start"))
        written = asyncio.create_task(it.cable.written_from(command.text))
        moving = asyncio.create_task(it.start(command))
        await written
        assert it.cable.written[-1] == command.text.encode() + b"\r"
        setattr(it.cable, ECHOES[echo], True)  # its echo is the first
        asyncio.get_running_loop().call_soon(it.cable._deliver, it.cable.written[-1])
        if echo == "joined wires":
            it.cable.lost_once = command.text
        await asyncio.sleep(1.0)
        setattr(it.cable, ECHOES[echo], False)
        over = await it.plant.robot_moves.wait((await moving).id, 60.0)
        done = len(it.machine.truth.of("motion_start")) - begun
        assert done == (echo == "local echo")
        if done:
            assert over.status is MoveStatus.SUCCEEDED
        else:
            assert over.status is MoveStatus.UNKNOWN or over.end_cause == "not_executed"


@in_virtual_time
async def test_a_true_failure_with_the_number_of_its_command_is_told() -> None:
    async with fics_rig(baud=9600) as it:
        await it.move(HomeRobot())
        it.fics.units[1].positions = {183: (None, None, 40.0)}
        moving = asyncio.create_task(it.start(MoveToPosition(position=183)))
        await it.cable.written_from("POM 183")
        await asyncio.sleep(0.15)
        it.touch(lambda fics, now: fics.raise_alarm(unreachable(), now))
        over = await it.plant.robot_moves.wait((await moving).id, 60.0)
        assert (over.status, over.end_cause) == (MoveStatus.FAILED, "error_183")
        assert it.robot.line.counters["echoes"] == 0


@pytest.mark.parametrize("mode", [2, 3])
@in_virtual_time
async def test_answers_that_equal_what_was_asked_are_no_echo(mode: int) -> None:
    """`AES` is answered with `AES`, and `IDI 10` where the inputs of channel 10 are 10h."""
    async with fics_rig(mode=mode) as it:
        for _ in range(20):
            await it.robot.stop("decelerate")
            await it.robot.stop("immediate")
            await it.robot.ask(ResetErrors())
        assert it.robot.line.counters["echoes"] == 0
        assert it.robot.line.state is LineState.READY


def test_a_question_that_its_own_echo_could_answer_is_not_asked_of_a_line_that_echoes() -> None:
    session = FicsSession("r1")
    ambiguous, plain = (session.exchange(GetInputChannel(channel=it), Lane.READ) for it in (10, 1))
    assert not session.shows_echo(ambiguous)
    assert session.shows_echo(plain)
