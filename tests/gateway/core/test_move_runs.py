"""Moves are seen through in tasks of their own, written down in one place, and given up after a fault."""

import asyncio
from collections.abc import Sequence
from datetime import UTC, datetime
from functools import partial
from math import inf

import pytest

from gateway.core.errors import GatewayError, NoReply, NotSent
from gateway.core.events import Event
from gateway.core.move_record import LOST_AFTER_S, RESTARTED, Move, MoveStatus
from gateway.core.move_runs import OUT_OF_REACH_S, Beginning, GiveUp, MoveRuns, Silence, until_answered
from gateway.core.next_calls import LINE_STATE, NextCall
from gateway.core.verdicts import AtRest, Unbegun, judge
from tests.gateway.rorze.far_end import virtual


class Motor:
    """The maker of moves, one at a time."""

    move: Move | None = None
    news: tuple[str, ...] = ()


class Motors(MoveRuns[Motor, Move]):
    """A family in which nothing but the record happens."""

    def _move_of(self, who: Motor) -> Move | None:
        return who.move

    def _publish(self, news: str, who: Motor, _move: Move, /) -> Event:
        who.news += (news,)
        return Event("epoch", len(who.news), f"body.move.{news}", "/motor", "{}")

    def _calls(self, _who: Motor, _error: GatewayError, /) -> Sequence[NextCall]:
        return [LINE_STATE]

    def _claim(self, who: Motor, move: Move, /) -> None:
        who.move = move

    def _free(self, who: Motor) -> None:
        who.move = None

    async def begin(self, motor: Motor) -> Move:
        """Start a move that nothing is known of but its record."""
        now, taken = datetime.now(UTC), asyncio.get_running_loop().create_future()
        taken.set_result(None)
        move = Move(id="m1", body_id="a.00", kind="relative", command="1+M", frame="", created_at=now)
        assert await self._start([(motor, move)], partial(asyncio.sleep, 0.0), taken) is None
        await self.close()
        return move

    def follow(self, run: "Run", give_up: GiveUp) -> None:
        """See a run through."""
        self._see_through("m1", run.seen_through, run.beginning, give_up)

    def lose(self, motor: Motor, move: Move) -> None:
        """Give a move up."""
        self._give_up([(motor, move)], "A fault.")

    def resume(self, motor: Motor, move: Move, *, begun: bool) -> bool:
        """Take a move over."""
        return self._take_over(motor, move, begun=begun, asked="the motor", since=RESTARTED)


class Run:
    """A move that begins after a second and ends after two."""

    def __init__(self) -> None:
        self.beginning: Beginning = asyncio.get_running_loop().create_future()
        self.over = False

    async def seen_through(self) -> None:
        await asyncio.sleep(1.0)
        self.beginning.set_result(None)
        await asyncio.sleep(1.0)
        self.over = True


def nobody(why: str) -> None:
    pytest.fail(why)


@virtual
async def test_after_a_fault_of_the_gateway_itself_a_move_is_given_up_and_its_caller_told() -> None:
    class Faulty(Run):
        async def seen_through(self) -> None:
            raise ZeroDivisionError

    told: list[str] = []
    runs, run = Motors(), Faulty()
    runs.follow(run, told.append)
    with pytest.raises(ZeroDivisionError):
        await run.beginning
    await asyncio.sleep(0)
    assert told == ["A fault of the gateway itself (ZeroDivisionError) has ended its watch over the move."]


@virtual
async def test_a_beginning_is_waited_for_and_not_the_end() -> None:
    runs, run = Motors(), Run()
    await runs.begun()
    runs.follow(run, nobody)
    await runs.begun()
    assert run.beginning.done()
    assert not run.over
    await asyncio.sleep(1.0)
    assert run.over


@virtual
async def test_at_the_close_a_move_still_begins_and_is_followed_no_more() -> None:
    runs, run = Motors(), Run()
    runs.follow(run, nobody)
    await runs.close()
    assert run.beginning.done()
    await asyncio.sleep(2.0)
    assert not run.over


@virtual
async def test_nobody_waits_for_a_beginning_that_will_not_come() -> None:
    class BrokenOff(Run):
        async def seen_through(self) -> None:
            return

    runs, run = Motors(), BrokenOff()
    runs.follow(run, nobody)
    with pytest.raises(asyncio.CancelledError):
        await run.beginning


@virtual
async def test_a_move_is_written_down_from_its_queue_to_its_end() -> None:
    runs, motor = Motors(), Motor()
    move = await runs.begin(motor)
    assert (move.event_cursor, runs.log.under_way()) == ("epoch-000000000001", [move])
    waiting = asyncio.create_task(runs.wait("m1", 9.0))
    for status in (MoveStatus.SENT, MoveStatus.MOVING):
        runs.advance(motor, move, status)
    assert move.sent_at is not None
    assert runs.log.under_way() == [move]
    runs.end(motor, move, judge(AtRest()))
    assert await waiting == move
    assert (move.status, move.end_cause, motor.move) == (MoveStatus.SUCCEEDED, "normal", None)
    assert move.ended_at is not None
    assert motor.news == ("queued", "sent", "started", "succeeded")
    assert runs.get("m1") == move


@virtual
async def test_the_error_of_a_move_names_the_calls_that_help() -> None:
    runs, motor = Motors(), Motor()
    move = await runs.begin(motor)
    runs.end(motor, move, judge(Unbegun.WITHHELD, given=NoReply("a.00 did not answer.")))
    assert move.error is not None
    assert (move.status, move.error.next) == (MoveStatus.CANCELLED, [LINE_STATE])


