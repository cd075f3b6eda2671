"""The next frame on a robot's line, and the exchange that each answer belongs to."""

import asyncio
from collections.abc import Iterator
from random import Random
from typing import Any, ClassVar

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gateway.core.errors import Cancelled, Expired, GarbledReply, HeldUp, NoReply, StoppedFirst
from gateway.core.exchange import Lane
from gateway.fics.errors import NotProved
from gateway.fics.exchange import ROBOT, SET_UP, FicsExchange, Outcome, Proof, RobotAnswered
from gateway.fics.session import FENCES, FicsSession, UploadState, offline_error
from protocols.fics.alarms import TakeCurrentError
from protocols.fics.inputs_outputs import SwitchOutput
from protocols.fics.jog import StartJog, StopJog
from protocols.fics.link import Completion, FicsRefusal, QueryAnswer
from protocols.fics.moves import MoveRelative
from protocols.fics.positions import (
    BeginPositionUpload,
    DownloadPositions,
    EndPositionUpload,
    StoredPosition,
    UploadPosition,
)
from protocols.fics.row import FicsCommand
from protocols.fics.speeds import GetSpeedPercent, SetSmoothAcceleration
from protocols.fics.status import GetAxisStatus
from protocols.fics.stops import StopAllDecelerating, StopAllImmediately
from protocols.fics.system import GetCommunicationMode, GetSystemVersion, GetUnit
from protocols.fics.variables import GetVariable, SetVariable
from protocols.table import Reply
from tests.virtual_time import VirtualLoop

VERSION = "DYNAX0010310041112PROJECT1      041215R01"
AT_REST = QueryAnswer("ACD", "0300")


@pytest.fixture(autouse=True)
def _loop() -> Iterator[None]:
    Bench.loop = VirtualLoop()
    yield
    Bench.loop.close()


class Bench:
    """A session, and the pen that writes for it."""

    loop: ClassVar[VirtualLoop]

    def __init__(self, mode: int = 3) -> None:
        self.session = FicsSession("r1", rng=Random(0))
        self.session.mode = mode

    def submit(self, command: FicsCommand[Reply], lane: Lane = Lane.COMMAND) -> FicsExchange:
        exchange = self.session.exchange(command, lane)
        self.wait_for(exchange)
        self.session.submit(exchange)
        return exchange

    def wait_for(self, exchange: FicsExchange) -> "asyncio.Future[Outcome]":
        future: asyncio.Future[Outcome] = self.loop.create_future()
        exchange.waiters[future] = exchange.expires_at
        return future

    def write(self, now: float = 0.0) -> str:
        exchange = self.session.next(0.0, ready=True)
        assert exchange is not None
        self.session.written(exchange, now, now + exchange.reply.timeout_s)
        return exchange.frame.decode().rstrip("\r")

    def hear(self, *frames: QueryAnswer | Completion | FicsRefusal) -> None:
        for frame in frames:
            tell = self.session.receive(frame, 0.0)
            if tell is not None:
                tell()

    def begin_upload(self) -> None:
        self.submit(BeginPositionUpload(first=1))
        assert self.write() == "POF 1,1"
        self.hear(Completion("POF"))

    def pass_fence(self) -> None:
        text = self.write()
        if text == "VER":
            self.hear(QueryAnswer("VER", VERSION))
            return
        assert text.startswith("VAR V")
        self.hear(QueryAnswer("VAR", f"{text[4:]}=+1"))


def test_equal_names_are_answered_in_the_order_they_were_written() -> None:
    it = Bench()
    for axis in "XZ":
        it.submit(StopJog(axis=axis), Lane.STOP)
        assert it.write() == f"JOG {axis}"
    it.hear(Completion("JOG"))
    assert [one.command for one in it.session.sent] == [StopJog(axis="Z")]
    it.hear(FicsRefusal("JOG", "E07"))
    assert it.session.sent == []


