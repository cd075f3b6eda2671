import asyncio
from types import MappingProxyType

import pytest

from gateway.core.errors import NoReply
from gateway.core.exchange import Lane
from gateway.core.scheduler import is_abandoned
from gateway.rorze.session import Answered
from protocols.rorze.link import Answer, GroupAnswer, Refusal
from protocols.rorze.moves import MoveClockwise
from protocols.rorze.notation import PositionReference
from protocols.rorze.position import GetPosition, SignedPulses
from protocols.rorze.position_table import GetNumberedPositionEntry, GetPositionEntry
from protocols.table import Ack
from tests.gateway.rorze.exchanges import exchange, waiting
from tests.gateway.rorze.far_end import virtual

MOVE = MoveClockwise(distance=500)


def test_lanes_are_in_the_order_of_urgency() -> None:
    urgency = [Lane.STOP, Lane.VERIFY, Lane.COMMAND, Lane.STOP_REPEAT, Lane.READ, Lane.BACKGROUND]
    assert sorted(Lane) == urgency


def test_an_answer_is_credited_with_the_time_it_came() -> None:
    outcome = exchange(GetPosition()).credit(Answer(2, "6PD", "-000000012"), 3.5)
    assert outcome == Answered({2: SignedPulses(pulses=-12)}, 3.5, late=False)


@pytest.mark.parametrize(
    "frame",
    [
        Answer(3, "6PD", "+000000012"),
        Answer(2, "6MD", "+000000012"),
        Answer(2, "6PD", "+00000012"),
        Answer(2, "6PD", ""),
        Refusal(3, "6PD", 0x50),
        Refusal(2, "6PS", 0x50),
        GroupAnswer(0x80, "6PD", MappingProxyType({2: Answer(2, "6PD", "+000000012")})),
    ],
)
def test_anything_else_is_not_credited(frame: Answer | Refusal | GroupAnswer) -> None:
    assert exchange(GetPosition()).credit(frame, 0.0) is None


def test_a_refusal_of_this_command_is_credited_as_it_is() -> None:
    refusal = Refusal(2, "1+M", None)
    assert exchange(MOVE).credit(refusal, 0.0) is refusal


def test_a_repeated_field_must_be_the_one_that_was_asked_for() -> None:
    asked = exchange(GetNumberedPositionEntry(entry=PositionReference(position=25)))
    assert asked.credit(Answer(2, "3ND", "P[0026],+000000050"), 0.0) is None
    assert asked.credit(Answer(2, "3ND", "P[0025],+000000050"), 0.0) is not None


def test_each_member_of_a_group_has_its_own_reply_or_refusal() -> None:
    members: dict[int, Answer | Refusal] = {2: Answer(2, "1+M", ""), 3: Refusal(3, "1+M", 0x51)}
    outcome = exchange(MOVE, body=0x80).credit(GroupAnswer(0x80, "1+M", members), 1.0)
    assert outcome == Answered({2: Ack(), 3: Refusal(3, "1+M", 0x51)}, 1.0)


def test_one_member_with_nonsense_spoils_the_group_reply() -> None:
    members = {2: Answer(2, "1+M", ""), 3: Answer(3, "1+M", "5")}
    assert exchange(MOVE, body=0x80).credit(GroupAnswer(0x80, "1+M", members), 1.0) is None


def test_only_equal_repeatable_reads_share_a_trip() -> None:
    next_entry = GetPositionEntry(entry=PositionReference(position="next"))
    assert exchange(GetPosition()).shares(exchange(GetPosition()))
    assert not exchange(GetPosition()).shares(exchange(GetPosition(), body=3))
    assert not exchange(GetPosition()).shares(exchange(GetPosition(), lane=Lane.COMMAND))
    assert not exchange(GetPosition()).shares(exchange(GetPosition(), lane=Lane.VERIFY))
    assert exchange(GetPosition(), lane=Lane.VERIFY).shares(exchange(GetPosition(), lane=Lane.VERIFY))
    assert exchange(GetPosition()).shares(exchange(GetPosition(), expires_at=5.0))
    assert not exchange(GetPosition()).shares(exchange(GetPosition(), on_written=lambda _: None))
    assert not exchange(next_entry).shares(exchange(next_entry))
    assert not exchange(MOVE).shares(exchange(MOVE))


@virtual
async def test_settling_tells_everybody_who_still_waits_and_nobody_twice() -> None:
    loop = asyncio.get_running_loop()
    asked = exchange(GetPosition())
    patient, gone, told = (waiting(asked, loop) for _ in range(3))
    gone.cancel()
    earlier = NoReply("Told by somebody else.")
    told.set_result(earlier)
    outcome = Answered({2: SignedPulses(pulses=1)}, 0.0)
    asked.settle(outcome)
    asked.settle(NoReply("Too late."))
    assert patient.result() is outcome
    assert gone.cancelled()
    assert told.result() is earlier


@virtual
async def test_only_a_read_is_abandoned_and_only_when_all_have_gone() -> None:
    loop = asyncio.get_running_loop()
    read, move = exchange(GetPosition()), exchange(MOVE)
    first, second = waiting(read, loop), waiting(read, loop)
    waiting(move, loop).cancel()
    assert not is_abandoned(read)
    first.cancel()
    assert not is_abandoned(read)
    second.cancel()
    assert is_abandoned(read)
    assert not is_abandoned(move)
