"""The way of a move in one place: queued, prepared, written, followed, judged, recorded."""

import asyncio
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from math import inf
from typing import Any, cast

import pytest

from gateway.core.errors import Expired, GatewayError, NoReply, NotSent
from gateway.core.events import Event
from gateway.core.move_record import LOST_AFTER_S, RESTARTED, Move, MoveStatus
from gateway.core.move_runs import (
    OUT_OF_REACH_S,
    Found,
    Motion,
    MoveRun,
    MoveRuns,
    Silence,
    found,
    in_time,
    write_proved,
)
from gateway.core.next_calls import LINE_STATE, NextCall
from gateway.core.verdicts import MOTOR, AtRest, Told, VerdictWords
from gateway.rorze.errors import refused
from protocols.rorze.moves import MoveClockwise
from tests.gateway.rorze.far_end import virtual


class Line:
    """A line with its times in seconds."""

    reply_timeout_s, late_reply_s = 1.0, 1.0

    @staticmethod
    def shows_silence(_: GatewayError) -> bool:
        return True


@dataclass
class Motor:
    """A motor that moves for some looks, and the errors it meets."""

    looks: int = 3
    asks: list[GatewayError] = field(default_factory=list)
    """Errors of the first preparations."""
    writes: list[GatewayError] = field(default_factory=list)
    """Errors of the first writings, and of the replies."""
    deaf: float = 0.0
    """Number of looks without an answer, at first."""
    move: Move | None = None
    news: list[str] = field(default_factory=list)
    did: list[str] = field(default_factory=list)
    lost: list[str] = field(default_factory=list)

    def claim(self, move: Move) -> None:
        self.move = move

    def release(self) -> None:
        self.move = None


@dataclass
class Seen:
    """The answer of a motor."""

    runs: bool


class MotorRun(MoveRun[Move, Seen]):
    """A move of a motor."""

    controller = "the motor"

    def __init__(self, runs: MoveRuns[Move], motor: Motor, move: Move) -> None:
        super().__init__(runs, move, motor, cast("Any", Line()), "a.00", 1.0)
        self.motor = motor

    def _calls(self, _: GatewayError, /) -> Sequence[NextCall]:
        return [LINE_STATE]

    def _lose(self, why: str, /) -> None:
        self.motor.lost.append(why)

    async def _look(self) -> Seen | None:
        return await self._answer_to(self._told)

    async def _told(self) -> Seen:
        self.motor.did.append("look")
        await asyncio.sleep(0.1)
        if len(self.motor.did) <= self.motor.deaf:
            raise NoReply("Nothing came.")
        self.motor.looks -= 1
        return Seen(self.motor.looks >= 0)

    async def _finding(self, _: Seen, /) -> Found:
        return found(AtRest())

    def _words(self) -> VerdictWords:
        return MOTOR._replace(who=self.who)


class Disproved(NotSent):
    """The motor may have moved since it was asked."""


class MotorMotion(Motion[MotorRun, str]):
    """A command to one motor, or to several."""

    _disproved = (Disproved,)

    async def _prepare(self) -> str:
        for run in self.runs:
            run.motor.did.append("prepare")
            if run.motor.asks:
                raise run.motor.asks.pop(0)
        return "proof"

    async def _write(self, proof: str, expires_at: float) -> Mapping[MotorRun, object]:
        assert (proof, expires_at) == ("proof", asyncio.get_running_loop().time() + 5.0)
        replies: dict[MotorRun, object] = {}
        for run in self.runs:
            run.motor.did.append("write")
            reply: object = run.motor.writes.pop(0) if run.motor.writes else "ack"
            if isinstance(reply, NotSent):
                raise reply
            run.advance(MoveStatus.SENT)
            replies[run] = reply
        return replies