def test_no_answer_after_a_fence_is_credited_to_a_stop_before_it() -> None:
    it = Bench()

    stop, start = it.submit(StopJog(axis="X"), Lane.STOP), StartJog(axis="Z", direction="+")
    stopped = it.wait_for(stop)
    started = it.wait_for(it.submit(start))
    assert it.write() == "JOG X"  # its answer is lost
    it.pass_fence()
    assert it.write() == "JOG Z+"
    it.hear(FicsRefusal("JOG", "E07"))
    assert isinstance(stopped.result(), NoReply)
    assert started.result() == FicsRefusal("JOG", "E07")


def test_a_decelerating_stop_is_answered_at_standstill_however_many_fences_pass() -> None:
    it = Bench()
    it.submit(StopAllDecelerating(), Lane.STOP)
    it.write()
    it.submit(GetSystemVersion(), Lane.READ)
    it.write()
    it.session.pass_deadlines(1.0, None)
    it.pass_fence()
    assert [type(one.command) for one in it.session.sent] == [StopAllDecelerating]


def test_between_equal_deeds_goes_a_fence_and_between_others_none() -> None:
    it = Bench()
    for bit in (0, 1):
        it.submit(SwitchOutput(channel=1, bit=bit, on=True))
    assert it.write() == "IOT 1-0:+"
    it.hear(Completion("IOT"), Completion("IOT"))
    it.pass_fence()
    assert it.write() == "IOT 1-1:+"
    it.hear(Completion("IOT"))
    it.submit(MoveRelative(coordinates=[1.0]))
    assert it.write() == "LMI 1"


def test_a_question_asked_again_after_a_deed_gets_no_old_answer() -> None:
    it = Bench()
    for _ in range(2):
        it.submit(GetAxisStatus(), Lane.READ)
        assert it.write() == "ACD"
        it.hear(AT_REST)
    it.submit(MoveRelative(coordinates=[1.0]))
    assert it.write() == "LMI 1"
    it.submit(GetAxisStatus(), Lane.READ)
    assert it.session.next(0.0, ready=True) is not None
    assert it.session.counters["fences"] == 1


def test_a_fence_is_passed_by_its_own_number_only() -> None:
    it = Bench()
    it.submit(GetVariable(number=5), Lane.READ)
    it.write()
    it.session.pass_deadlines(1.0, None)
    fence = it.write(1.0)
    it.hear(FicsRefusal("VAR", "E06"), QueryAnswer("VAR", "V05=+1"))
    assert not it.session.in_step
    assert it.write(1.0) not in (fence, "VAR V05")


def test_a_fence_never_asks_for_what_somebody_has_asked_for() -> None:
    it = Bench()
    numbers = {it.session._fresh_variable() for _ in range(100)}
    assert numbers == set(range(100))
    for number in range(0, 100, 2):
        it.submit(GetVariable(number=number), Lane.READ)
        it.write()
        it.hear(QueryAnswer("VAR", f"V{number:02d}=+1"))
    assert {it.session._fresh_variable() for _ in range(50)} == set(range(1, 100, 2))


@pytest.mark.parametrize(("error", "may_be_open"), [("E01", False), ("E05", False), ("E03", True)])
def test_an_upload_that_is_refused_is_none_unless_one_may_be_open(error: str, may_be_open: bool) -> None:
    it = Bench()
    it.submit(BeginPositionUpload(first=1))
    it.write()
    assert it.session.upload.is_open
    it.hear(FicsRefusal("POF", error))
    assert it.session.upload.is_open is may_be_open


@pytest.mark.parametrize(("error", "may_be_open"), [("E08", False), ("E03", True), ("E06", True)])
def test_the_end_of_an_upload_that_is_refused_ends_it_only_if_none_was_open(
    error: str, may_be_open: bool
) -> None:
    it = Bench()
    it.begin_upload()
    it.submit(EndPositionUpload())
    it.write()
    it.hear(FicsRefusal("POF", error))
    assert it.session.upload.is_open is may_be_open


def test_an_upload_whose_end_was_refused_is_ended_before_anything_else_is_said() -> None:
    it = Bench()
    it.begin_upload()
    it.submit(EndPositionUpload())
    it.write()
    it.hear(FicsRefusal("POF", "E03"))
    it.submit(TakeCurrentError(), Lane.READ)
    assert it.write() == "ERR"  # the robot takes it in an upload, too
    it.hear(QueryAnswer("ERR", "E03"))
    it.submit(GetAxisStatus(), Lane.READ)
    assert it.write() == "POF 2"
    it.hear(Completion("POF"))
    assert not it.session.upload.is_open
    it.pass_fence()
    assert it.write() == "ACD"


