"""Records of long work outlive the gateway: what it has cut off is told, what is over stays as it was."""

from collections.abc import Callable
from datetime import UTC, datetime
from operator import attrgetter

import pytest

from gateway.core.kept_works import DurableJobs
from gateway.core.records import Record
from gateway.core.works import CutOff

BEGUN = datetime(2026, 1, 1, tzinfo=UTC)


class Chore(Record):
    id: str
    of: str = "a"
    said: str = ""
    started_at: datetime = BEGUN
    ended_at: datetime | None = None


class Chores(DurableJobs[Chore]):
    record_type = Chore

    def __init__(self, publish: Callable[[str, Chore], None], history: int = 10) -> None:
        super().__init__(history, "chore", attrgetter("of"), publish)

    def note_cut_off(self, record: Chore, why: CutOff, /) -> None:
        record.said, record.ended_at = f"cut off by {why.kind}", BEGUN
        self.tell("failed", record)


def chores(history: int = 10) -> tuple[Chores, list[str]]:
    told: list[str] = []
    of = Chores(lambda what, chore: told.append(f"{what} {chore.id}"), history)
    of.on_change = lambda chore: told.append(f"kept {chore.id} {chore.said}".rstrip())
    return of, told


def test_what_is_told_is_kept_first() -> None:
    of, told = chores()
    of.tell("started", Chore(id="1"))
    assert told == ["kept 1", "started 1"]


def test_what_was_not_over_was_cut_off_and_the_rest_stays_as_it_was() -> None:
    of, told = chores()
    over = Chore(id="1", said="done", ended_at=BEGUN)
    of.resume([over.model_dump_json(), Chore(id="2").model_dump_json()])
    assert of.find("a", "1") == over
    assert of.find("a") == Chore(id="2", said="cut off by gateway-ended", ended_at=BEGUN)
    assert told == ["kept 2 cut off by gateway-ended", "failed 2"]


def test_no_more_is_remembered_than_one_life_keeps() -> None:
    of, _ = chores(history=2)
    of.resume(Chore(id=str(number), ended_at=BEGUN).model_dump_json() for number in range(5))
    assert [number for number in range(5) if of.find("a", str(number))] == [3, 4]


def test_a_record_that_cannot_be_read_is_forgotten_with_a_word(caplog: pytest.LogCaptureFixture) -> None:
    of, told = chores()
    of.resume(['{"id": 1}', Chore(id="2", ended_at=BEGUN).model_dump_json()])
    assert of.find("a", "2") is not None
    assert told == []
    assert "a chore of an earlier life cannot be read, and is forgotten: '{\"id\": 1}'" in caplog.text
