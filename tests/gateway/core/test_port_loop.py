"""A port kept open, set up and paced, whatever is said on it."""

import asyncio
from collections import Counter
from collections.abc import AsyncIterator, Callable, Coroutine, Iterable
from contextlib import asynccontextmanager
from itertools import pairwise
from typing import Any

import pytest

from gateway.core.line import REOPEN_S, SILENCE_S, PortLoop
from gateway.core.line_state import LineState
from protocols.rorze.link import POISON
from tests.gateway.rorze.far_end import FarEnd, until, virtual
from transports.base import STUCK_S, Receiver, TransportUnavailable

FRAME = b"&026PD\r"
BAUD = 9600
FRAME_S = len(FRAME) * 10 / BAUD


class PlainLine(PortLoop):
    """Writes frames as they are and understands nothing of what comes back."""

    def __init__(self, far: FarEnd) -> None:
        super().__init__("line1", far, Counter())
        self.queue: list[bytes] = []
        self.set_ups: list[bool] = []
        self.set_up_s = 0.0
        self.set_up_fault: Exception | None = None
        self.opening = b""
        self.nobody = ""
        """Reason for which no controller answers; empty if they do."""
        self.heard = b""
        self.broken_off: list[str] = []
        self.woken: list[float] = []
        self.due: list[float] = []
        self.in_step = True
        self.beside_ran = self.beside_ended = False
        self.news: list[tuple[str, dict[str, object]]] = []
        self.on_change = lambda what, facts: self.news.append((what, facts))

    async def _set_up(self, *, fresh: bool) -> None:
        self._begins_set_up()
        self.set_ups.append(fresh)
        fault, self.set_up_fault = self.set_up_fault, None
        if fault:
            raise fault
        if fresh and self.opening:
            await self._clear_with(self.opening, patience_s=1.0)
        await asyncio.sleep(self.set_up_s)
        if self.nobody:
            self._is_silent(self.nobody)
        else:
            self._came_up({})

    def _wait_longer(self, seconds: float) -> None:
        """Nothing is waited for."""

    def _break_off(self, reason: str) -> None:
        self.broken_off.append(reason)

    def _pump(self) -> None:
        now = self._loop.time()
        while self._life.is_open and self.queue and self._port_is_free(now):
            self._send(self.queue.pop(0), now)

    def _pass_deadlines(self, now: float) -> float | None:
        self.woken.append(now)
        self.due = [at for at in self.due if at > now]
        return min(self.due, default=None)

    def data_received(self, data: bytes) -> None:
        self.heard += data
        self._wire.heard_at = self._loop.time()

    def _in_step(self) -> bool:
        return self.in_step

    def _beside(self) -> Iterable[Callable[[], Coroutine[Any, Any, None]]]:
        return (self._run_beside,)

    async def _run_beside(self) -> None:
        self.beside_ran = True
        try:
            await asyncio.Event().wait()
        finally:
            self.beside_ended = True

    def say(self, *frames: bytes) -> None:
        self.queue += frames
        self._pump()


class Port(FarEnd):
    """A port that says how often it was asked for unsent bytes, and why it cannot be opened."""

    def __init__(self, baud: int | None = None) -> None:
        super().__init__(baud)
        self.asked = 0
        self.trouble: str | Exception = ""
        self.closed = 0

    async def open(self, receiver: Receiver) -> None:
        await super().open(receiver)
        if self.trouble:
            raise self.trouble if isinstance(self.trouble, Exception) else TransportUnavailable(self.trouble)

    def unsent(self) -> int:
        self.asked += 1
        return super().unsent()

    async def close(self) -> None:
        self.closed += 1
        await super().close()


@asynccontextmanager
async def plain_line(port: Port) -> AsyncIterator[PlainLine]:
    """A line that is ready."""
    line = PlainLine(port)
    line.start()
    await until(lambda: line.state is LineState.READY)
    yield line
    await line.close()


def now() -> float:
    return asyncio.get_running_loop().time()


# states


@virtual
async def test_a_line_is_down_then_set_up_then_ready_and_may_fall_out_of_step() -> None:
    line = PlainLine(Port())
    line.set_up_s = 0.5
    states = [line.state]
    line.start()
    for _ in range(2):
        await asyncio.sleep(0.3)
        states.append(line.state)
    line.in_step = False
    states.append(line.state)
    await line.close()
    states.append(line.state)
    assert states == ["down", "setting_up", "ready", "out_of_step", "down"]


@virtual
async def test_the_end_of_a_line_breaks_everything_off_and_closes_the_port() -> None:
    port = Port()
    async with plain_line(port) as line:
        assert line.beside_ran
    assert line.beside_ended
    assert line.broken_off == ["the gateway is shutting down"]
    assert line.news == [("line.up", {}), ("line.down", {"reason": "the gateway is shutting down"})]
    assert port.closed == 1
    await asyncio.sleep(60)
    assert len(port.openings) == 1


