"""What goes next on a robot's line, and which answer belongs to what."""

from random import Random

import pytest

from gateway.errors import Cancelled, Expired, NoReply
from gateway.exchange import Lane
from gateway.fics.conversation import Conversation
from gateway.fics.exchange import Exchange
from protocols.fics.inputs_outputs import SwitchOutput
from protocols.fics.jog import StartJog, StopJog
from protocols.fics.link import Answer, Completion, Refusal
from protocols.fics.moves import MoveRelative
from protocols.fics.positions import BeginPositionUpload, UploadPosition
from protocols.fics.row import FicsCommand
from protocols.fics.status import GetAxisStatus
from protocols.fics.stops import StopAllImmediately
from protocols.fics.variables import GetVariable
from protocols.table import Reply

AT_REST = Answer("ACD", "0300")


class Talk:
    """A conversation in Ver.3, and the pen that writes for it."""

    def __init__(self) -> None:
        self.talk = Conversation("r1", rng=Random(0))
        self.talk.mode = 3

    def submit(self, command: FicsCommand[Reply], lane: Lane = Lane.COMMAND) -> Exchange:
        exchange = self.talk.exchange(command, lane)
        self.talk.submit(exchange)
        return exchange

    def write(self, now: float = 0.0) -> str:
        exchange = self.talk.next(ready=True)
        assert exchange is not None
        self.talk.written(exchange, now, now + exchange.timeout_s)
        return exchange.frame.decode().rstrip("\r")

    def hear(self, *frames: Answer | Completion | Refusal) -> None:
        for frame in frames:
            tell = self.talk.heard(frame, 0.0)
            if tell is not None:
                tell()

    def pass_fence(self) -> None:
        text = self.write()
        assert text.startswith("VAR V")
        self.hear(Answer("VAR", f"{text[4:]}=+1"))


def test_equal_names_are_answered_in_the_order_they_were_written() -> None:
    it = Talk()
    it.submit(StopJog(axis="X"), Lane.STOP)
    it.submit(StartJog(axis="Z", direction="+"))
    assert it.write() == "JOG X"
    it.pass_fence()
    assert it.write() == "JOG Z+"
    it.hear(Completion("JOG"))
    assert [type(one.command) for one in it.talk._under_way()] == [StartJog]
    it.hear(Refusal("JOG", "E07"))
    assert it.talk._under_way() == []


def test_between_equal_deeds_goes_a_fence_and_between_others_none() -> None:
    it = Talk()
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
    it = Talk()
    for _ in range(2):
        it.submit(GetAxisStatus(), Lane.READ)
        assert it.write() == "ACD"
        it.hear(AT_REST)
    it.submit(MoveRelative(coordinates=[1.0]))
    assert it.write() == "LMI 1"
    it.submit(GetAxisStatus(), Lane.READ)
    assert it.talk.next(ready=True) is not None
    assert it.talk.counters["fences"] == 1


def test_a_fence_is_passed_by_its_own_number_only() -> None:
    it = Talk()
    it.submit(GetVariable(number=5), Lane.READ)
    it.write()
    it.talk.pass_deadlines(1.0, None)
    fence = it.write(1.0)
    it.hear(Refusal("VAR", "E06"), Answer("VAR", "V05=+1"))
    assert not it.talk.in_step
    assert it.write(1.0) not in (fence, "VAR V05")


def test_a_fence_never_asks_for_what_somebody_has_asked_for() -> None:
    it = Talk()
    numbers = {it.talk._fresh_variable() for _ in range(100)}
    assert numbers == set(range(100))
    for number in range(0, 100, 2):
        it.submit(GetVariable(number=number), Lane.READ)
        it.write()
        it.hear(Answer("VAR", f"V{number:02d}=+1"))
    assert {it.talk._fresh_variable() for _ in range(50)} == set(range(1, 100, 2))


def test_a_refused_upload_is_none() -> None:
    it = Talk()
    it.submit(BeginPositionUpload(first=1))
    it.write()
    assert it.talk.uploading
    it.hear(Refusal("POF", "E03"))
    assert not it.talk.uploading


def test_the_end_of_an_upload_that_nobody_has_heard_goes_before_the_next_stop() -> None:
    it = Talk()
    it.submit(BeginPositionUpload(first=1))
    it.write()
    it.hear(Completion("POF"))
    it.submit(UploadPosition(coordinates=[1.0]))
    it.write()
    for _ in range(2):
        it.submit(StopAllImmediately(), Lane.STOP)
        assert [it.write(), it.write()] == ["POF 2", "AES"]
        it.talk.pass_deadlines(1.0, None)
    it.submit(StopAllImmediately(), Lane.STOP)
    assert it.write() == "POF 2"
    it.hear(Completion("POF"))
    assert it.write() == "AES"
    it.submit(StopAllImmediately(), Lane.STOP)
    assert it.write() == "AES"


def test_a_stop_refused_as_in_an_upload_is_preceded_by_its_end_if_there_ever_was_one() -> None:
    it = Talk()
    it.talk.doubt_upload()
    it.submit(StopAllImmediately(), Lane.STOP)
    assert it.write() == "AES"
    it.submit(BeginPositionUpload(first=1))
    it.hear(Completion("AES"))
    it.write()
    it.hear(Refusal("POF", "E03"))
    it.talk.doubt_upload()
    it.submit(StopAllImmediately(), Lane.STOP)
    assert [it.write(), it.write()] == ["POF 2", "AES"]


def test_what_waits_can_be_taken_back_and_what_is_written_cannot() -> None:
    it = Talk()
    first = it.submit(MoveRelative(coordinates=[1.0]))
    it.write()
    second = it.submit(MoveRelative(coordinates=[2.0]))
    assert [it.talk.waiting(lane) for lane in Lane] == [0, 1, 0]
    it.talk.withdraw(first, Expired(""))
    it.talk.withdraw(second, Expired(""))
    assert [type(one.command) for one in it.talk._under_way()] == [MoveRelative]
    assert it.talk.next(ready=True) is None


@pytest.mark.parametrize("ready", [True, False])
def test_after_a_loss_of_power_nothing_that_waited_is_written(ready: bool) -> None:
    it = Talk()
    it.submit(MoveRelative(coordinates=[1.0]))
    it.talk.lose_motion(NoReply(""), Cancelled(""))
    assert it.talk.next(ready=ready) is None
