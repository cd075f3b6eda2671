"""A third family is a handful of hooks: a controller of one letter a command, made up for this test."""

import asyncio
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

import pytest

from gateway.core.errors import Cancelled, GatewayError, NoReply, StoppedFirst
from gateway.core.exchange import Exchange, ExpectedReply, Lane, RememberedReply
from gateway.core.fence import FENCE_TRIES
from gateway.core.session import READ_REPEATS, Session
from protocols.table import Command, Effect, Reply, Retry
from tests.virtual_time import VirtualLoop

AXIS, SET_UP = 0, 1


class Ask(Command[Reply], args=""):
    """A question."""

    code = "A"
    retry = Retry.READ
    effect = Effect.READ


class Do(Command[Reply], args=""):
    """An action."""

    code = "D"


class Letter(NamedTuple):
    """A frame of the controller: the letter of the command, and a number."""

    code: str
    number: int = 0


@dataclass(eq=False, slots=True)
class LetterExchange(Exchange[Command[Any], Letter, Letter]):
    """A command of one letter; a fence has a number of its own."""

    nonce: int = 0

    @property
    def sent(self) -> str:
        return f"{self.command.code} was sent"

    def mistakes(self, _said: RememberedReply) -> bool:
        return not self.command.may_repeat

    def credit(self, frame: Letter, _now: float) -> Letter | None:
        fits = frame.code == self.command.code and frame.number == self.nonce
        return frame if fits else None


class LetterSession(Session[LetterExchange, Letter]):
    """A session with a single controller."""

    answers_all = True

    def __init__(self) -> None:
        super().__init__(
            target="axis",
            replies_remembered=8,
            set_up_target=SET_UP,
            reply_timeout_s=0.5,
            late_reply_s=2.0,
        )
        self.nonce = 0

    def exchange(self, command: Command[Any], lane: Lane) -> LetterExchange:
        repeats = READ_REPEATS if command.may_repeat else 0
        frame = command.code.encode()
        return LetterExchange(
            command,
            frame,
            lane,
            AXIS,
            self.epoch(AXIS),
            reply=ExpectedReply(repeats=repeats, names=(command.code,)),
        )

    def fence_query(self) -> LetterExchange:
        fence = self.exchange(Ask(), Lane.READ)
        self.nonce += 1
        fence.nonce, fence.reply.self_identifying = self.nonce, True
        return fence

    def wants_fence(self, exchange: LetterExchange, now: float) -> bool:
        return self._copies.could_answer(exchange, AXIS, now)

    def note_reply(self, exchange: LetterExchange, frame: Letter, now: float) -> None:
        said = RememberedReply(exchange, frame, frame, exchange.number, now + self.terms.late_reply_s)
        self._copies.note(AXIS, frame.code, said, now)

    def fence_passed(self, _fence: LetterExchange) -> None:
        self._copies.forget(AXIS)

    def holds_up(self, _sent: LetterExchange) -> bool:
        return False

    def witness_failed(self) -> bool:
        self.offline.add(AXIS)
        return False

    def is_refusal_of_fence(self, _frame: Letter) -> bool:
        return False


class Bench:
    """The session, and a hand that writes and answers."""

    def __init__(self) -> None:
        self.session, self.loop, self.now = LetterSession(), VirtualLoop(), 0.0

    def ask(
        self, command: Command[Any], lane: Lane = Lane.COMMAND
    ) -> "asyncio.Future[Letter | GatewayError]":
        exchange = self.session.exchange(command, lane)
        future: asyncio.Future[Letter | GatewayError] = self.loop.create_future()
        exchange.waiters[future] = exchange.expires_at
        self.session.submit(exchange)
        return future

    def write(self) -> str:
        exchange = self.session.next(self.now, ready=True)
        if exchange is None:
            return ""
        self.session.written(exchange, self.now, self.now + 0.5)
        return exchange.command.code + (str(exchange.nonce) if exchange.reply.self_identifying else "")

    def hear(self, code: str, number: int = 0) -> None:
        if (tell := self.session.receive(Letter(code, number), self.now)) is not None:
            tell()

    def fall_silent(self) -> None:
        self.now += 0.5
        self.session.pass_deadlines(self.now, None)