class Motors(MoveRuns[Move]):
    """All moves of motors."""

    def __init__(self) -> None:
        super().__init__(self._told)

    @staticmethod
    def _told(news: str, motor: Motor, _: Move) -> Event:
        motor.news.append(news)
        return Event("epoch", len(motor.news), f"body.move.{news}", "/motor", "{}")

    def run(self, motor: Motor, move_id: str = "m1") -> MotorRun:
        """Make a run that is not begun."""
        now = datetime.now(UTC)
        move = Move(id=move_id, body_id="a.00", kind="relative", command="1+M", frame="", created_at=now)
        return MotorRun(self, motor, move)

    async def start(self, *motors: Motor) -> list[Move]:
        """Start a move of each motor by one command."""
        runs = [self.run(motor, f"m{number}") for number, motor in enumerate(motors, 1)]
        await self._begin(MotorMotion(runs), 5.0)
        return [run.move for run in runs]

    def resume(self, run: MotorRun, *, begun: bool) -> None:
        """Take a move over."""
        self.log.add(run.move)
        self._go_on(run, RESTARTED, begun=begun)


REFUSED = refused("a.00", MoveClockwise(distance=5), 0x51)
SILENT = NoReply("Nothing came.")


# the way of a move


@virtual
async def test_a_move_is_prepared_written_followed_to_rest_and_judged() -> None:
    motors, motor = Motors(), Motor()
    [move] = await motors.start(motor)
    assert (move.status, move.event_cursor) == (MoveStatus.SENT, "epoch-000000000001")
    assert (move.sent_at is not None, move.acknowledged_at is not None) == (True, True)
    assert motors.log.under_way() == [move]
    assert await motors.wait(move.id, 60.0) == move
    assert motor.did == ["prepare", "write", "look", "look", "look", "look"]
    assert motor.news == ["queued", "sent", "started", "succeeded"]
    assert (move.status, move.end_cause, motor.move) == (MoveStatus.SUCCEEDED, "normal", None)
    assert move.ended_at is not None
    assert motors.get("m1") == move


@virtual
async def test_what_is_disproved_is_asked_again_before_it_is_written() -> None:
    motors, motor = Motors(), Motor(writes=[Disproved("It may have moved; nothing was sent.", "Wait.")])
    [move] = await motors.start(motor)
    assert (move.status, motor.did) == (MoveStatus.SENT, ["prepare", "write", "prepare", "write", "look"])
    await motors.close()


@pytest.mark.parametrize(
    ("motor", "status", "did"),
    [
        (Motor(asks=[NotSent("It is away; nothing was sent.", "")]), MoveStatus.CANCELLED, ["prepare"]),
        (Motor(asks=[SILENT]), MoveStatus.CANCELLED, ["prepare"]),
        (Motor(asks=[REFUSED]), MoveStatus.REJECTED, ["prepare"]),
        (Motor(writes=[Expired()]), MoveStatus.CANCELLED, ["prepare", "write"]),
        (Motor(writes=[REFUSED]), MoveStatus.REJECTED, ["prepare", "write"]),
    ],
)
@virtual
async def test_a_move_that_never_began_is_not_followed_and_its_caller_told(
    motor: Motor, status: MoveStatus, did: list[str]
) -> None:
    motors = Motors()
    error = [*motor.asks, *motor.writes][0]
    with pytest.raises(type(error)) as raised:
        await motors.start(motor)
    assert raised.value is error
    move = motors.get("m1")
    assert (move.status, motor.did, motor.move) == (status, did, None)
    assert move.error is not None
    assert (move.error.detail, move.error.next) == (error.detail, [LINE_STATE])


@virtual
async def test_a_move_whose_reply_is_lost_is_taken_and_followed() -> None:
    motors, motor = Motors(), Motor(writes=[SILENT])
    [move] = await motors.start(motor)
    assert (move.status, move.acknowledged_at) == (MoveStatus.SENT, None)
    assert (await motors.wait(move.id, 60.0)).status is MoveStatus.SUCCEEDED