# silence


@virtual
async def test_a_line_on_which_nobody_answers_is_silent_and_was_never_up(
    caplog: pytest.LogCaptureFixture,
) -> None:
    line = PlainLine(Port())
    line.nobody = "check the cable"
    line.start()
    await asyncio.sleep(1)
    line.set_up_again("try")
    await asyncio.sleep(1)
    assert (line.state, line.trouble) == (LineState.SILENT, "check the cable")
    assert [it.getMessage() for it in caplog.records].count("line line1 is silent: check the cable") == 1
    await line.close()
    assert line.news == []


@virtual
async def test_every_line_down_follows_a_line_up_whatever_happens() -> None:
    port = Port()
    async with plain_line(port) as line:
        for nobody in ("", "check the cable", "check the power", "", "", "check the cable"):
            line.nobody = nobody
            line.set_up_again("test")
            await asyncio.sleep(0.1)
            assert line.trouble == (nobody or None)
        port.unplug()
        await asyncio.sleep(0)
        assert line.state is LineState.DOWN
        port.plugged_in = True
        line.nobody = ""
        await until(lambda: line.state is LineState.READY)
        assert line.trouble is None
    assert [what for what, _ in line.news] == 3 * ["line.up", "line.down"]


# opening


@virtual
async def test_after_an_opening_that_worked_the_pauses_are_short_again() -> None:
    port = Port()
    port.trouble = "the port is taken"
    line = PlainLine(port)
    line.start()
    await asyncio.sleep(30)
    port.trouble = ""
    await until(lambda: line.state is LineState.READY)
    lost_at = now()
    port.unplug()
    await asyncio.sleep(2)
    first_s, _ = REOPEN_S
    pauses = [later - earlier for earlier, later in pairwise([lost_at, *port.openings[-3:]])]
    assert pauses == pytest.approx([first_s, 2 * first_s, 4 * first_s])
    assert line.counters["openings"] == 1
    await line.close()


@virtual
async def test_a_reason_is_told_once_for_as_long_as_it_stays_the_same(
    caplog: pytest.LogCaptureFixture,
) -> None:
    port = Port()
    port.trouble = "the port is taken"
    line = PlainLine(port)
    line.start()
    await asyncio.sleep(3)
    port.trouble = "there is no such port"
    await asyncio.sleep(10)
    told = [record.getMessage() for record in caplog.records]
    assert told == ["line line1 is down: the port is taken", "line line1 is down: there is no such port"]
    assert line.trouble == "there is no such port"
    assert line.news == [], "it was never up"
    assert "there is no such port. Nothing was sent." in line._down().detail
    await line.close()


@virtual
async def test_a_port_is_closed_before_it_is_opened_again() -> None:
    port = Port()
    async with plain_line(port) as line:
        port.unplug()
        await asyncio.sleep(0)
        await asyncio.sleep(0)
        assert port.closed == 1
        assert line.state is LineState.DOWN


@virtual
async def test_a_fault_that_nobody_foresaw_takes_the_line_down_until_the_next_try_and_is_logged(
    caplog: pytest.LogCaptureFixture,
) -> None:
    port = Port()
    port.trouble = RuntimeError("the driver is out of its mind")
    line = PlainLine(port)
    line.start()
    await asyncio.sleep(30)
    assert len(port.openings) > 3
    assert line.trouble == "a fault of the gateway itself, RuntimeError: the driver is out of its mind"
    assert [record.exc_info is not None for record in caplog.records].count(True) == 1
    port.trouble = ""
    await until(lambda: line.state is LineState.READY)
    await line.close()


@virtual
async def test_a_fault_in_a_set_up_closes_the_port_and_it_is_opened_anew() -> None:
    port = Port()
    async with plain_line(port) as line:
        line.set_up_fault = ValueError("no such frame")
        line.set_up_again("the far end has restarted")
        await until(lambda: port.closed)
        assert line.broken_off == ["a fault of the gateway itself, ValueError: no such frame"]
        await until(lambda: line.state is LineState.READY)
        assert line.set_ups == [True, False, True]


# set-up


@virtual
async def test_only_the_set_up_after_an_opening_is_fresh() -> None:
    port = Port()
    async with plain_line(port) as line:
        line.set_up_again("the far end has restarted")
        await until(lambda: len(line.set_ups) == 2)
        port.unplug()
        port.plugged_in = True
        await until(lambda: len(line.set_ups) == 3)
        assert line.set_ups == [True, False, True]
        assert line.counters["set_ups_again"] == 1