@virtual
async def test_a_move_that_is_over_is_not_given_up() -> None:
    runs, motor = Motors(), Motor()
    move = await runs.begin(motor)
    runs.lose(motor, move)
    assert (move.status, move.evidence) == (MoveStatus.UNKNOWN, ["A fault."])
    runs.lose(motor, move)
    assert move.evidence == ["A fault."]


@pytest.mark.parametrize(
    ("status", "begun", "goes_on"),
    [
        (MoveStatus.QUEUED, False, MoveStatus.CANCELLED),
        (MoveStatus.QUEUED, True, MoveStatus.SENT),
        (MoveStatus.SENT, True, MoveStatus.SENT),
        (MoveStatus.MOVING, True, MoveStatus.MOVING),
    ],
)
@virtual
async def test_after_a_restart_a_move_goes_on_unless_it_was_never_written(
    status: MoveStatus, begun: bool, goes_on: MoveStatus
) -> None:
    runs, motor = Motors(), Motor()
    move = await runs.begin(motor)
    move.status = status
    assert runs.resume(motor, move, begun=begun) is (not goes_on.final)
    assert move.status is goes_on
    assert bool(move.evidence)


@pytest.mark.parametrize("news", [("queued", "sent", "started"), ("queued", "sent")])
@virtual
async def test_a_move_that_was_seen_to_run_is_told_to_have_started_once(news: tuple[str, ...]) -> None:
    motors, motor = Motors(), Motor()
    move = await motors.begin(motor)
    assert not motors.seen_to_move(motor, move), "its command is not on the wire"
    motors.advance(motor, move, MoveStatus.SENT)
    seen = [motors.seen_to_move(motor, move) for _ in news[2:] * 2]
    assert seen == [True, False][: len(seen)]
    assert motor.news == news
    assert (move.acknowledged_at is not None) is bool(seen)


@pytest.mark.parametrize("refused", [True, False])
@virtual
async def test_a_move_that_never_began_was_refused_or_not_written(refused: bool) -> None:
    motors, motor = Motors(), Motor()
    move = await motors.begin(motor)
    motors.unbegun(motor, move, NotSent("The line is down; nothing was sent."), refused=refused)
    assert move.status is (MoveStatus.REJECTED if refused else MoveStatus.CANCELLED)
    assert (move.error and move.error.detail) == "The line is down; nothing was sent."
    assert motor.move is None


class Sleeper:
    """A motor that answers after some questions, or never."""

    def __init__(self, answers_after: float) -> None:
        self.asked = 0
        self._answers_after = answers_after

    async def ask(self) -> str:
        self.asked += 1
        if self.asked <= self._answers_after:
            raise NoReply("Nothing came.")
        return "stands"


@virtual
async def test_the_question_that_follows_a_move_is_repeated_until_it_is_answered() -> None:
    sleeper, silence = Sleeper(3), Silence(asyncio.get_running_loop().time(), 5.0)
    answer = await until_answered(sleeper.ask, silence, shows_silence=lambda _: True, pause_s=1.0)
    assert (answer, sleeper.asked, silence.silent_s) == ("stands", 4, 0.0)


@pytest.mark.parametrize("shows_silence", [True, False])
@virtual
async def test_after_silence_for_too_long_a_move_is_followed_no_more(shows_silence: bool) -> None:
    loop = asyncio.get_running_loop()
    sleeper, silence = Sleeper(inf), Silence(loop.time(), 5.0)
    answer = await until_answered(sleeper.ask, silence, shows_silence=lambda _: shows_silence, pause_s=1.0)
    assert answer is None
    assert silence.too_long
    assert silence.of_body is shows_silence


@virtual
async def test_a_family_may_give_up_sooner() -> None:
    sleeper, silence = Sleeper(inf), Silence(asyncio.get_running_loop().time(), 5.0)
    answer = await until_answered(
        sleeper.ask, silence, shows_silence=lambda _: True, pause_s=1.0, gives_up=lambda: sleeper.asked == 2
    )
    assert (answer, sleeper.asked) == (None, 2)


LONGEST_S = 2.7


def test_silence_adds_up_until_the_move_is_lost() -> None:
    silence = Silence(100.0, LONGEST_S)
    for count in range(1, 13):
        silence.unanswered(100.0 + 2.5 * count, silent=True)
        assert silence.of_body is silence.too_long is (2.5 * count >= LOST_AFTER_S)


def test_an_answer_ends_the_silence() -> None:
    silence = Silence(0.0, LONGEST_S)
    silence.unanswered(2.0, silent=True)
    silence.unanswered(3.0, silent=False)
    silence.answered(4.0)
    assert (silence.silent_s, silence.out_of_reach_s) == (0.0, 0.0)
    silence.unanswered(5.0, silent=True)
    assert silence.silent_s == 1.0


def test_a_question_that_waited_long_for_its_turn_counts_no_longer_than_a_question() -> None:
    silence = Silence(0.0, LONGEST_S)
    silence.unanswered(1000.0, silent=True)
    assert (silence.silent_s, silence.too_long) == (LONGEST_S, False)
    silence.unanswered(5000.0, silent=False)
    assert (silence.out_of_reach_s, silence.too_long) == (LONGEST_S, False)


def test_what_could_not_be_asked_for_long_is_not_asked_for_ever() -> None:
    silence = Silence(0.0, LONGEST_S)
    now = 0.0
    while not silence.too_long:
        now += 0.2
        silence.unanswered(now, silent=False)
    assert now == pytest.approx(OUT_OF_REACH_S, abs=0.3)
    assert not silence.of_body