def test_what_no_upload_lets_through_proves_that_none_is_open() -> None:
    it = Bench()
    it.session.upload.doubt()
    it.submit(StopAllImmediately(), Lane.STOP)
    assert [it.write(), it.write()] == ["POF 2", "AES"]
    it.hear(Completion("AES"))
    assert not it.session.upload.is_open


def test_an_answer_to_what_was_said_before_an_upload_does_not_end_it() -> None:
    it = Bench()
    it.submit(MoveRelative(coordinates=[1.0]))
    assert it.write() == "LMI 1"
    it.begin_upload()
    it.hear(Completion("LMI"))
    assert it.session.upload.is_open


@pytest.mark.parametrize("question", [GetAxisStatus(), GetSystemVersion(), GetCommunicationMode()])
def test_a_refusal_that_only_an_upload_explains_is_followed_by_its_end(question: FicsCommand[Reply]) -> None:
    it = Bench()
    it.submit(question, Lane.READ)
    name = it.write()
    it.hear(FicsRefusal(name, "E03"))
    assert it.write() == "POF 2"
    it.hear(Completion("POF"))
    it.pass_fence()
    assert it.session.in_step


def test_a_fence_that_is_refused_as_in_an_upload_ends_it() -> None:
    it = Bench()
    it.submit(GetAxisStatus(), Lane.READ)
    it.write()
    it.session.pass_deadlines(1.0, None)
    assert it.write().startswith("VAR V")
    it.hear(FicsRefusal("VAR", "E03"))
    assert it.write() == "POF 2"


def test_a_refusal_that_the_teaching_terminal_explains_is_no_upload() -> None:
    it = Bench()
    it.submit(MoveRelative(coordinates=[1.0]))
    it.write()
    it.hear(FicsRefusal("LMI", "E03"))
    assert not it.session.upload.is_open
    assert it.session.in_step


def test_in_mode_2_the_end_of_an_upload_is_proved_by_a_fence_or_sent_again() -> None:
    it = Bench(mode=2)
    it.submit(BeginPositionUpload(first=1))
    it.submit(EndPositionUpload())
    assert [it.write(), it.write()] == ["POF 1,1", "POF 2"]
    it.submit(GetAxisStatus(), Lane.READ)
    assert it.write().startswith("VAR V")
    it.session.pass_deadlines(1.0, None)
    assert it.write() == "POF 2"
    it.pass_fence()
    assert it.write() == "ACD"


def test_in_mode_2_silence_may_be_that_of_an_upload_nobody_knows_of() -> None:
    it = Bench(mode=2)
    it.submit(GetAxisStatus(), Lane.READ)
    it.write()
    it.session.pass_deadlines(1.0, None)
    assert it.write() == "POF 2"
    it.pass_fence()


def test_the_end_of_an_upload_that_nobody_has_heard_goes_before_the_next_stop() -> None:
    it = Bench()
    it.begin_upload()
    it.submit(UploadPosition(coordinates=[1.0]))
    it.write()
    for _ in range(2):
        it.submit(StopAllImmediately(), Lane.STOP)
        assert [it.write(), it.write()] == ["POF 2", "AES"]
        it.session.pass_deadlines(1.0, None)
    it.submit(StopAllImmediately(), Lane.STOP)
    assert it.write() == "POF 2"
    it.hear(Completion("POF"))
    assert it.write() == "AES"
    it.submit(StopAllImmediately(), Lane.STOP)
    assert it.write() == "AES"


def test_the_end_of_an_upload_goes_before_a_stop_that_waited_already() -> None:
    it = Bench()
    it.submit(StopAllDecelerating(), Lane.STOP)
    it.session.upload.doubt()
    it.submit(StopAllImmediately(), Lane.STOP)
    assert [it.write() for _ in range(3)] == ["POF 2", "AES", "ASS"]


