"""The next frame on a line and the exchange that a reply belongs to, without a port and without a clock."""

import asyncio
from collections import deque
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from random import Random
from typing import Any, NamedTuple

import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule
from pydantic import ValidationError

from gateway.core.errors import BodyOffline, Cancelled, Expired, GarbledReply, HeldUp, NoReply
from gateway.core.exchange import Lane
from gateway.core.fence import FENCE_TRIES
from gateway.rorze.line import lane_of
from gateway.rorze.session import (
    CLEAN_AFTER_S,
    NONCES,
    READ_REPEATS,
    REPLIES_REMEMBERED,
    STRICT_S,
    Answered,
    Outcome,
    ReplyFrame,
    RorzeExchange,
    RorzeSession,
)
from protocols.rorze import commands as table
from protocols.rorze.flash import SaveSettings
from protocols.rorze.link import POISON, Answer, GroupAnswer, Refusal
from protocols.rorze.link_master import IdentifyControllers, SetGroup, SetReplyFormat
from protocols.rorze.moves import MoveClockwise, MoveTo
from protocols.rorze.notation import PositionReference
from protocols.rorze.position import GetPosition, SignedPulses
from protocols.rorze.position_table import GetNumberedPositionEntry, GetPositionEntry
from protocols.rorze.programs import GetProgramMemory
from protocols.rorze.row import LINK_MASTER, RorzeCommand
from protocols.rorze.speeds import SetStartSpeed
from protocols.rorze.status import GetControllerStatus, SetUserComment
from protocols.rorze.stops import StopImmediately
from protocols.table import WireFault
from tests.gateway.rorze.exchanges import waiting
from tests.virtual_time import VirtualLoop

MOVE = MoveClockwise(distance=500)
READ = GetPosition()
STOP = StopImmediately()
LOST, UNSENT = NoReply("The port has gone."), Cancelled("The port has gone.")

Future = asyncio.Future[Outcome]


def entry(position: int) -> GetPositionEntry:
    return GetPositionEntry(entry=PositionReference(position=position))


def answer_to(exchange: RorzeExchange, pulses: int = 0) -> Answer:
    """The reply of a controller without a fault."""
    command = exchange.command
    payload = ""
    if isinstance(command, GetNumberedPositionEntry):
        payload = f"P[{command.entry.position:04d}],+000000000"
    elif isinstance(command, GetPosition):
        payload = f"{pulses:+010d}"
    return Answer(exchange.target, command.code, payload)


@dataclass
class Bench:
    """A session, its waiters, and a clock turned by hand."""

    session: RorzeSession
    loop: asyncio.AbstractEventLoop
    now: float = 0.0

    def ask(
        self,
        command: RorzeCommand[Any],
        body: int = 2,
        expires_at: float | None = None,
        lane: Lane | None = None,
    ) -> Future:
        exchange = self.session.exchange(body, command, lane_of(command) if lane is None else lane)
        exchange.expires_at = expires_at
        future = waiting(exchange, self.loop)
        self.session.scheduler.submit(exchange)
        return future

    def set_up(self, command: RorzeCommand[Any]) -> Future:
        exchange = self.session.exchange(LINK_MASTER, command, Lane.COMMAND)
        future = waiting(exchange, self.loop)
        self.session.put_first(exchange)
        return future

    def next(self, *, ready: bool = True) -> str:
        """Write what may go: its body and code, or nothing."""
        exchange = self.session.next(self.now, ready=ready)
        if exchange is None:
            return ""
        self.session.written(exchange, self.now, self.now + exchange.reply.timeout_s)
        self.last = exchange
        fence = "fence " if exchange.reply.self_identifying else ""
        return f"{fence}{exchange.target:02X} {exchange.command.code}"

    def hear(self, frame: ReplyFrame) -> bool:
        """Take a reply; say whether it was credited."""
        tell = self.session.receive(frame, self.now)
        if tell is not None:
            tell()
        return tell is not None

    def answer(self, pulses: int = 0) -> None:
        """Answer what was written last."""
        assert self.hear(answer_to(self.last, pulses))

    def fall_silent(self) -> None:
        """Let the reply to what was written last stay away."""
        self.now += self.last.reply.timeout_s
        self.session.pass_deadlines(self.now, None)


@pytest.fixture
def it() -> Iterator[Bench]:
    loop = VirtualLoop()
    yield Bench(RorzeSession([2, 3, 4, 5], rng=Random(1)), loop)
    loop.close()


# what goes next


def test_before_the_line_is_ready_only_its_own_set_up_and_stops_go(it: Bench) -> None:
    it.ask(READ)
    it.set_up(IdentifyControllers())
    it.ask(STOP)
    assert it.next(ready=False) == "02 5IS"
    it.answer()
    assert it.next(ready=False) == "7F XID"
    it.hear(Answer(LINK_MASTER, "XID", "02"))
    assert it.next(ready=False) == ""
    assert it.next(ready=True) == "02 6PD"


def test_while_something_waits_for_its_reply_nothing_is_there_to_do_but_stops(it: Bench) -> None:
    it.ask(MOVE)
    it.next()
    it.ask(READ, 3)
    assert not it.session.has_something()
    it.ask(STOP, 3)
    assert it.session.has_something()
    assert it.next() == "03 5IS"
    assert it.next() == ""


def test_the_next_frame_can_be_written_before_anybody_is_told(it: Bench) -> None:
    first = it.ask(READ)
    it.ask(READ, 3)
    it.next()
    tell = it.session.receive(answer_to(it.last, 7), it.now)
    assert tell is not None
    assert it.next() == "03 6PD"
    assert not first.done()
    tell()
    assert first.result() == Answered({2: SignedPulses(pulses=7)}, it.now)


