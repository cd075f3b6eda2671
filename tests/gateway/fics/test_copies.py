"""A copy of an answer is never taken for the answer to something else."""

import pytest

from gateway.core.exchange import Lane
from gateway.fics.errors import NotDone
from gateway.fics.exchange import ROBOT, FicsExchange, ReplyFrame
from gateway.fics.session import REPLIES_REMEMBERED, FicsSession
from protocols.fics.alarms import TakeCurrentError
from protocols.fics.commands import ROWS
from protocols.fics.inputs_outputs import GetInputChannel, GetOutputChannel, SwitchOutput
from protocols.fics.jog import StartJog, StopJog
from protocols.fics.link import Completion, FicsRefusal, QueryAnswer, SystemFailure
from protocols.fics.positions import DownloadPositions, UploadPosition
from protocols.fics.row import FicsCommand
from protocols.fics.speeds import GetAccelerationTimes, GetSpeedPercent, SetAccelerationTimes, SetSpeedPercent
from protocols.fics.status import GetAxisStatus
from protocols.fics.stops import StopAllImmediately
from protocols.fics.system import GetUnit, SelectUnit
from protocols.fics.variables import GetVariable, SetVariable
from protocols.table import Reply
from tests.fics_plants import fics_rig
from tests.plants import in_virtual_time

LATE_S = 2.0
BITS = QueryAnswer("IDI", "0F")
AT_REST = QueryAnswer("ACD", "0300")
Command = FicsCommand[Reply]


class Wire:
    """A session in Ver.3, or a silent one, to which things are written and answered by hand."""

    def __init__(self, mode: int = 3) -> None:
        self.session = FicsSession("r1", late_reply_s=LATE_S)
        self.session.mode = mode

    def write(self, command: Command, at: float = 0.0) -> FicsExchange:
        exchange = self.session.exchange(command, Lane.COMMAND)
        self.session.written(exchange, at, at)
        return exchange

    def may_answer(self, command: Command, at: float, *, fresh: bool = False) -> bool:
        exchange = self.session.exchange(command, Lane.READ)
        exchange.fresh = fresh
        return self.session._could_get_a_copy(exchange, at)


def told(command: Command, frame: ReplyFrame, at: float = 0.0) -> Wire:
    wire = Wire()
    wire.session.note_reply(wire.write(command, at), frame, at)
    return wire


@pytest.mark.parametrize(
    ("before", "frame", "after"),
    [
        (GetInputChannel(channel=1), BITS, GetInputChannel(channel=2)),
        (GetOutputChannel(channel=1), QueryAnswer("IDO", "00"), GetOutputChannel(channel=2)),
        (
            DownloadPositions(first=1, count=1),
            QueryAnswer("POS", "1,2,3"),
            DownloadPositions(first=2, count=1),
        ),
        (DownloadPositions(first=1, count=1), Completion("POE"), DownloadPositions(first=2, count=1)),
        (
            SwitchOutput(channel=1, bit=0, on=True),
            Completion("IOT"),
            SwitchOutput(channel=1, bit=0, on=False),
        ),
        (SwitchOutput(channel=1, bit=0, on=True), Completion("IOT"), SwitchOutput(channel=1, bit=0, on=True)),
        (StopJog(axis="X"), Completion("JOG"), StartJog(axis="Y", direction="+")),
        (GetVariable(number=1), FicsRefusal("VAR", "E01"), GetVariable(number=2)),
        (GetAxisStatus(), FicsRefusal("ACD", "E03"), GetAxisStatus()),
        (SetSpeedPercent(percents=[1.0]), SystemFailure("VAO", "183"), GetSpeedPercent()),
        (TakeCurrentError(), QueryAnswer("ERR", "E01"), TakeCurrentError()),
        (GetAccelerationTimes(), QueryAnswer("VST", "100"), SetAccelerationTimes(times_ms=[200])),
    ],
)
def test_what_a_copy_could_answer_is_kept_apart(before: Command, frame: ReplyFrame, after: Command) -> None:
    assert told(before, frame).may_answer(after, LATE_S - 0.1)