def test_what_waits_can_be_taken_back_and_what_is_written_cannot() -> None:
    it = Bench()
    first = it.submit(MoveRelative(coordinates=[1.0]))
    it.write()
    second = it.submit(MoveRelative(coordinates=[2.0]))
    assert {lane for lane in Lane if it.session.waiting(lane)} == {Lane.COMMAND}
    it.session.cancel(lambda it: it in (first, second), Expired(""))
    assert [type(one.command) for one in it.session.sent] == [MoveRelative]
    assert it.session.next(0.0, ready=True) is None


@pytest.mark.parametrize("ready", [True, False])
def test_after_a_loss_of_power_nothing_that_waited_is_written(ready: bool) -> None:
    it = Bench()
    it.submit(MoveRelative(coordinates=[1.0]))
    it.session.lose_motion(NoReply(""), Cancelled(""))
    assert it.session.next(0.0, ready=ready) is None


def test_equal_stops_that_wait_are_written_once_and_answered_all() -> None:
    it = Bench()
    written: list[float] = []

    futures = []
    for _ in range(50):
        stop = it.session.exchange(StopAllImmediately(), Lane.STOP)
        stop.on_written = written.append
        futures.append(it.wait_for(stop))
        it.session.submit(stop)
    assert it.session.waiting(Lane.STOP) == 1
    assert it.write() == "AES"
    it.hear(Completion("AES"))
    assert [future.result() for future in futures] == [RobotAnswered()] * 50
    assert len(written) == 50


def test_an_immediate_stop_goes_before_a_decelerating_one_that_waits() -> None:
    it = Bench()
    it.submit(StopAllDecelerating(), Lane.STOP)
    it.submit(StopAllImmediately(), Lane.STOP)
    assert [it.write(), it.write()] == ["AES", "ASS"]


def test_what_has_become_too_late_or_was_stopped_is_not_written_however_late_the_clock_is_looked_at() -> None:
    it = Bench()
    late, stopped, read = [
        it.submit(MoveRelative(coordinates=[1.0])),
        it.submit(MoveRelative(coordinates=[2.0])),
        it.submit(GetSystemVersion(), Lane.READ),
    ]
    late.expires_at = 10.0
    stopped.epoch -= 1
    assert it.session.next(10.0, ready=True) is read


class Proved(Bench):
    """A motion that waits, and the question that goes before it."""

    def __init__(self) -> None:
        super().__init__()
        self.proof = Proof(self.session.doubts)
        self.asked_at = 10.0
        question = self.session.exchange(GetCommunicationMode(), Lane.READ)
        question.proves, question.fresh = self.proof, True
        self.wait_for(question)
        self.session.submit(question)
        assert self.write(self.asked_at) == "MOD"

    def answer(self) -> None:
        self.hear(QueryAnswer("MOD", "3"))

    def what_becomes_of_a_motion(self, now: float) -> "str | Outcome":
        """Its frame, or why it is not written."""

        motion = self.session.exchange(MoveRelative(coordinates=[1.0]), Lane.COMMAND)
        motion.needs, outcome = self.proof, self.wait_for(motion)
        self.session.submit(motion)
        found = self.session.next(now, ready=True)
        return outcome.result() if found is None else found.frame.decode().rstrip("\r")


def test_a_motion_is_written_right_after_the_last_question_of_its_proof() -> None:
    it = Proved()
    it.answer()
    assert it.what_becomes_of_a_motion(it.asked_at + 0.4) == "LMI 1"


def test_a_motion_is_not_written_when_something_came_that_nobody_has_asked_for() -> None:
    it = Proved()
    it.answer()
    it.answer()
    assert isinstance(it.what_becomes_of_a_motion(it.asked_at + 0.4), NotProved)


def test_a_motion_is_not_written_when_its_last_question_had_to_be_repeated() -> None:
    it = Proved()
    it.session.pass_deadlines(it.asked_at + 1.0, None)
    it.pass_fence()
    assert it.write(it.asked_at + 1.0) == "MOD"
    it.answer()
    assert isinstance(it.what_becomes_of_a_motion(it.asked_at + 1.1), NotProved)