@virtual
async def test_of_several_the_refused_one_ends_and_the_others_go_on() -> None:
    motors, one, other = Motors(), Motor(writes=[REFUSED]), Motor()
    refused, moved = await motors.start(one, other)
    assert (refused.status, moved.status) == (MoveStatus.REJECTED, MoveStatus.SENT)
    assert (await motors.wait(moved.id, 60.0)).status is MoveStatus.SUCCEEDED


@virtual
async def test_several_that_nobody_got_are_refused_as_one() -> None:
    motors, one, other = Motors(), Motor(), Motor(asks=[NotSent("It is away; nothing was sent.", "")])
    with pytest.raises(NotSent, match="It is away"):
        await motors.start(one, other)
    assert {motors.get(move_id).status for move_id in ("m1", "m2")} == {MoveStatus.CANCELLED}


@pytest.mark.parametrize(("silence", "status"), [(3, MoveStatus.SUCCEEDED), (inf, MoveStatus.LOST)])
@virtual
async def test_a_question_is_repeated_until_it_is_answered_or_silence_was_too_long(
    silence: float, status: MoveStatus
) -> None:
    motors, motor = Motors(), Motor(deaf=2 + silence)
    [move] = await motors.start(motor)
    assert (await motors.wait(move.id, 600.0)).status is status
    if status is MoveStatus.LOST:
        assert move.error is not None
        assert move.error.detail.startswith("a.00 stopped answering in the middle of the move")


@pytest.mark.parametrize(("within_s", "told"), [(0.5, Expired), (10.0, Disproved)])
@virtual
async def test_what_comes_too_late_is_not_written_and_the_last_doubt_is_told(
    within_s: float, told: type[NotSent]
) -> None:
    async def write(_: None) -> None:
        raise Disproved("It may have moved; nothing was sent.")

    began = asyncio.get_running_loop().time()
    with pytest.raises(told) as late:
        await write_proved(
            lambda: asyncio.sleep(1.0), write, disproved=(Disproved,), expires_at=began + within_s
        )
    assert type(late.value) is told
    assert asyncio.get_running_loop().time() == began + within_s


@virtual
async def test_what_takes_too_long_is_ended() -> None:
    loop = asyncio.get_running_loop()
    with pytest.raises(Expired, match="The robot was not free"):
        await in_time(loop.time() + 1.0, asyncio.sleep(2.0), "robot")
    assert await in_time(loop.time() + 3.0, asyncio.sleep(2.0, "done")) == "done"


# faults of the gateway itself


def failing(name: str, patch: pytest.MonkeyPatch, owner: type) -> None:
    def fail(*_: object, **__: object) -> None:
        raise ZeroDivisionError

    patch.setattr(owner, name, fail)


@virtual
async def test_after_a_fault_before_it_was_written_a_move_is_given_up_and_its_caller_told() -> None:
    with pytest.MonkeyPatch.context() as patch:
        failing("_prepare", patch, MotorMotion)
        motors, motor = Motors(), Motor()
        with pytest.raises(ZeroDivisionError):
            await motors.start(motor)
        await asyncio.sleep(0)
    why = "A fault of the gateway itself (ZeroDivisionError) has ended its watch over the move."
    assert (motors.get("m1").status, motors.get("m1").evidence) == (MoveStatus.UNKNOWN, [why])
    assert (motor.lost, motor.move) == ([why], None)


@virtual
async def test_a_fault_at_one_of_several_moves_ends_the_watch_over_that_one() -> None:
    motors, one, other = Motors(), Motor(), Motor()
    lost, fine = await motors.start(one, other)
    one.looks = None  # type: ignore[assignment]  # a look at it raises
    assert (await motors.wait(lost.id, 60.0)).status is MoveStatus.UNKNOWN
    assert (await motors.wait(fine.id, 60.0)).status is MoveStatus.SUCCEEDED