def test_what_is_refused_at_the_gate_makes_way_for_the_next(it: Bench) -> None:
    late = it.ask(MoveTo(position=1), expires_at=1.0)
    it.ask(MoveTo(position=2))
    it.now = 1.0
    assert it.next() == "02 1AM"
    assert isinstance(late.result(), Expired)
    assert it.last.command == MoveTo(position=2)


def test_no_fence_is_spent_on_an_equal_command_that_is_too_late(it: Bench) -> None:
    it.ask(MOVE)
    it.next()
    it.answer()
    late = it.ask(MOVE, expires_at=1.0)
    it.now = 1.0
    assert it.next() == ""
    assert isinstance(late.result(), Expired)
    assert it.session.in_step


def test_a_command_that_takes_time_gets_twice_as_much(it: Bench) -> None:
    it.ask(SaveSettings())
    it.next()
    assert it.last.reply.timeout_s == it.session.terms.reply_timeout_s + 2 * SaveSettings.takes_s


@pytest.mark.parametrize("introducer", ["&", "$", "#"])
def test_what_follows_an_unanswered_comment_ends_it_first_where_it_could_be_a_part_of_it(
    introducer: str,
) -> None:
    loop = VirtualLoop()
    bench = Bench(RorzeSession([2, 3], rng=Random(1), introducer=introducer), loop)
    bench.ask(SetUserComment(comment_number=2, text="cost $5"))
    end = b"" if introducer == "&" else POISON
    assert bench.next() == "02 9VS"
    bench.ask(STOP)
    assert bench.next() == "02 5IS"
    assert bench.last.frame == end + bench.session.frame_of(2, STOP)
    bench.answer()
    bench.fall_silent()
    assert bench.next() == "fence 02 3ND"
    assert bench.last.frame.startswith(end + introducer.encode())
    bench.answer()
    bench.ask(READ)
    assert bench.next() == "02 6PD"
    assert bench.last.frame == bench.session.frame_of(2, READ)
    loop.close()


def test_the_numbers_of_fences_take_turns_through_all_there_are(it: Bench) -> None:
    numbers = [it.session.self_identifying_read(2).frame for _ in range(NONCES + 1)]
    assert len(set(numbers)) == NONCES
    assert numbers[-1] == numbers[0]


# overdue


def test_a_reply_that_has_begun_is_waited_for_but_no_longer_than_a_late_one(it: Bench) -> None:
    future = it.ask(MOVE)
    it.now = 1.0
    it.next()
    given_up_at = it.now + it.session.terms.reply_timeout_s + it.session.terms.late_reply_s
    it.session.pass_deadlines(1.5, 1.6)
    assert it.session.deadline() == 1.6
    it.session.pass_deadlines(1.6, 100.0)
    assert it.session.deadline() == given_up_at
    it.session.pass_deadlines(given_up_at, 100.0)
    assert it.session.deadline() is None
    assert not it.session.in_step
    assert not future.done()  # the fence may bring it yet


def test_only_what_is_overdue_is_given_up(it: Bench) -> None:
    it.ask(MOVE)
    it.next()
    it.now = 0.3
    stop = it.ask(STOP, 3)
    it.next()
    it.now = 0.5
    it.session.pass_deadlines(it.now, None)
    assert not it.session.in_step
    assert not stop.done()
    assert it.session.deadline() == pytest.approx(0.8)


def test_a_fence_waits_until_the_stops_are_answered(it: Bench) -> None:
    it.ask(MOVE)
    it.next()
    it.now = 0.3
    it.ask(STOP, 3)
    it.next()
    it.now = 0.5
    it.session.pass_deadlines(it.now, None)
    assert it.next() == ""
    it.answer()
    assert it.next() == "fence 02 3ND"


# fences


def test_a_fence_is_passed_by_its_own_number_only(it: Bench) -> None:
    move = it.ask(MOVE)
    it.next()
    it.fall_silent()
    it.next()
    other = it.session.self_identifying_read(2)
    assert not it.hear(answer_to(other))
    assert not it.session.in_step
    it.answer()
    assert it.session.in_step
    assert isinstance(move.result(), NoReply)


def test_the_witness_for_a_silent_body_is_the_one_heard_last(it: Bench) -> None:
    for body in (5, 4, 3):
        it.ask(READ, body)
        it.next()
        it.answer()
    it.session.offline.add(3)
    it.ask(READ, 2)
    it.next()
    it.fall_silent()
    for _ in range(FENCE_TRIES):
        assert it.next() == "fence 02 3ND"
        it.fall_silent()
    assert it.next() == "fence 04 3ND"
    it.answer()
    assert it.session.offline == {2, 3}
    assert it.session.in_step


def test_a_witness_from_the_same_fuse_is_followed_by_another(it: Bench) -> None:
    for body in (4, 5, 3):
        it.ask(READ, body)
        it.next()
        it.answer()
    it.ask(READ, 2)
    it.next()
    for _ in range(1 + 2 * FENCE_TRIES):
        it.fall_silent()
        it.next()
    it.answer()
    assert it.session.offline == {2, 3}


@pytest.mark.parametrize(("offline", "proof"), [((), 3), ((3,), 4), ((3, 4), 2)])
def test_a_group_is_stood_for_by_the_first_member_that_answers_or_else_by_another_body(
    it: Bench, offline: tuple[int, ...], proof: int
) -> None:
    it.session.groups[0x80] = [3, 4]
    it.session.offline.update(offline)
    it.ask(GetControllerStatus(), 0x80)
    it.next()
    it.fall_silent()
    assert it.next() == f"fence {proof:02X} 3ND"


def test_a_read_nobody_waits_for_any_more_is_not_repeated(it: Bench) -> None:
    read = it.ask(READ)
    it.next()
    it.fall_silent()
    read.cancel()
    it.next()
    it.answer()
    assert it.next() == ""
    assert it.session.counters["repeats"] == 0


