import asyncio
import os
from time import monotonic

import anyio
import anyio.lowlevel
import pytest

from transports import nudge
from transports.nudge import FRAMES_KEPT, LEAD_S, SLEEP_S, Nudge

pytestmark = pytest.mark.anyio


class Line:
    """A line whose clock only moves when a frame or a reply travels, and a nudge that listens in."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.now = self.heard_at = 100.0
        self.waits: list[float] = []
        monkeypatch.setattr(nudge, "monotonic", lambda: self.now)
        monkeypatch.setattr(Nudge, "_set", lambda _, wait_s: self.waits.append(wait_s))
        self.nudge = Nudge(asyncio.get_running_loop())

    def ask(self, frame: bytes, *, answered_in_s: float | None) -> None:
        self.nudge.wrote(frame, self.heard_at)
        if answered_in_s is not None:
            self.now += answered_in_s
            self.heard_at = self.now


@pytest.fixture
async def line(monkeypatch: pytest.MonkeyPatch) -> Line:
    return Line(monkeypatch)


async def test_a_reply_is_expected_when_the_last_one_to_the_same_frame_came(line: Line) -> None:
    line.ask(b"&006PD\r", answered_in_s=0.002)
    line.ask(b"&009MD\r", answered_in_s=0.030)
    assert line.waits == []
    line.ask(b"&006PD\r", answered_in_s=0.004)
    line.ask(b"&006PD\r", answered_in_s=0.004)
    line.nudge.close()
    assert line.waits == pytest.approx([0.002 - LEAD_S, 0.004 - LEAD_S])


async def test_nothing_is_learned_from_a_reply_that_stays_away(line: Line) -> None:
    line.ask(b"&006PD\r", answered_in_s=None)
    line.now += 10
    line.ask(b"&006PD\r", answered_in_s=None)
    line.nudge.close()
    assert line.waits == []


async def test_nobody_is_woken_where_nobody_falls_asleep(line: Line) -> None:
    for _ in range(2):
        line.ask(b"&006PD\r", answered_in_s=SLEEP_S)
    line.nudge.close()
    assert line.waits == []


async def test_the_memory_of_frames_is_bounded(line: Line) -> None:
    for number in range(3 * FRAMES_KEPT):
        line.ask(b"&003ND%d\r" % number, answered_in_s=0.002)
    line.nudge.close()
    assert len(line.nudge._took_s) <= FRAMES_KEPT


async def test_the_computer_is_woken_once(monkeypatch: pytest.MonkeyPatch) -> None:
    rings: list[int] = []
    woken = anyio.Event()

    def ring(timer: int) -> None:
        silence(timer)
        rings.append(timer)
        woken.set()

    silence = nudge._silence
    monkeypatch.setattr(nudge, "_silence", ring)
    alarm = Nudge(asyncio.get_running_loop())
    alarm.wrote(b"&006PD\r", 0.0)
    alarm.wrote(b"&006PD\r", monotonic() + 0.002)
    with anyio.fail_after(60):
        await woken.wait()
    await anyio.lowlevel.checkpoint()
    assert len(rings) == 1
    alarm.close()
    alarm.close()


async def test_a_timer_that_was_set_anew_has_nothing_to_silence() -> None:
    timer = nudge._timer()
    assert timer is not None
    nudge._silence(timer)
    os.close(timer)


async def test_a_system_without_such_timers_does_without(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(nudge, "_LIBC", object())
    alarm = Nudge(asyncio.get_running_loop())
    assert alarm._timer is None
    for _ in range(2):
        alarm.wrote(b"&006PD\r", monotonic() + 0.002)
    alarm.close()