@virtual
async def test_however_often_it_is_asked_for_during_a_set_up_one_more_follows() -> None:
    line = PlainLine(Port())
    line.set_up_s = 1.0
    line.start()
    await asyncio.sleep(0.5)
    for _ in range(5):
        line.set_up_again("the far end has restarted")
    await asyncio.sleep(20)
    assert line.set_ups == [True, False]
    await line.close()


# clearing


@virtual
async def test_silence_counts_from_the_last_bit_of_the_opening() -> None:
    port = Port(BAUD)
    line = PlainLine(port)
    line.opening = POISON
    line.start()
    await until(lambda: line.state is LineState.READY)
    (opened_at,) = port.openings
    assert now() - opened_at == pytest.approx(len(POISON) * 10 / BAUD + SILENCE_S, abs=0.002)
    await line.close()


@virtual
async def test_a_port_that_goes_while_it_is_cleared_is_not_waited_for() -> None:
    port = Port()
    line = PlainLine(port)
    line.opening = POISON
    line.start()
    await until(lambda: port.written)
    for beat in range(100):
        port.say(b"\xff", beat * 0.02)
    await asyncio.sleep(0.2)
    port.unplug()
    await asyncio.sleep(0.6 * SILENCE_S)
    assert line.heard
    assert line.state is LineState.DOWN
    assert port.closed == 1  # the set-up was over at once
    await line.close()


# writing


@virtual
async def test_no_frame_begins_before_the_last_bit_of_the_one_before() -> None:
    port = Port(BAUD)
    async with plain_line(port) as line:
        line.say(FRAME, FRAME, FRAME)
        assert len(port.written) == 1
        await asyncio.sleep(1)
        first, second, third = (at for at, _ in port.written)
        assert second - first == pytest.approx(FRAME_S)
        assert third - second == pytest.approx(FRAME_S)


@virtual
async def test_while_all_has_been_answered_the_port_is_not_asked() -> None:
    port = Port()
    async with plain_line(port) as line:
        line._wire.all_answered = True
        line.say(FRAME)
        assert (port.asked, len(port.written)) == (0, 1)
        line.say(FRAME)
        assert (port.asked, len(port.written)) == (1, 2)


@virtual
async def test_a_port_that_takes_bytes_now_and_then_is_not_stuck() -> None:
    port = Port()
    async with plain_line(port) as line:
        for _ in range(4):
            port.stuck = True
            line.say(FRAME, FRAME)
            await asyncio.sleep(0.6 * STUCK_S)
            port.stuck, port._held_back = False, 0
            await asyncio.sleep(0.1)
        port.stuck = True
        line.say(FRAME, FRAME)
        await asyncio.sleep(0.9 * STUCK_S)
        assert line.state is LineState.READY
        await asyncio.sleep(0.2 * STUCK_S)
        assert line.news[1:] == [("line.down", {"reason": "scripted:// takes no bytes"})]


@virtual
async def test_a_port_that_has_gone_without_a_word_is_found_out_by_the_next_frame() -> None:
    port = Port()
    async with plain_line(port) as line:
        port._receiver = None
        assert not line._send(FRAME, now())
        assert line.state is LineState.DOWN
        assert line.broken_off == ["the cable is not plugged in"]


@virtual
async def test_after_an_opening_it_is_asked_again_what_it_holds_back() -> None:
    port = Port()
    async with plain_line(port) as line:
        line._wire.all_answered = True
        port.unplug()
        port.plugged_in = True
        await until(lambda: line.state is LineState.READY)
        line.say(FRAME)
        assert port.asked == 1


# time


@virtual
async def test_one_timer_goes_off_at_whatever_is_due_first() -> None:
    async with plain_line(Port()) as line:
        began_at = now()
        line.due = [began_at + after_s for after_s in (3.0, 1.0, 2.0)]
        for at in line.due:
            line._timer.set(at)
        await asyncio.sleep(10)
        assert line.woken == pytest.approx([began_at + 1.0, began_at + 2.0, began_at + 3.0])


# another gateway


@virtual
async def test_a_port_that_another_gateway_takes_while_it_is_opened_is_closed_again() -> None:
    port = Port()
    line = PlainLine(port)
    opened = port.open

    async def open_late(receiver: Receiver) -> None:
        await opened(receiver)
        line.owner.stands_by = lambda: "gateway b has it"
        line.hand_over("gateway b has it")

    port.open = open_late  # type: ignore[method-assign]
    line.start()
    await asyncio.sleep(2)
    assert (line.state, line.trouble) == (LineState.STANDBY, "gateway b has it")
    assert (line.set_ups, port.closed, line.news) == ([], 1, [])
    await line.close()


@virtual
async def test_a_line_that_is_retired_is_not_opened_again() -> None:
    port = Port()
    async with plain_line(port) as line:
        line.retire("the configuration is another")
        await asyncio.sleep(60)
        assert len(port.openings) == 1
        assert line.trouble == "the configuration is another"