def test_a_repeated_read_goes_before_its_bodys_others(it: Bench) -> None:
    first, second = it.ask(READ), it.ask(GetControllerStatus())
    it.next()
    it.fall_silent()
    it.next()
    it.answer()
    assert it.next() == "02 6PD"
    it.answer(5)
    assert first.done()
    assert not second.done()


def test_the_set_up_is_repeated_as_often_as_a_read_and_ahead_of_the_rest_of_it(it: Bench) -> None:
    told = it.set_up(IdentifyControllers())
    it.set_up(SetReplyFormat(end_of_move=1))
    for _ in range(1 + READ_REPEATS):
        assert it.next() == "7F XID"
        it.fall_silent()
        assert it.next() == "fence 02 3ND"
        it.answer()
    assert isinstance(told.result(), NoReply)
    assert it.next() == "7F XRS"


def test_a_read_with_a_number_of_its_own_leaves_the_line_in_step(it: Bench) -> None:
    probe = it.session.self_identifying_read(2)
    future = waiting(probe, it.loop)
    it.session.scheduler.submit(probe)
    it.next()
    it.session.noise("noise", it.now)
    assert not future.done()
    it.fall_silent()
    assert isinstance(future.result(), NoReply)
    assert it.session.in_step


# silence


def test_after_three_silent_bodies_nobody_else_is_asked_and_the_others_are_not_blamed(it: Bench) -> None:
    offline: list[tuple[int, bool]] = []
    it.session.presence.on_offline = lambda body, asked: offline.append((body, asked))
    asked = [it.ask(READ, body) for body in it.session.bodies]
    it.next()
    fences = []
    it.fall_silent()
    while written := it.next():
        fences.append(written)
        it.fall_silent()
    assert fences == [f"fence {body:02X} 3ND" for body in (2, 3, 4) for _ in range(FENCE_TRIES)]
    assert offline == [(2, True), (3, True), (4, True), (5, False)]
    assert isinstance(asked[0].result(), NoReply)
    assert {type(future.result()) for future in asked[1:]} == {BodyOffline}


def told_silent(it: Bench) -> list[int]:
    """The bodies that are told to be silent, from now on."""
    told: list[int] = []
    it.session.presence.on_offline = lambda body, _asked: told.append(body)
    return told


def test_on_a_clean_line_a_question_and_a_fence_without_an_answer_tell_of_a_silent_body(it: Bench) -> None:
    told = told_silent(it)
    it.ask(READ)
    it.next()
    it.fall_silent()
    assert it.next() == "fence 02 3ND"
    assert told == []
    it.fall_silent()
    assert (told, it.session.presence.silent, it.session.offline) == ([2], {2}, set())
    for _ in range(FENCE_TRIES - 1):
        assert it.next() == "fence 02 3ND"
        it.fall_silent()
    assert (told, it.session.offline) == ([2], {2})


@pytest.mark.parametrize("answers", [True, False])
def test_a_body_that_was_told_silent_is_told_back_or_probed(it: Bench, answers: bool) -> None:
    back: list[int] = []
    it.session.presence.on_online = back.append
    it.ask(READ)
    for _ in range(2):
        it.next()
        it.fall_silent()
    assert it.next() == "fence 02 3ND"
    if answers:
        it.answer()
        assert (back, it.session.presence.silent) == ([2], set())
    else:  # the port goes, and nobody finds out
        it.session.break_off(LOST, UNSENT)
        assert (back, it.session.offline) == ([], {2})


def test_members_that_tell_something_in_the_reply_of_their_group_are_back(it: Bench) -> None:
    back: list[int] = []
    it.session.presence.on_online = back.append
    it.session.groups[0x80] = [3, 4]
    it.session.offline.update((3, 4))
    it.ask(GetControllerStatus(), 0x80)
    it.next()
    assert it.hear(GroupAnswer(0x80, "9CD", {3: Answer(3, "9CD", "H00"), 4: Refusal(4, "9CD", 0x4C)}))
    assert (back, it.session.offline) == ([3], {4})


@pytest.mark.parametrize(("pause_s", "early"), [(CLEAN_AFTER_S - 3.0, False), (CLEAN_AFTER_S + 1.0, True)])
def test_on_a_line_that_erred_lately_three_fences_tell_of_a_silent_body(
    it: Bench, pause_s: float, early: bool
) -> None:
    told = told_silent(it)
    it.session.noise("noise", it.now)
    it.now += pause_s
    it.ask(READ)
    for _ in range(2):
        it.next()
        it.fall_silent()
    assert (told == [2]) is early


def test_a_witness_for_others_is_not_told_silent_by_a_single_question(it: Bench) -> None:
    told = told_silent(it)
    it.set_up(IdentifyControllers())
    for _ in range(2):
        it.next()
        it.fall_silent()
    assert told == []


def test_a_noise_is_no_silence(it: Bench) -> None:
    it.ask(MOVE)
    it.next()
    it.fall_silent()
    fenced = []
    while written := it.next():
        fenced.append(written)
        it.session.noise("noise", it.now)
        it.fall_silent()
    assert list(dict.fromkeys(fenced)) == [f"fence {body:02X} 3ND" for body in (2, 3, 4, 5)]


def test_nobody_waits_for_what_a_silent_body_answers_to_a_stop(it: Bench) -> None:
    it.session.offline.add(2)
    stop = it.ask(STOP)
    it.ask(READ, 3)
    assert it.next() == "02 5IS"
    assert it.next() == "03 6PD"
    it.answer()
    assert it.hear(Answer(2, "5IS", ""))
    assert isinstance(stop.result(), Answered)
    assert not it.session.offline