@pytest.mark.parametrize(
    ("before", "frame", "after"),
    [
        (GetInputChannel(channel=1), BITS, GetInputChannel(channel=1)),
        (GetInputChannel(channel=1), BITS, GetOutputChannel(channel=1)),
        (GetVariable(number=1), QueryAnswer("VAR", "V01=+1"), GetVariable(number=2)),
        (SetSpeedPercent(percents=[1.0]), Completion("VAO"), GetSpeedPercent()),
        (GetSpeedPercent(), QueryAnswer("VAO", "1,2"), SetSpeedPercent(percents=[1.0])),
        (SelectUnit(unit=1), Completion("UNT"), GetUnit()),
        (UploadPosition(coordinates=[1.0]), Completion("POS"), DownloadPositions(first=1, count=1)),
    ],
)
def test_what_no_copy_could_answer_needs_no_fence(before: Command, frame: ReplyFrame, after: Command) -> None:
    assert not told(before, frame).may_answer(after, 0.0)


def test_no_copy_comes_after_a_fence_or_later_than_any_reply() -> None:
    copies = told(GetInputChannel(channel=1), BITS)
    other = GetInputChannel(channel=2)
    assert copies.may_answer(other, LATE_S - 0.001)
    assert not copies.may_answer(other, LATE_S)
    copies = told(GetInputChannel(channel=1), BITS)
    copies.session._copies.forget(ROBOT)
    assert not copies.may_answer(other, 0.0)


def test_every_name_is_remembered_not_just_the_last() -> None:
    copies = told(SwitchOutput(channel=1, bit=0, on=True), Completion("IOT"))
    between = copies.write(SetSpeedPercent(percents=[1.0]), 0.1)
    copies.session.note_reply(between, Completion("VAO"), 0.1)
    assert copies.may_answer(SwitchOutput(channel=1, bit=1, on=True), 0.2)


def test_an_answer_that_has_not_come_may_come_at_any_time() -> None:
    copies = Wire()
    copies.write(StopJog(axis="X"))
    assert copies.may_answer(StartJog(axis="Y", direction="+"), 1000.0)


def test_a_reading_is_outdated_by_a_deed_and_copies_of_what_has_to_be_fresh_are_kept_apart() -> None:
    copies = told(GetAxisStatus(), AT_REST)
    assert not copies.may_answer(GetAxisStatus(), 0.0)
    assert copies.may_answer(GetAxisStatus(), 0.0, fresh=True)
    copies.session.mode = 2
    copies.write(SwitchOutput(channel=1, bit=0, on=True))
    assert copies.may_answer(GetAxisStatus(), 0.0)


def test_a_reading_that_was_asked_for_before_a_deed_is_outdated_though_it_came_after_it() -> None:
    copies = Wire()
    asked = copies.write(GetAxisStatus())
    copies.write(StopAllImmediately(), 0.1)
    copies.session.note_reply(asked, AT_REST, 0.2)
    assert copies.may_answer(GetAxisStatus(), 0.3)


def test_answers_that_can_come_no_more_take_no_room() -> None:
    copies = Wire()
    most = REPLIES_REMEMBERED
    for number in range(2 * most):
        position = copies.session.exchange(UploadPosition(coordinates=[float(number)]), Lane.COMMAND)
        copies.session.note_reply(position, Completion("POS"), 0.01 * number)
    assert len(copies.session._copies._said[ROBOT]["POS"]) <= most


def test_the_questions_whose_answers_do_not_tell_which_was_asked() -> None:
    mute = {row for row in ROWS if row.is_query() and row.model_fields and not row.is_told_apart()}
    assert mute == {GetInputChannel, GetOutputChannel, DownloadPositions}


@in_virtual_time
async def test_doubled_answers_never_tell_the_bits_of_another_channel() -> None:
    async with fics_rig() as rig:
        rig.fics.inputs[:] = [0x11, 0x22, 0x33, 0x44]
        read = []
        for channel, bits in enumerate(rig.fics.inputs, 1):
            reply = await rig.robot.read(GetInputChannel(channel=channel))
            read.append(reply.bits)
            rig.cable.copies.append(f"IDI {bits:02X}\r".encode())
        assert read == [0x11, 0x22, 0x33, 0x44]


@in_virtual_time
async def test_a_doubled_acknowledgement_does_not_count_for_a_later_command_of_that_name() -> None:
    async with fics_rig() as rig:
        await rig.robot.ask(SwitchOutput(channel=1, bit=0, on=True))
        await rig.robot.ask(SetVariable(number=1, value=1.0))
        rig.cable.copies.append(b"IOT\r")
        rig.cable.lost_command = "IOT"
        with pytest.raises(NotDone, match="it tells IDO 01"):
            await rig.robot.ask(SwitchOutput(channel=1, bit=1, on=True))
        assert rig.fics.outputs[0] == 1
