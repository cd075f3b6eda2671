"""The lines that one exchange with a robot takes for its own, and the callers that hear of it."""

import asyncio

import pytest

from gateway.core.exchange import Lane, More
from gateway.fics.exchange import FicsExchange, ReplyFrame, RobotAnswered
from protocols.fics.link import Completion, FicsRefusal, QueryAnswer, SystemFailure, encode
from protocols.fics.moves import MoveRelative, MoveToPosition
from protocols.fics.positions import DownloadPositions, StoredPosition
from protocols.fics.row import FicsCommand
from protocols.fics.variables import GetVariable, VariableValue
from protocols.table import Reply
from tests.gateway.rorze.far_end import virtual

MOVE = MoveRelative(coordinates=[1.0])
QUERY = GetVariable(number=5)
DOWNLOAD = DownloadPositions(first=1, count=2)


def exchange(command: FicsCommand[Reply]) -> FicsExchange:
    return FicsExchange(command, encode(command), Lane.COMMAND)


def stored(place: float) -> StoredPosition:
    return StoredPosition(coordinates=[place, None])


def test_a_query_is_over_with_its_one_reply() -> None:
    outcome = exchange(QUERY).credit(QueryAnswer("VAR", "V05=+1"))
    assert outcome == RobotAnswered((VariableValue(number=5, value=1.0),))


def test_a_deed_is_over_with_its_bare_name() -> None:
    assert exchange(MOVE).credit(Completion("LMI")) == RobotAnswered()


@pytest.mark.parametrize("frame", [FicsRefusal("LMI", "E07"), SystemFailure("LMI", "183")])
def test_a_refusal_and_a_failure_are_told_as_they_are(frame: ReplyFrame) -> None:
    assert exchange(MOVE).credit(frame) is frame


@pytest.mark.parametrize(
    "frame",
    [Completion("LMA"), FicsRefusal("LMA", "E07"), QueryAnswer("LMI", "1")],
    ids=repr,
)
def test_what_is_for_another_command_is_not_taken(frame: ReplyFrame) -> None:
    assert exchange(MOVE).credit(frame) is None


def test_a_download_is_over_when_its_end_is_heard_and_not_with_its_first_position() -> None:
    download = exchange(DOWNLOAD)
    assert download.credit(QueryAnswer("POS", "1,")) is More.MORE
    assert download.credit(QueryAnswer("POS", "2,")) is More.MORE
    assert download.credit(Completion("POR")) is None
    assert download.credit(Completion("POE")) == RobotAnswered((stored(1.0), stored(2.0)))


def test_answers_keep_their_texts_as_they_came() -> None:
    answered, done, download = exchange(QUERY), exchange(MOVE), exchange(DOWNLOAD)
    outcome = answered.credit(QueryAnswer("VAR", "V05=1.00"))
    assert isinstance(outcome, RobotAnswered)
    assert outcome.texts == ("V05=1.00",)
    outcome = done.credit(Completion("LMI"))
    assert isinstance(outcome, RobotAnswered)
    assert outcome.texts == ("",)
    download.credit(QueryAnswer("POS", "1.00,"))
    outcome = download.credit(Completion("POE"))
    assert isinstance(outcome, RobotAnswered)
    assert outcome.texts == ("1.00,",)


@virtual
async def test_who_waits_is_told_once_and_who_has_gone_is_not() -> None:
    patient, gone, alone = exchange(MOVE), exchange(MOVE), exchange(MOVE)
    loop = asyncio.get_running_loop()
    told, cancelled = (loop.create_future() for _ in range(2))
    patient.waiters[told] = patient.expires_at
    gone.waiters[cancelled] = gone.expires_at
    cancelled.cancel()
    for one in (patient, gone, alone):
        one.settle(RobotAnswered())
        one.settle(RobotAnswered(confirmed=False))
    assert await told == RobotAnswered(confirmed=True)
    assert cancelled.cancelled()


def test_a_failure_that_reads_as_its_command_may_be_an_echo_and_counts_for_nothing() -> None:
    move = exchange(MoveToPosition(position=183))
    assert move.credit(SystemFailure("POM", "183")) is None
    assert move.credit(SystemFailure("POM", "002")) == SystemFailure("POM", "002")