def test_a_link_that_takes_one_frame_at_a_time_waits_for_a_silent_body_too(it: Bench) -> None:
    it.session.terms = it.session.terms._replace(interject_stops=False)
    it.session.offline.add(2)
    it.ask(STOP)
    it.ask(READ, 3)
    assert it.next() == "02 5IS"
    assert it.next() == ""
    it.fall_silent()
    assert it.next() == "03 6PD"


def test_equal_stops_of_a_silent_body_are_not_under_way_twice(it: Bench) -> None:
    it.session.offline.add(2)
    it.ask(STOP)
    it.next()
    it.ask(STOP)
    assert it.next() == ""
    it.fall_silent()
    assert it.next() == "02 5IS"


def test_stops_of_bodies_that_may_be_dead_leave_fences_their_turn(it: Bench) -> None:
    read = it.ask(READ, 5)
    it.next()
    it.ask(STOP, 2, lane=Lane.STOP_REPEAT)
    it.ask(STOP, 3, lane=Lane.STOP_REPEAT)
    assert it.next() == "02 5IS", "the reply is waited for, so stops may go"
    it.now += 0.1
    it.hear(Answer(2, "5IS", ""))
    it.now += 0.4
    it.session.pass_deadlines(it.now, None)
    assert it.next() == "fence 05 3ND"
    assert it.next() == "03 5IS"
    assert not read.done()


def test_a_stop_that_may_be_in_vain_does_not_follow_another_at_once(it: Bench) -> None:
    it.ask(STOP, 2, lane=Lane.STOP_REPEAT)
    assert it.next() == "02 5IS"
    it.ask(STOP, 3, lane=Lane.STOP_REPEAT)
    assert it.next() == ""
    it.ask(STOP, 4)
    assert it.next() == "04 5IS", "a new one does"


def stop_in_vain(it: Bench, body: int = 2) -> None:
    """A stop is not answered."""
    it.ask(STOP, body)
    it.next()
    it.fall_silent()


@pytest.mark.parametrize("lane", [Lane.VERIFY, Lane.READ, Lane.BACKGROUND, Lane.COMMAND])
def test_who_does_not_answer_a_stop_is_asked_behind_those_who_prove_theirs(it: Bench, lane: Lane) -> None:
    stop_in_vain(it)
    prove = [3]
    it.session.others_prove = lambda body: body not in prove
    it.ask(MOVE if lane is Lane.COMMAND else READ, 2, lane=lane)
    assert it.next() == ""
    it.ask(READ, 3, lane=Lane.BACKGROUND)
    assert it.next() == "03 6PD"
    it.answer()
    it.ask(STOP, 2)
    assert it.next() == "02 5IS", "stops go on"
    it.hear(Answer(2, "5IS", ""))
    assert it.next().startswith("02"), "it answers, and is asked as any other"


def test_who_does_not_answer_a_stop_is_asked_when_nobody_proves_his_any_more(it: Bench) -> None:
    stop_in_vain(it)
    it.session.others_prove = lambda _: True
    it.ask(READ, 2)
    assert it.next() == ""
    it.session.others_prove = lambda _: False
    assert it.next() == "02 6PD"


def test_nobody_waits_twice_for_the_reply_to_a_stop_that_is_repeated_in_vain(it: Bench) -> None:
    it.ask(STOP, 2)
    it.next()
    it.ask(READ, 3)
    assert it.next() == ""
    it.fall_silent()
    it.ask(STOP, 2)
    assert it.next() == "02 5IS"
    assert it.next() == "03 6PD"


def test_a_member_that_tells_something_in_the_reply_of_its_group_is_asked_as_any_other(it: Bench) -> None:
    stop_in_vain(it)
    it.session.groups[0x80] = [2, 3]
    it.ask(GetControllerStatus(), 0x80)
    it.next()
    it.hear(GroupAnswer(0x80, "9CD", {2: Answer(2, "9CD", "H00"), 3: Answer(3, "9CD", "H00")}))
    assert it.session.presence.mute == set()


@pytest.mark.parametrize("others_prove", [True, False])
def test_while_others_prove_their_stops_one_fence_in_vain_is_enough(it: Bench, others_prove: bool) -> None:
    it.session.others_prove = lambda _: others_prove
    it.ask(READ, 3)
    it.next()
    it.answer()
    read = it.ask(READ, 2)
    it.next()
    it.fall_silent()
    assert it.next() == "fence 02 3ND"
    it.fall_silent()
    assert it.next() == ("fence 03 3ND" if others_prove else "fence 02 3ND")
    assert it.session.offline == ({2} if others_prove else set())
    assert not read.done()
    if others_prove:
        it.answer()
        assert isinstance(read.result(), NoReply)


def test_who_does_not_answer_a_stop_is_the_last_to_witness_anything(it: Bench) -> None:
    for body in (3, 4, 5):
        it.ask(READ, body)
        it.next()
        it.answer()
        it.now += 0.1
    stop_in_vain(it, 5)
    assert it.session.presence.latest_first([3, 4, 5]) == [4, 3, 5]


def test_one_body_that_answers_no_stop_makes_no_bad_line(it: Bench) -> None:
    told = told_silent(it)
    stop_in_vain(it)
    stop_in_vain(it)
    it.ask(READ)
    it.next()
    for _ in range(2):
        it.fall_silent()
        it.next()
    assert told == [2]


def test_stops_and_probes_for_a_silent_body_stay_in_the_queue(it: Bench) -> None:
    it.ask(MOVE)
    it.next()
    it.fall_silent()
    probe = it.session.self_identifying_read(2)
    waiting(probe, it.loop)
    it.session.scheduler.submit(probe)
    for _ in range(FENCE_TRIES):
        it.next()
        it.fall_silent()
    assert it.session.offline == {2}
    it.next()  # the fence of the next body
    it.answer()
    assert it.next() == "fence 02 3ND"
    assert it.last is probe