@virtual
async def test_a_fault_before_the_first_question_ends_only_moves_that_were_claimed() -> None:
    motors, motor, other = Motors(), Motor(), Motor()
    run, busy = motors.run(motor), motors.run(other, "m2")
    other.move = motors.run(other, "m0").move
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(other, "claim", None)
        with pytest.raises(TypeError):
            await motors._begin(MotorMotion([run, busy]), 5.0)
    assert (run.move.status, busy.move.status) == (MoveStatus.UNKNOWN, MoveStatus.QUEUED)
    assert other.move is not None


@virtual
async def test_a_move_that_is_over_ends_once() -> None:
    motors, motor = Motors(), Motor()
    run = motors.run(motor)
    run.queue()
    run.give_up("A fault.")
    run.give_up("Another.")
    run.end(found(AtRest(Told.STOP)))
    assert (run.move.status, run.move.evidence, motor.news) == (
        MoveStatus.UNKNOWN,
        ["A fault."],
        ["queued", "unknown"],
    )


# the beginning and the end of the gateway


@virtual
async def test_a_beginning_is_waited_for_and_not_the_end() -> None:
    motors = Motors()
    await motors.begun()
    starting = asyncio.create_task(motors.start(Motor(looks=100)))
    await asyncio.sleep(0)
    await motors.begun()
    [move] = await starting
    assert move.status is MoveStatus.SENT
    await motors.close()
    assert move.status is MoveStatus.SENT, "it goes on, and nobody follows it"
    await asyncio.sleep(200.0)
    assert not move.status.final


@virtual
async def test_nobody_waits_for_a_beginning_that_will_not_come() -> None:
    with pytest.MonkeyPatch.context() as patch:

        async def broken_off(_motion: MotorMotion, _within_s: float) -> None:
            return

        patch.setattr(MotorMotion, "make", broken_off)
        with pytest.raises(asyncio.CancelledError):
            await Motors().start(Motor())


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
    motors, motor = Motors(), Motor()
    run = motors.run(motor)
    run.move.status = status
    motors.resume(run, begun=begun)
    assert run.move.status is goes_on
    assert bool(run.move.evidence)
    if not goes_on.final:
        told = f"{RESTARTED.capitalize()} in the middle of the move; the motor was asked."
        assert run.move.evidence[-1] == told
        assert (await motors.wait(run.move.id, 60.0)).status is MoveStatus.SUCCEEDED


# silence


LONGEST_S = 2.7


def test_silence_adds_up_until_the_move_is_lost() -> None:
    silence = Silence(100.0)
    for count in range(1, 13):
        silence.unanswered(100.0 + 2.5 * count, LONGEST_S, silent=True)
        assert silence.of_body is silence.too_long is (2.5 * count >= LOST_AFTER_S)


def test_an_answer_ends_the_silence() -> None:
    silence = Silence(0.0)
    silence.unanswered(2.0, LONGEST_S, silent=True)
    silence.unanswered(3.0, LONGEST_S, silent=False)
    silence.answered(4.0)
    assert (silence.silent_s, silence.out_of_reach_s) == (0.0, 0.0)
    silence.unanswered(5.0, LONGEST_S, silent=True)
    assert silence.silent_s == 1.0


def test_a_question_that_waited_long_for_its_turn_counts_no_longer_than_a_question() -> None:
    silence = Silence(0.0)
    silence.unanswered(1000.0, LONGEST_S, silent=True)
    assert (silence.silent_s, silence.too_long) == (LONGEST_S, False)
    silence.unanswered(5000.0, LONGEST_S, silent=False)
    assert (silence.out_of_reach_s, silence.too_long) == (LONGEST_S, False)


def test_what_could_not_be_asked_for_long_is_not_asked_for_ever() -> None:
    silence = Silence(0.0)
    now = 0.0
    while not silence.too_long:
        now += 0.2
        silence.unanswered(now, LONGEST_S, silent=False)
    assert now == pytest.approx(OUT_OF_REACH_S, abs=0.3)
    assert not silence.of_body