def test_a_late_answer_proves_nothing() -> None:
    it = Proved()
    it.session.pass_deadlines(it.asked_at + 1.0, None)
    text = it.write(it.asked_at + 1.0)
    it.answer()
    it.hear(QueryAnswer("VAR", f"{text[4:]}=+1"))
    assert isinstance(it.what_becomes_of_a_motion(it.asked_at + 1.1), NotProved)


def test_a_motion_is_not_written_when_anything_else_was_since() -> None:
    it = Proved()
    it.answer()
    it.submit(StopJog(axis="Z"), Lane.STOP)
    assert it.write(it.asked_at) == "JOG Z"
    assert isinstance(it.what_becomes_of_a_motion(it.asked_at + 0.1), NotProved)


def test_a_motion_is_not_written_when_the_gateway_was_held_up_since() -> None:
    it = Proved()
    it.answer()
    assert isinstance(it.what_becomes_of_a_motion(it.asked_at + 0.5), NotProved)


def test_a_motion_is_not_written_when_the_port_was_lost_since() -> None:
    it = Proved()
    it.answer()
    it.session.break_off(NoReply("The port has gone."), Cancelled("The port has gone."))
    assert isinstance(it.what_becomes_of_a_motion(it.asked_at + 0.1), NotProved)


def test_a_proof_is_asked_for_anew_and_gets_no_copy_of_an_earlier_answer() -> None:
    it = Proved()
    it.answer()
    again = it.session.exchange(GetCommunicationMode(), Lane.READ)
    again.fresh = True
    it.wait_for(again)
    it.session.submit(again)
    it.pass_fence()
    assert it.write() == "MOD"


def test_in_mode_2_a_fence_asks_for_what_no_state_forbids_if_the_question_in_doubt_may_be_forbidden() -> None:
    for question, fence in ((GetSpeedPercent(), "VER"), (GetCommunicationMode(), "VAR")):
        it = Bench(mode=2)
        it.submit(question, Lane.READ)
        it.write()
        it.session.pass_deadlines(1.0, None)
        assert it.write() == "POF 2"
        assert it.write().startswith(fence)


def test_in_mode_2_a_copy_of_the_answer_to_a_fence_is_not_taken_for_a_fresh_one() -> None:
    it = Bench(mode=2)
    it.submit(GetSpeedPercent(), Lane.READ)
    assert it.write() == "VAO"
    it.session.pass_deadlines(1.0, None)
    assert it.write() == "POF 2"
    it.pass_fence()
    again = it.session.exchange(GetSystemVersion(), Lane.READ)
    again.fresh = True
    it.wait_for(again)
    it.session.submit(again)
    it.pass_fence()
    assert it.write() == "VER"


def test_an_attempt_that_was_not_completed_leaves_nothing_behind() -> None:
    it = Bench()
    download = it.submit(DownloadPositions(first=1, count=2), Lane.READ)
    outcome = it.wait_for(download)
    assert it.write() == "POR 1,2"
    it.hear(QueryAnswer("POS", "1,"))
    it.session.pass_deadlines(1.0, None)
    it.pass_fence()
    assert it.write() == "POR 1,2", "it is repeated"
    it.hear(QueryAnswer("POS", "2,"), Completion("POE"))
    assert outcome.result() == RobotAnswered((StoredPosition(coordinates=[2.0, None]),))


def test_what_moves_nothing_is_not_said_to_have_moved_when_the_port_goes() -> None:
    def told(command: FicsCommand[Reply]) -> tuple[str, bool]:
        it = Bench()
        outcome = it.wait_for(it.submit(command))
        it.write()
        it.session.break_off(NoReply("The port has gone."), Cancelled("The port has gone."))
        lost = outcome.result()
        assert isinstance(lost, NoReply)
        return lost.moved, lost.retryable

    assert told(GetAxisStatus()) == ("no", True)
    assert told(SetSmoothAcceleration(enabled=1)) == ("no", False)
    assert told(MoveRelative(coordinates=[1.0])) == ("unknown", False)