# strays


def test_a_copy_of_a_reply_ends_no_equal_command(it: Bench) -> None:
    it.ask(MOVE)
    it.next()
    it.answer()
    copy, second = answer_to(it.last), it.ask(MOVE)
    assert it.next() == "fence 02 3ND"
    assert not it.hear(copy)
    it.answer()
    assert it.next() == "02 1+M"
    assert not second.done()
    it.answer()
    assert it.next() == "fence 02 3ND", "replies come twice here: this may not be the last"
    it.answer()
    assert isinstance(second.result(), Answered)


def test_a_copy_is_told_from_a_reply_to_nothing(it: Bench) -> None:
    it.ask(MOVE)
    it.next()
    it.answer()
    assert not it.hear(answer_to(it.last))
    assert not it.hear(Answer(3, "1+M", ""))
    assert (it.session.counters["duplicates"], it.session.counters["strays"]) == (1, 1)
    assert it.session.in_step


def test_late_replies_that_contradict_each_other_leave_a_doubt(it: Bench) -> None:
    move = it.ask(MOVE)
    it.next()
    it.fall_silent()
    it.next()
    fence = it.last
    assert not it.hear(Answer(2, "1+M", ""))
    assert not it.hear(Refusal(2, "1+M", 0x50))
    assert it.hear(answer_to(fence))
    outcome = move.result()
    assert isinstance(outcome, GarbledReply)
    assert outcome.detail == "1+M was sent to body 02, and replies that contradict each other came back."
    assert outcome.moved == "unknown"
    assert (it.session.counters["late_replies"], it.session.counters["strays"]) == (1, 1)


def test_of_late_replies_of_one_kind_the_last_counts(it: Bench) -> None:
    read = it.ask(READ)
    it.next()
    it.fall_silent()
    it.next()
    fence = it.last
    for pulses in (1, 2):
        assert not it.hear(Answer(2, "6PD", f"{pulses:+010d}"))
    assert it.hear(answer_to(fence))
    assert read.result() == Answered({2: SignedPulses(pulses=2)}, it.now, late=True)


# copies of replies


def commands_of(row: type[RorzeCommand[Any]]) -> dict[str, RorzeCommand[Any]]:
    """The commands of the manual's examples and their neighbours, by what is written."""
    asked = [row.read(command[3:].removeprefix(row.code)) for command in row.example[::2]]
    for command in asked[:]:
        for name, value in dict(command).items():
            for other in (value - 1, value + 1) if isinstance(value, int) else ():
                with suppress(ValidationError):
                    asked.append(row(**{**dict(command), name: other}))
    return {command.written(): command for command in asked}


def understands(command: RorzeCommand[Any], payload: str) -> bool:
    try:
        command.read_reply(payload)
    except WireFault:
        return False
    return True


@pytest.mark.parametrize("row", table.COMMANDS.values(), ids=lambda row: row.code)
def test_no_copy_of_a_reply_answers_another_command_of_its_code(
    row: type[RorzeCommand[Any]], it: Bench
) -> None:
    if lane_of(row.read(row.example[0][3:].removeprefix(row.code))) is Lane.STOP:
        return  # a stop waits for no fence, and is repeated until standstill is proved
    payload = row.example[1][4:].removeprefix(row.code)
    asked, *others = commands_of(row).values()
    for other in (asked, *others):
        harmless = other == asked and asked.may_repeat
        it.session = RorzeSession([2, 3, 4, 5], rng=Random(1))
        it.ask(asked)
        it.next()
        copy = Answer(2, row.code, payload)
        assert it.hear(copy)
        it.ask(READ, 3)
        it.next()
        it.answer()
        future = it.ask(other)
        if understands(other, payload) and not harmless:
            assert it.next() == "fence 02 3ND", other
            assert not it.hear(copy)
            it.answer()
            assert not future.done()
        assert it.next() == f"02 {row.code}", "a fence costs time"


def test_a_copy_of_a_refusal_answers_no_other_question(it: Bench) -> None:
    it.ask(entry(1))
    it.next()
    refusal = Refusal(2, "3PD", 0x4A)
    assert it.hear(refusal)
    it.ask(entry(1))
    assert it.next() == "02 3PD", "the same question has the same answer"
    it.hear(refusal)
    it.ask(entry(2))
    assert it.next() == "fence 02 3ND"


def test_what_another_body_or_another_code_has_answered_needs_no_fence(it: Bench) -> None:
    for command, body in (
        (entry(1), 2),
        (entry(2), 3),
        (GetControllerStatus(bit=0), 2),
        (MOVE, 2),
        (MOVE, 3),
    ):
        it.ask(command, body)
        assert not it.next().startswith("fence")
        it.hear(Answer(body, command.code, {"3PD": "+000001000", "9CD": "0"}.get(command.code, "")))


def test_earlier_answers_are_remembered_as_well_as_the_last(it: Bench) -> None:
    for bit, said in ((0, "0"), (None, "H00")):
        it.ask(GetControllerStatus(bit=bit))
        assert it.next() == "02 9CD"
        it.hear(Answer(2, "9CD", said))
    it.ask(GetControllerStatus(bit=1))
    assert it.next() == "fence 02 3ND"


def test_a_fence_rules_out_the_copies_of_all_codes_of_its_body(it: Bench) -> None:
    for command in (entry(1), GetControllerStatus(bit=0)):
        it.ask(command)
        it.next()
        it.hear(Answer(2, command.code, "0" if command.code == "9CD" else "+000000001"))
    it.ask(entry(2))
    assert it.next() == "fence 02 3ND"
    it.answer()
    assert it.next() == "02 3PD"
    it.hear(Answer(2, "3PD", "+000000002"))
    it.ask(GetControllerStatus(bit=1))
    assert it.next() == "02 9CD"