@pytest.fixture
def it() -> Iterator[Bench]:
    bench = Bench()
    yield bench
    bench.loop.close()


def test_a_reply_is_credited_and_a_read_without_one_is_asked_again_after_a_fence(it: Bench) -> None:
    read = it.ask(Ask(), Lane.READ)
    assert it.write() == "A"
    it.fall_silent()
    assert it.write() == "A1"
    it.hear("A", 1)
    assert it.write() == "A"
    it.hear("A")
    assert read.result() == Letter("A")


def test_an_action_without_a_reply_is_never_written_twice_and_a_late_reply_is_its_own(it: Bench) -> None:
    for late in (False, True):
        action = it.ask(Do())
        while it.write() != "D":
            it.hear("A", it.session.nonce)
        it.fall_silent()
        assert it.write() == f"A{it.session.nonce}"
        if late:
            it.hear("D")
        it.hear("A", it.session.nonce)
        assert isinstance(action.result(), Letter if late else NoReply)
        assert it.write() == ""


def test_a_copy_of_a_reply_ends_no_equal_action(it: Bench) -> None:
    it.ask(Do())
    it.write()
    it.hear("D")
    second = it.ask(Do())
    assert it.write() == "A1"
    it.hear("D")
    it.hear("A", 1)
    assert it.write() == "D"
    assert not second.done()


def test_a_controller_that_answers_no_fence_is_given_up(it: Bench) -> None:
    read = it.ask(Ask(), Lane.READ)
    for _ in range(1 + FENCE_TRIES):
        assert it.write()
        it.fall_silent()
    assert isinstance(read.result(), NoReply)
    assert (it.session.offline, it.session.in_step, it.write()) == ({AXIS}, True, "")


def test_a_stop_overtakes_what_was_admitted_before_it(it: Bench) -> None:
    action = it.ask(Do())
    it.session.gate.stop(AXIS)
    assert it.write() == ""
    assert isinstance(action.result(), StoppedFirst)


def test_a_lost_port_leaves_nothing_behind(it: Bench) -> None:
    written, waiting = it.ask(Do()), it.ask(Do())
    it.write()
    it.session.break_off(NoReply("gone"), Cancelled("gone"))
    assert isinstance(written.result(), NoReply)
    assert isinstance(waiting.result(), Cancelled)
    assert not it.session.has_something()


def test_nothing_is_in_the_port_when_the_reply_to_the_last_frame_has_come(it: Bench) -> None:
    it.ask(Do())
    it.write()
    assert not it.session.sent.all_answered
    it.hear("D")
    assert it.session.sent.all_answered
    it.ask(Ask(), Lane.READ)
    it.write()
    assert not it.session.sent.all_answered


def test_the_reply_to_what_went_before_a_stop_leaves_the_stop_in_the_port(it: Bench) -> None:
    it.ask(Do())
    it.write()
    it.ask(Ask(), Lane.STOP)
    it.write()
    it.hear("D")
    assert not it.session.sent.all_answered
    it.hear("A")
    assert it.session.sent.all_answered


def test_an_exchange_takes_the_line_until_its_reply_a_frame_beside_it_or_its_deadline(it: Bench) -> None:
    it.ask(Do())
    it.write()
    it.now = 1.0
    it.ask(Ask(), Lane.STOP)
    it.write()
    it.now = 3.0
    it.hear("A")
    it.hear("D")
    assert dict(it.session.load.busy_s) == {"health": 1.0, "stops": 2.0}
    it.ask(Ask(), Lane.READ)
    it.write()
    it.fall_silent()
    assert it.session.load.busy_s["health"] == 1.5
    assert it.session.load.took.up_to()[-1][1] == 3