def test_what_was_admitted_before_everything_was_revoked_is_not_written_and_stops_are_not_counted() -> None:
    it = Bench()
    it.submit(GetAxisStatus(), Lane.READ)
    it.write()
    waiting = it.submit(SwitchOutput(channel=1, bit=1, on=True))
    epoch = it.session.gate.epoch(ROBOT)
    it.session.revoke(HeldUp)
    assert waiting not in it.session.scheduler.exchanges(Lane.COMMAND)
    it.hear(AT_REST)
    assert it.session.next(0.0, ready=True) is None
    late = it.session.exchange(SwitchOutput(channel=1, bit=1, on=True), Lane.COMMAND)
    late.epoch = epoch
    it.session.submit(late)
    assert it.session.next(0.0, ready=True) is None
    assert isinstance(it.session.gate.overtaken(ROBOT), HeldUp)
    assert it.session.gate.stops(ROBOT) == 0
    it.session.begin_stop()
    assert isinstance(it.session.gate.overtaken(ROBOT), StoppedFirst)
    assert it.session.gate.stops(ROBOT) == 1


def test_a_fence_that_is_wanted_goes_first() -> None:
    it = Bench()
    it.submit(GetAxisStatus(), Lane.READ)
    it.session.fence()
    it.pass_fence()
    assert it.write() == "ACD"


def test_a_late_refusal_of_a_fence_is_not_credited_to_the_query_in_doubt() -> None:
    it = Bench()
    asked = it.submit(GetVariable(number=16), Lane.READ)
    assert it.write() == "VAR V16"
    it.session.pass_deadlines(1.0, None)
    assert it.write(1.0).startswith("VAR V")
    it.session.pass_deadlines(2.0, None)
    assert it.write(2.0).startswith("VAR V")
    it.session.pass_deadlines(3.0, None)
    assert it.write(3.0) == "VER"
    it.hear(FicsRefusal("VAR", "E06"))  # to one of three
    assert asked.reply.late is None


def test_a_robot_that_only_refuses_fences_is_not_called_back() -> None:
    it, silences = Bench(), list[float]()
    now = 0.0
    it.session.on_silence = lambda: silences.append(now)
    for _ in range(2):
        it.session.put_first(it.session.exchange(GetAxisStatus(), Lane.COMMAND, SET_UP))
        while (exchange := it.session.next(now, ready=False)) is not None:
            it.session.written(exchange, now, now + exchange.reply.timeout_s)
            now += 1.0
            if exchange.command.wire_name() in FENCES:
                it.hear(FicsRefusal(exchange.command.wire_name(), "E01"))
            it.session.pass_deadlines(now, None)
    assert len(silences) == 1
    assert not it.session.online


def test_late_answers_that_contradict_each_other_leave_a_doubt_and_of_one_kind_the_last_counts() -> None:
    for frames, kind in (
        ([FicsRefusal("ACD", "E01"), AT_REST], GarbledReply),
        ([FicsRefusal("ACD", "E01"), FicsRefusal("ACD", "E03")], FicsRefusal),
    ):
        it = Bench()
        outcome = it.wait_for(it.submit(GetAxisStatus(), Lane.READ))
        it.write()
        it.session.pass_deadlines(1.0, None)
        text = it.write(1.0)
        it.hear(*frames, QueryAnswer("VAR", f"{text[4:]}=+1"))
        assert isinstance(outcome.result(), kind)


def test_the_answer_to_a_motion_that_was_followed_by_another_is_not_awaited_any_more() -> None:
    it = Bench()
    for distance in (1.0, 2.0):
        it.submit(MoveRelative(coordinates=[distance]))
        text = it.write()
        if text.startswith("VAR"):
            it.hear(QueryAnswer("VAR", f"{text[4:]}=+1"))
            text = it.write()
        assert text == f"LMI {distance:g}"
    assert [one.command for one in it.session.sent] == [MoveRelative(coordinates=[2.0])]


def test_a_robot_that_does_not_answer_is_told_with_its_remedy_in_both_languages() -> None:
    error = offline_error("r1")
    assert (error.detail, error.remedy.isascii()) == (
        "Robot r1 gives no usable answer; nothing was sent.",
        True,
    )
    assert "応答がありません" in error.detail_ja
    assert "ケーブル" in error.remedy_ja