def test_a_copy_that_would_be_later_than_any_reply_is_not_reckoned_with(it: Bench) -> None:
    for seconds, expected in ((-0.01, "fence 02 3ND"), (0.0, "02 1+M")):
        it.session, it.now = RorzeSession([2, 3, 4, 5], rng=Random(1)), 0.0
        it.ask(MOVE)
        it.next()
        it.answer()
        it.now = it.session.terms.reply_timeout_s + it.session.terms.late_reply_s + seconds
        it.ask(MOVE)
        assert it.next() == expected


def test_a_group_is_kept_from_copies_like_a_body(it: Bench) -> None:
    it.session.groups[0x80] = [3, 4]
    members = {3: Answer(3, "9CD", "0"), 4: Answer(4, "9CD", "0")}
    copy = GroupAnswer(0x80, "9CD", members)
    it.ask(GetControllerStatus(bit=0), 0x80)
    it.next()
    it.hear(copy)
    running = it.ask(GetControllerStatus(bit=1), 0x80)
    assert it.next() == "fence 03 3ND"
    assert not it.hear(copy)
    it.answer()
    assert it.next() == "80 9CD"
    assert not running.done()


def test_what_a_fence_has_gone_ahead_of_is_not_overtaken_but_by_stops(it: Bench) -> None:
    def wonder() -> None:
        it.ask(GetControllerStatus(bit=0), lane=Lane.VERIFY)
        it.ask(GetControllerStatus(bit=0), 3, lane=Lane.VERIFY)

    wonder()
    for _ in range(2):
        it.next()
        it.hear(Answer(it.last.target, "9CD", "0"))
    it.ask(GetControllerStatus(bit=1))
    assert it.next() == "fence 02 3ND"
    wonder()
    it.ask(STOP)
    assert it.hear(answer_to(it.last))
    assert it.next() == "02 5IS"
    it.answer()
    assert it.next() == "02 9CD"
    assert it.last.command == GetControllerStatus(bit=1)


def test_two_groups_are_defined_with_a_fence_between(it: Bench) -> None:
    first, second = (it.set_up(SetGroup(group=group, members=["02", "03"])) for group in ("80", "81"))
    assert it.next(ready=False) == "7F XVS"
    acknowledgement = Answer(LINK_MASTER, "XVS", "")
    it.hear(acknowledgement)
    assert it.next(ready=False) == "fence 02 3ND"
    assert not it.hear(acknowledgement)
    it.answer()
    assert it.next(ready=False) == "7F XVS"
    assert first.done()
    assert not second.done()


def test_what_changes_with_every_question_is_fenced_now_and_then_so_that_little_is_remembered(
    it: Bench,
) -> None:
    memory = GetProgramMemory(memory="T0")
    fences = 0
    for value in range(10 * REPLIES_REMEMBERED):
        it.ask(memory)
        if it.next() == "fence 02 3ND":
            fences += 1
            it.answer()
            it.next()
        it.hear(Answer(2, "UDD", f"{value:+010d}"))
    assert 8 <= fences <= 10


# strictness: after a reply has come twice


@pytest.fixture
def strict(it: Bench) -> Bench:
    """A line on which a reply has come twice."""
    it.ask(MOVE, 5)
    it.next()
    it.answer()
    assert not it.hear(answer_to(it.last))
    assert it.session.strict
    return it


def test_a_second_reply_makes_strict_and_that_is_told_once(it: Bench) -> None:
    told: list[bool] = []
    it.session.on_strict = told.append
    it.ask(READ)
    it.next()
    it.answer(7)
    assert not it.session.strict
    for _ in range(2):
        assert not it.hear(Answer(2, "6PD", "+000000007"))
    assert it.session.strict
    assert told == [True]


def test_what_only_looks_like_a_copy_does_not_make_strict(it: Bench) -> None:
    it.ask(STOP)
    it.next()
    it.answer()
    assert not it.hear(Answer(2, "5IS", "")), "the reply to a stop that was given up"
    assert not it.hear(Answer(3, "6PD", "+000000007"))
    assert not it.session.strict


def test_where_replies_come_twice_an_acknowledgement_is_told_between_two_fences(strict: Bench) -> None:
    it = strict
    move = it.ask(MOVE)
    assert it.next() == "fence 02 3ND"
    it.answer()
    assert it.next() == "02 1+M"
    it.answer()
    assert not move.done()
    assert it.next() == "fence 02 3ND"
    it.answer()
    assert move.result() == Answered({2: MOVE.read_reply("")}, it.now, late=False)
    it.ask(MOVE)
    assert it.next() == "02 1+M", "the fence behind is one before, too"


def test_a_fence_before_is_old_when_its_body_has_spoken_since(strict: Bench) -> None:
    it = strict
    it.ask(MOVE)
    it.next()
    it.answer()
    it.next()
    it.answer()
    it.next()
    it.answer()
    it.ask(READ)
    it.next()
    it.answer()
    it.ask(MOVE)
    assert it.next() == "fence 02 3ND"


def test_reads_need_no_brackets(strict: Bench) -> None:
    it = strict
    read = it.ask(READ)
    assert it.next() == "02 6PD"
    it.answer(3)
    assert read.done()


def test_before_the_second_fence_the_last_reply_counts_and_a_contradiction_leaves_a_doubt(
    strict: Bench,
) -> None:
    it = strict
    for said, kind in (([0x4A, 0x50], Refusal), ([None, 0x50], GarbledReply), ([0x50, None], GarbledReply)):
        move = it.ask(MOVE)
        if it.next() != "02 1+M":
            it.answer()
            it.next()
        for error in said:
            it.hear(Answer(2, "1+M", "") if error is None else Refusal(2, "1+M", error))
        assert it.next() == "fence 02 3ND"
        it.answer()
        assert isinstance(move.result(), kind)
    assert it.session.counters["late_replies"] == 0


