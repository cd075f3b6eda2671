"""The table of jogs: each state with all news, the first end that stays, and the page that shows it."""

import asyncio
from collections.abc import Callable, Coroutine
from itertools import product
from pathlib import Path
from types import SimpleNamespace
from typing import Any, get_args

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gateway.core.admission import Admission
from gateway.core.errors import NotFound
from gateway.core.jogs import (
    HEARTBEAT_S,
    KEPT,
    TABLE,
    Jog,
    JogAction,
    JogEnd,
    Jogging,
    JogNews,
    JogOutOfReach,
    JogOver,
    Jogs,
    JogState,
    drawing,
)
from tests.virtual_time import run_virtual

PAGE = Path(__file__).parents[3] / "docs" / "jogs.md"


class MotorJog(Jog):
    """A motor of the test."""


class Motor(Jogs[MotorJog, None]):
    """A motor that stands still when it is let."""

    def __init__(self) -> None:
        super().__init__(lambda news, _: self.told.append(news))
        self.told: list[str] = []
        self.stops = 0
        self.rests, self.stands = asyncio.Event(), asyncio.Event()
        self.reached = True
        self.unstoppable = 0
        """Stops that will meet a fault."""

    def begin(self) -> MotorJog:
        session: Jogging[MotorJog, None] = Jogging(MotorJog(), "the motor", self._line, None)
        self._begin(session)
        return session.jog

    @property
    def _line(self) -> Any:
        return SimpleNamespace(admission=Admission())

    def take(self, jog: Jog, news: JogNews) -> None:
        self._take(self._sessions[jog.id], news)

    def _require_in_reach(self, _: Jogging[MotorJog, None]) -> None:
        if not self.reached:
            raise JogOutOfReach("It", "the motor")

    def _stop(self, _: Jogging[MotorJog, None]) -> None:
        if self.unstoppable:
            self.unstoppable -= 1
            raise ZeroDivisionError
        self.stops += 1

    async def _rests(self, _: Jogging[MotorJog, None]) -> None:
        await self.rests.wait()

    async def _see_still(self, _: Jogging[MotorJog, None]) -> bool:
        await self.stands.wait()
        return True


def with_a_motor(story: Callable[[Motor], Coroutine[Any, Any, None]]) -> Callable[[], None]:
    """Tell a story of a motor, at whose end all is given up."""

    async def told() -> None:
        motor = Motor()
        try:
            await story(motor)
        finally:
            await motor.close()

    def test() -> None:
        run_virtual(told())

    return test


def test_the_table_has_every_state() -> None:
    assert list(TABLE) == ["jogging", "stopping", *get_args(JogEnd)]


@pytest.mark.parametrize(("state", "news"), list(product(TABLE, JogNews)), ids=str)
def test_only_a_standstill_or_a_refusal_makes_a_jog_over(state: JogState, news: JogNews) -> None:
    step = TABLE[state].get(news)
    if step is not None and step.action is JogAction.TELL:
        assert (state, news) in (("jogging", JogNews.REFUSED), ("stopping", JogNews.STILL))
    if state not in ("jogging", "stopping"):
        assert step is None or (step.state, step.action) == (state, JogAction.REFUSE)


@given(st.lists(st.sampled_from([it for it in JogNews if it is not JogNews.HEARTBEAT]), max_size=6))
def test_the_first_end_stays_whatever_follows(news: list[JogNews]) -> None:
    async def story() -> None:
        motor = Motor()
        jog = motor.begin()
        seen: list[tuple[str, str | None]] = []
        for each in news:
            motor.take(jog, each)
            seen.append((jog.state, jog.ends_as))
        ends = [end for _, end in seen if end is not None]
        assert len(set(ends)) <= 1
        over = [state for state, end in seen if state == end]
        assert over == [state for state, _ in seen[len(seen) - len(over) :]]
        assert len(motor.told) == len(set(motor.told)) or JogNews.MISSED in news
        await motor.close()

    run_virtual(story())


@with_a_motor
async def test_a_motor_jogs_for_half_a_second_after_each_heartbeat_and_no_longer(motor: Motor) -> None:
    jog = motor.begin()
    for _ in range(3):
        await asyncio.sleep(HEARTBEAT_S - 0.01)
        assert motor.heartbeat(jog.id).state == "jogging"
    await asyncio.sleep(HEARTBEAT_S)
    assert (jog.state, jog.ends_as, motor.stops) == ("stopping", "lost", 1)
    with pytest.raises(JogOver, match=r"JOG of the motor is being stopped \(lost\)"):
        motor.heartbeat(jog.id)
    motor.stands.set()
    await motor.settled()
    assert motor.told == ["started", "stopping", "lost"]


@with_a_motor
async def test_a_heartbeat_that_keeps_nothing_is_refused_and_counts_for_none(motor: Motor) -> None:
    jog = motor.begin()
    motor.reached = False
    await asyncio.sleep(0.3)
    with pytest.raises(JogOutOfReach):
        motor.heartbeat(jog.id)
    await asyncio.sleep(0.3)
    assert jog.ends_as == "lost"


@with_a_motor
async def test_a_stop_that_meets_a_fault_is_sent_again_and_the_end_stays_the_first(motor: Motor) -> None:
    jog = motor.begin()
    motor.unstoppable = 2
    with pytest.raises(ZeroDivisionError):
        await motor.end(jog.id)
    await asyncio.sleep(1.0)
    assert (jog.state, jog.ends_as, motor.stops) == ("stopping", "ended", 1)


@with_a_motor
async def test_a_motor_that_comes_to_rest_is_seen_and_not_stopped(motor: Motor) -> None:
    jog = motor.begin()
    motor.rests.set()
    motor.stands.set()
    await asyncio.sleep(0.1)
    assert (jog.state, motor.stops) == ("ended", 0)
    assert motor.told == ["started", "stopping", "ended"]


@with_a_motor
async def test_the_end_of_the_gateway_stops_what_jogs(motor: Motor) -> None:
    jog = motor.begin()
    await motor.close()
    assert (jog.state, jog.ends_as, motor.stops) == ("stopping", "stopped", 1)


@with_a_motor
async def test_jogs_that_are_over_are_remembered_and_the_oldest_forgotten(motor: Motor) -> None:
    motor.stands.set()
    jogs = []
    for _ in range(KEPT + 2):
        jogs.append(motor.begin())
        await motor.end(jogs[-1].id)
    with pytest.raises(NotFound):
        motor.heartbeat(jogs[0].id)
    with pytest.raises(JogOver):
        motor.heartbeat(jogs[-1].id)


def test_the_page_shows_the_table() -> None:
    assert PAGE.read_text("utf-8") == drawing()
