"""A line that says back what is written to it: told, asked seldom, and used again when the echo is over."""

import asyncio
from collections.abc import AsyncIterator, Callable, Coroutine
from contextlib import asynccontextmanager
from dataclasses import dataclass
from typing import Any

import pytest

from gateway.causes import LINE_DOWN
from gateway.core.alarms import Alarm
from gateway.core.errors import LineDown
from gateway.core.line import LineDriver
from gateway.core.line_state import LineState
from protocols.fics.moves import MoveRelative
from protocols.rorze.moves import MoveClockwise
from tests.fics_plants import fics_rig
from tests.gateway.rorze.far_end import until
from tests.plants import in_virtual_time, rig, start
from tests.simulated_line import SimulatedCable
from tests.tested_plant import TestedPlant

FRAMES_A_MINUTE = 120
NOTED_WITHIN_S = 30.0
BACK_WITHIN_S = 60.0


@dataclass
class Stand:
    """A plant with one line, whatever its family."""

    plant: TestedPlant
    cable: SimulatedCable
    move: Callable[[], Coroutine[Any, Any, object]]
    stop: Callable[[], "asyncio.Task[Any]"]
    stop_frame: bytes

    @property
    def line(self) -> LineDriver[Any, Any, Any]:
        (port,) = self.plant.ports().values()
        assert isinstance(port, LineDriver)
        return port

    def told(self, kind: str) -> int:
        hub = self.plant.events
        return sum(
            it is not None and it.type == kind for it in map(hub.event, range(hub.first, hub.last + 1))
        )

    def alarms(self) -> list[Alarm]:
        return [it for it in self.plant.alarms.standing() if it.cause == LINE_DOWN]

    async def frames_of_a_minute(self) -> int:
        before = len(self.cable.written)
        await asyncio.sleep(60.0)
        return len(self.cable.written) - before


@asynccontextmanager
async def rc_400() -> AsyncIterator[Stand]:
    async with rig() as it:
        yield Stand(
            it.plant,
            it.wire,
            lambda: start(it, MoveClockwise(distance=500)),
            lambda: it.plant.stops.stop([it.body()], "immediate"),
            b"&3F5IS\r",
        )


def fics(mode: int) -> Callable[[], Any]:
    @asynccontextmanager
    async def stand() -> AsyncIterator[Stand]:
        async with fics_rig(mode=mode) as it:
            yield Stand(
                it.plant,
                it.cable,
                lambda: it.start(MoveRelative(coordinates=[None, None, -5.0])),
                lambda: it.robot.stop("immediate"),
                b"AES\r",
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
@in_virtual_time
async def test_a_line_that_echoes_no_longer_is_set_up_and_its_alarm_ends(line: str) -> None:
    async with LINES[line]() as it:
        it.cable.echoes = True
        await asyncio.sleep(NOTED_WITHIN_S)
        it.cable.echoes = False
        await until(lambda: it.line.state is LineState.READY, BACK_WITHIN_S)
        await asyncio.sleep(BACK_WITHIN_S)
        assert it.line.state is LineState.READY
        assert it.told("line.up") == 2
        assert all(alarm.ended_at is not None for alarm in it.alarms())


@lines
@pytest.mark.parametrize("later_s", [0.0, 0.21, 0.47, 0.93])
@in_virtual_time
async def test_a_stop_is_written_at_once_to_a_line_that_echoes(line: str, later_s: float) -> None:
    async with LINES[line]() as it:
        it.cable.echoes = True
        await asyncio.sleep(NOTED_WITHIN_S + later_s)
        written = len(it.cable.written)
        it.stop()
        await asyncio.sleep(0.005)
        assert it.stop_frame in it.cable.written[written:]


@lines
@echoes
@in_virtual_time
async def test_a_move_is_refused_at_once_on_a_line_that_echoes(line: str, echo: str) -> None:
    async with LINES[line]() as it:
        setattr(it.cable, ECHOES[echo], True)
        await asyncio.sleep(NOTED_WITHIN_S)
        written = len(it.cable.written)
        began_at = asyncio.get_running_loop().time()
        with pytest.raises(LineDown, match=r"echoes what is written to it.* Nothing was sent"):
            await it.move()
        assert asyncio.get_running_loop().time() == began_at, "it was not refused at the start"
        await asyncio.sleep(10.0)
        assert not [it for it in it.cable.written[written:] if it[3:6] == b"1+M" or it.startswith(b"LMI")]
