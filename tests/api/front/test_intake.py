"""The budget of a turn: one connection takes its part of it, all together theirs, and a stop comes first."""

import asyncio
from collections.abc import Coroutine
from typing import Any

from api.front.connections import LINGER_BYTES, ConnectionLimits
from api.front.intake import Frequency, Inlet, Intake
from api.front.turnstile import STOP_PAUSE_S, STOP_TURNS, Turnstile
from tests.virtual_time import run_virtual

LIMITS = ConnectionLimits(piece_bytes=4, connection_s=0.002, turn_s=0.004)
PIECE_S = 0.001


class Clock:
    """Goes on by what is parsed, and with the loop."""

    def __init__(self) -> None:
        self.now = 0.0

    def __call__(self) -> float:
        return self.now + asyncio.get_running_loop().time()


class Connection:
    """Takes a millisecond for each piece."""

    def __init__(self, intake: Intake, clock: Clock, log: list[str], name: str) -> None:
        self.held = False
        self._clock, self._log, self._name = clock, log, name
        self.inlet = Inlet(intake, LIMITS.piece_bytes, self._parse, self._hold)

    def _parse(self, _: bytes) -> None:
        self._clock.now += PIECE_S
        self._log.append(self._name)

    def _hold(self, held: bool) -> None:  # as the inlet calls it
        self.held = held


def story(tell: Any, turn_s: float = 0.0) -> None:
    async def run() -> None:
        clock, turnstile, log = Clock(), Turnstile(), list[str]()
        intake = Intake(LIMITS, turnstile, clock)
        await tell(lambda name: Connection(intake, clock, log, name), log, turnstile)

    coroutine: Coroutine[Any, Any, None] = run()
    run_virtual(coroutine, turn_s=turn_s)


def test_what_is_short_is_parsed_at_once_and_read_on() -> None:
    async def tell(connect: Any, log: list[str], _: Turnstile) -> None:
        one = connect("a")
        one.inlet.take(b"12345678")
        assert log == ["a", "a"]
        assert not one.held

    story(tell)


def test_one_connection_takes_its_part_and_waits_for_the_next_turn_unread() -> None:
    async def tell(connect: Any, log: list[str], _: Turnstile) -> None:
        one = connect("a")
        one.inlet.take(b"x" * 40)
        assert len(log) == LIMITS.connection_s / PIECE_S
        assert one.held
        for turns in (2, 3):
            await asyncio.sleep(0)
            assert len(log) == turns * LIMITS.connection_s / PIECE_S
        await asyncio.sleep(1)
        assert len(log) == 10
        assert not one.held

    story(tell)


def test_however_many_send_all_they_can_a_turn_is_not_longer() -> None:
    async def tell(connect: Any, log: list[str], _: Turnstile) -> None:
        crowd = [connect(f"a{number}") for number in range(100)]
        for one in crowd:
            one.inlet.take(b"x" * 400)
        assert len(log) == LIMITS.turn_s / PIECE_S
        for _turn in range(20):
            before = len(log)
            await asyncio.sleep(0)
            assert len(log) - before <= 2 * LIMITS.turn_s / PIECE_S

    story(tell)


def test_a_request_of_another_is_read_before_those_who_send_all_they_can() -> None:
    async def tell(connect: Any, log: list[str], _: Turnstile) -> None:
        for number in range(100):
            connect(f"a{number}").inlet.take(b"x" * 400)
        for _turn in range(60):
            await asyncio.sleep(0)
        connect("stop").inlet.take(b"stop")
        for _turn in range(2):
            await asyncio.sleep(0)
        assert "stop" in log

    story(tell)


def test_while_a_stop_is_under_way_who_sends_all_he_can_is_parsed_now_and_then() -> None:
    async def tell(connect: Any, log: list[str], turnstile: Turnstile) -> None:
        connect("a").inlet.take(b"x" * 4_000)
        turnstile.begin_stop()
        await asyncio.sleep(10 * STOP_PAUSE_S)
        slow = len(log)
        turnstile.end_stop()
        await asyncio.sleep(10 * STOP_PAUSE_S)
        assert 4 < slow < 40
        assert len(log) == 1_000

    story(tell)


def test_where_other_programs_have_the_processor_he_gives_turns_of_the_loop_to_a_stop() -> None:
    async def tell(connect: Any, log: list[str], turnstile: Turnstile) -> None:
        connect("a").inlet.take(b"x" * 4_000)
        turnstile.begin_stop()
        before = len(log)
        for _ in range(3 * STOP_TURNS):
            await asyncio.sleep(0)
        assert 0 < len(log) - before <= 3 * LIMITS.connection_s / PIECE_S

    story(tell, turn_s=STOP_PAUSE_S)


def test_while_a_stop_is_under_way_a_turn_has_less_for_all_others() -> None:
    async def tell(connect: Any, log: list[str], turnstile: Turnstile) -> None:
        turnstile.begin_stop()
        for number in range(100):
            connect(f"a{number}").inlet.take(b"1234")
        assert len(log) == LIMITS.connection_s / PIECE_S

    story(tell)


def test_what_is_put_back_comes_first_and_what_is_passed_over_not_at_all() -> None:
    async def tell(connect: Any, log: list[str], _: Turnstile) -> None:
        one = connect("a")
        one.inlet.take(b"x" * 40)
        one.inlet.put_back(b"yy")
        assert one.inlet.unread.startswith(b"yyx")
        one.inlet.pass_over()
        before = len(log)
        one.inlet.take(b"z" * LINGER_BYTES)
        await asyncio.sleep(1)
        assert len(log) == before
        one.inlet.take(b"z")
        assert one.held

    story(tell)


def test_a_rate_counts_each_second_anew() -> None:
    now = 0.0
    rate = Frequency(3, lambda: now)
    assert [rate.is_exceeded(1) for _ in range(4)] == [False, False, False, True]
    now = 1.5
    assert not rate.is_exceeded(3)