def test_a_stop_goes_before_the_fences_of_a_bracket(strict: Bench) -> None:
    it = strict
    it.ask(MOVE)
    it.next()
    it.answer()
    it.next()
    it.answer()
    it.ask(STOP)
    assert it.next() == "02 5IS"


def test_a_bracketed_reply_is_told_though_the_body_dies_behind_it_or_the_port_goes(strict: Bench) -> None:
    it = strict
    for end in ("dies", "goes"):
        it.session.offline.clear()
        move = it.ask(MOVE)
        assert it.next() == "fence 02 3ND"
        it.answer()
        it.next()
        it.answer()
        if end == "goes":
            it.session.break_off(LOST, UNSENT)
        else:
            for _ in range(FENCE_TRIES):
                assert it.next() == "fence 02 3ND"
                it.fall_silent()
            it.next()
            it.answer()
        assert isinstance(move.result(), Answered)


def test_where_nobody_is_left_for_a_fence_the_link_master_is_told_nevertheless(strict: Bench) -> None:
    it = strict
    told = it.set_up(SetReplyFormat(end_of_move=1))
    written = [it.next(ready=False)]
    while written[-1].startswith("fence"):
        it.fall_silent()
        written.append(it.next(ready=False))
    assert written[-1] == "7F XRS"
    assert not told.done()


def test_strictness_ends_when_no_reply_has_come_twice_for_long(strict: Bench) -> None:
    it, told = strict, list[bool]()
    it.session.on_strict = told.append
    assert it.session.deadline() == STRICT_S
    it.now = STRICT_S / 2
    assert not it.hear(answer_to(it.last))
    for it.now in (STRICT_S, 1.5 * STRICT_S - 1):
        it.session.pass_deadlines(it.now, None)
        assert it.session.strict
    it.now += 1
    it.session.pass_deadlines(it.now, None)
    assert not it.session.strict
    assert told == [False]
    assert it.session.deadline() is None


def test_a_port_that_is_opened_anew_is_not_strict(strict: Bench) -> None:
    strict.session.break_off(LOST, UNSENT)
    assert not strict.session.strict


# the end


def test_after_the_port_has_gone_nothing_is_left_and_the_next_opening_starts_in_step(it: Bench) -> None:
    suspect = it.ask(MOVE)
    it.next()
    it.fall_silent()
    it.next()  # its fence
    stop = it.ask(STOP, 3)
    it.next()
    set_up, waiting_read = it.set_up(IdentifyControllers()), it.ask(READ, 4)
    it.session.break_off(LOST, UNSENT)
    for one in (suspect, stop):
        lost = one.result()
        assert isinstance(lost, NoReply)
        assert (lost.detail, lost.moved) == (LOST.detail, "unknown")
    assert [one.result() for one in (set_up, waiting_read)] == [UNSENT, UNSENT]
    assert it.session.in_step
    assert not it.session.has_something()
    assert not it.session.awaits_replies()
    assert it.session.deadline() is None


def test_a_read_that_the_port_has_taken_along_moved_nothing_and_may_be_asked_again(it: Bench) -> None:
    read = it.ask(READ)
    it.next()
    it.session.break_off(LOST, UNSENT)
    lost = read.result()
    assert isinstance(lost, NoReply)
    assert (lost.detail, lost.moved, lost.retryable) == (LOST.detail, "no", True)
    assert (LOST.moved, LOST.retryable) == ("unknown", False)


# the law, on any line that keeps its order and tells nothing later than it may


class Said(NamedTuple):
    """A reply on its way, what it answers, and when that was written."""

    frame: ReplyFrame
    cause: RorzeExchange
    written_at: float


LATEST_S = 1.9
"""Less than what a late reply may take."""
COMMANDS = [MOVE, MOVE, MOVE, READ, STOP, SetReplyFormat(end_of_move=1)]
FATES = st.sampled_from(["answered", "doubled", "doubled", "lost"])
"""Fates of the frames that are written next."""


def test_a_frame_written_at_time_zero_is_given_up_in_time(it: Bench) -> None:
    it.ask(MOVE)
    it.next()
    it.session.pass_deadlines(0.5, 0.6)
    it.session.pass_deadlines(0.6, 100.0)
    assert it.session.deadline() == it.session.terms.reply_timeout_s + it.session.terms.late_reply_s