BEGIN, POSITION, END = BeginPositionUpload(first=1), UploadPosition(coordinates=[1.0]), EndPositionUpload()
COMMANDS = (BEGIN, POSITION, END, TakeCurrentError(), GetUnit(), GetSystemVersion())


def opened() -> UploadState:
    it = UploadState()
    it.note_written(BEGIN, 1, silent=False)
    return it


def refusal(error: str) -> FicsRefusal:
    return FicsRefusal("POF", error)


def test_an_upload_is_open_from_the_frame_that_begins_it_until_its_end_is_taken() -> None:
    it = UploadState()
    assert not it.may_be_open
    it.note_written(BEGIN, 1, silent=False)
    assert it.is_open
    it.note_outcome(POSITION, 2, RobotAnswered())
    assert it.is_open
    it.note_outcome(END, 3, RobotAnswered())
    assert not it.may_be_open


def test_an_end_in_mode_2_may_not_have_been_heard() -> None:
    it = UploadState()
    it.note_written(BEGIN, 1, silent=True)
    it.note_written(END, 2, silent=True)
    assert (it.is_open, it.may_be_open) == (False, True)
    it.note_outcome(GetUnit(), 3, RobotAnswered())
    assert not it.may_be_open


@pytest.mark.parametrize(
    ("command", "error", "is_open"),
    [(BEGIN, "E03", True), (BEGIN, "E05", False), (END, "E03", True), (END, "E08", False)],
)
def test_a_refusal_of_its_beginning_or_its_end_tells_whether_it_is_open(
    command: FicsCommand[Any], error: str, is_open: bool
) -> None:
    it = opened()
    it.note_outcome(command, 2, refusal(error))
    assert it.is_open is is_open


def test_only_what_was_written_after_its_beginning_proves_its_end() -> None:
    it = UploadState()
    it.note_written(BEGIN, 5, silent=False)
    it.note_outcome(GetUnit(), 4, RobotAnswered())
    assert it.is_open
    it.note_outcome(GetUnit(), 6, RobotAnswered())
    assert not it.is_open


@pytest.mark.parametrize(
    ("command", "error", "doubtful"),
    [
        (SetVariable(number=1, value=2.0), "E03", True),
        (SetVariable(number=1, value=2.0), "E01", False),
        (POSITION, "E03", False),
        (GetUnit(), "E03", False),  # the teaching terminal explains it
    ],
)
def test_a_refusal_that_nothing_else_explains_is_that_of_an_upload(
    command: FicsCommand[Any], error: str, doubtful: bool
) -> None:
    it = UploadState()
    assert it.note_outcome(command, 1, refusal(error)) is doubtful
    assert it.is_open is doubtful


def test_a_fence_in_doubt_is_preceded_by_the_end_of_an_upload_at_each_try() -> None:
    it = opened()
    it.begin_fence(in_doubt=True)
    assert [it.must_end_before(n, mode=3) for n in (0, 0, 1, 1, 2)] == [True, False, True, False, True]


@pytest.mark.parametrize(("mode", "tries"), [(3, [False, False]), (2, [False, True])])
def test_a_fence_without_a_doubt_ends_no_upload_before_it_fails(mode: int, tries: list[bool]) -> None:
    it = UploadState()
    it.begin_fence(in_doubt=False)
    assert [it.must_end_before(n, mode) for n in (0, 1)] == tries


def test_a_fence_ends_a_known_upload_in_any_case() -> None:
    it = opened()
    it.begin_fence(in_doubt=False)
    assert it.must_end_before(0, mode=3)


@given(
    st.lists(st.tuples(st.sampled_from(COMMANDS), st.booleans(), st.sampled_from(["", "E01", "E03", "E08"])))
)
def test_after_the_end_was_taken_no_upload_is_open(
    deeds: list[tuple[FicsCommand[Any], bool, str]],
) -> None:
    it = UploadState()
    for number, (command, silent, error) in enumerate(deeds, 1):
        it.note_written(command, number, silent=silent)
        it.note_outcome(command, number, refusal(error) if error else RobotAnswered())
        assert it.may_be_open or not it.is_open
    it.note_outcome(END, len(deeds) + 1, RobotAnswered())
    assert not it.may_be_open