class AnySession(RuleBasedStateMachine):
    """Every reply but a stop's has a number of its own, so that all can see what it was credited to."""

    @initialize(seed=st.integers(0, 3), interject=st.booleans())
    def begin(self, seed: int, interject: bool) -> None:
        self.loop = VirtualLoop()
        self.session = RorzeSession([1, 2], interject_stops=interject, rng=Random(seed))
        self.now = 0.0
        self.wire: deque[Said] = deque()
        self.futures: list[Future] = []
        self.owners: list[list[Future]] = []
        """Waiters for each written frame, by its number."""
        self.moves_written: set[RorzeExchange] = set()
        self.awaited: RorzeExchange | None = None

    # what can happen

    @rule(body=st.sampled_from([1, 1, 1, 2]), command=st.sampled_from(COMMANDS), fate=FATES)
    def ask(self, body: int, command: RorzeCommand[Any], fate: str) -> None:
        sets_up = isinstance(command, SetReplyFormat)
        if body in self.session.offline and not sets_up and command is not STOP:
            return
        exchange = self.session.exchange(LINK_MASTER if sets_up else body, command, lane_of(command))
        self.futures.append(waiting(exchange, self.loop))
        if sets_up:
            self.session.put_first(exchange)
        else:
            self.session.scheduler.submit(exchange)
        self._pump(fate)

    @precondition(lambda self: self.wire)
    @rule(fate=FATES)
    def deliver(self, fate: str) -> None:
        self._deliver()
        self._pump(fate)

    @precondition(lambda self: self.awaited)
    @rule(fate=FATES)
    def make_noise(self, fate: str) -> None:
        self.session.noise("noise", self.now)
        self._doubt()
        self._pump(fate)

    @precondition(lambda self: self.session.awaits_replies() or self.wire)
    @rule(seconds=st.sampled_from([0.1, 0.5, 0.7]), fate=FATES)
    def let_time_pass(self, seconds: float, fate: str) -> None:
        self.now += seconds
        while self.wire and self.wire[0].written_at + LATEST_S <= self.now:
            self._deliver()
        self.session.pass_deadlines(self.now, None)
        if self.awaited is not None and (self.awaited.reply.deadline or 0.0) <= self.now:
            self.awaited = None
        self._pump(fate)

    @precondition(lambda self: len(self.owners) > 9)
    @rule()
    def lose_the_port(self) -> None:
        self.session.break_off(LOST, UNSENT)
        self.wire.clear()
        self.awaited = None
        assert all(future.done() for future in self.futures)
        assert not self.session.has_something()

    def teardown(self) -> None:
        try:
            self.lose_the_port()
        finally:
            self.loop.close()

    # what must hold

    @invariant()
    def a_waiter_gets_the_reply_to_a_frame_that_was_written_for_it(self) -> None:
        for future in self.futures:
            if future.done() and (number := _number(future.result())) is not None:
                assert future in self.owners[number], "a reply is credited to another"

    def _pump(self, fate: str) -> None:
        """Write whatever may go now."""
        while (exchange := self.session.next(self.now, ready=True)) is not None:
            if exchange.lane is not Lane.STOP:
                assert self.awaited is None, "two exchanges await their replies"
                assert self.session.in_step or exchange.reply.self_identifying, (
                    "sent before the fence has passed"
                )
                self.awaited = exchange
            if exchange.command is MOVE:
                assert exchange not in self.moves_written, "a move is written twice"
                self.moves_written.add(exchange)
            self.session.written(exchange, self.now, self.now + exchange.reply.timeout_s)
            copies = {"lost": 0, "doubled": 2 if exchange.command is MOVE else 1}.get(fate, 1)
            self.wire.extend([Said(self._reply(exchange), exchange, self.now)] * copies)
            self.owners.append(list(exchange.waiters))

    def _reply(self, exchange: RorzeExchange) -> ReplyFrame:
        number = len(self.owners)
        if exchange.lane is Lane.STOP or isinstance(exchange.command, GetNumberedPositionEntry | GetPosition):
            return answer_to(exchange, number)
        return Refusal(exchange.target, exchange.command.code, number)

    def _deliver(self) -> None:
        said = self.wire.popleft()
        tell = self.session.receive(said.frame, self.now)
        if tell is not None:
            tell()
        if said.cause is self.awaited:
            assert tell is not None, "the reply to what is awaited is not credited"
            self.awaited = None
        elif tell is None:
            self._doubt()

    def _doubt(self) -> None:
        if self.awaited is not None and not self.awaited.reply.self_identifying:
            self.awaited = None


def _number(outcome: Outcome) -> int | None:
    """Number of the written frame that an outcome answers; None if it does not tell."""
    if isinstance(outcome, Refusal):
        return outcome.error
    if isinstance(outcome, Answered):
        return next(
            (reply.pulses for reply in outcome.replies.values() if isinstance(reply, SignedPulses)), None
        )
    return None


TestAnySession = AnySession.TestCase
TestAnySession.settings = settings(max_examples=200, stateful_step_count=40, deadline=None)


# what is revoked


def test_what_waits_is_revoked_with_its_reason_and_reads_go_on(it: Bench) -> None:
    first = it.ask(READ, 3)
    assert it.next() == "03 6PD"
    move, read = it.ask(MOVE), it.ask(READ)
    it.session.revoke(HeldUp)
    assert isinstance(move.result(), HeldUp)
    it.answer()
    assert first.done()
    assert it.next() == "02 6PD"
    it.answer()
    assert isinstance(read.result(), Answered)


def test_a_setting_that_was_sent_and_is_not_repeated_is_not_called_not_sent(it: Bench) -> None:
    setting = it.ask(SetStartSpeed(speed_set=1, speed=1000))
    it.next()
    it.fall_silent()
    assert it.next() == "fence 02 3ND"
    it.session.revoke(HeldUp)
    it.answer()
    assert it.next() == ""
    assert type(setting.result()) is NoReply


def test_a_fence_that_is_wanted_goes_before_everything_but_stops(it: Bench) -> None:
    it.ask(READ, 3)
    it.next()
    it.answer()
    it.ask(READ)
    it.session.fence()
    it.ask(STOP)
    assert it.next() == "02 5IS"
    it.answer()
    assert it.next() == "fence 03 3ND"  # heard last when the doubt arose, it can best tell
    it.answer()
    assert it.next() == "02 6PD"


def test_a_fence_that_is_wanted_waits_for_the_reply_under_way(it: Bench) -> None:
    move = it.ask(MOVE)
    it.next()
    it.session.fence()
    assert it.next() == ""
    it.answer()
    assert isinstance(move.result(), Answered)
    assert it.next() == "fence 02 3ND"


def test_a_late_refusal_with_the_fences_code_is_not_credited_to_the_read_in_doubt(it: Bench) -> None:
    asked = it.ask(GetNumberedPositionEntry(entry=PositionReference(position=5)))
    assert it.next() == "02 3ND"
    it.fall_silent()
    assert it.next() == "fence 02 3ND"
    assert not it.hear(Refusal(2, "3ND", 0x4A))  # of which of both nobody knows
    it.answer()
    assert not asked.done()  # it is asked again
    assert it.next() == "02 3ND"
