"""The packed history of a line: newest first to stay, found by number and by time."""

from random import Random

import pytest

from transports.history import BLOCK, History
from transports.recorder import OPENING, Recorder
from transports.trace import Record

MS = 1_000_000


def told(count: int, begin: int = 0) -> list[Record]:
    dice = Random(begin)
    return [
        (at * MS, at * MS, "rx", dice.randbytes(40), None, None) for at in range(begin + 1, begin + count + 1)
    ]


def filled(count: int, most_bytes: int = 1 << 20) -> History[Record]:
    history: History[Record] = History(most_bytes)
    for record in told(count):
        history.append(record)
    return history


def unpacked(history: History[Record], after: int = 0) -> list[Record]:
    return [
        record
        for piece in history.pieces(after)
        for number, record in enumerate(piece.records(), piece.first)
        if number > after
    ]


@pytest.mark.parametrize("count", [0, 1, BLOCK - 1, BLOCK, BLOCK + 1, 5 * BLOCK + 3])
def test_all_that_is_kept_comes_back_as_it_was(count: int) -> None:
    assert unpacked(filled(count)) == told(count)


@pytest.mark.parametrize("after", [0, 1, BLOCK - 1, BLOCK, 2 * BLOCK, 3 * BLOCK + 4, 3 * BLOCK + 5])
def test_what_came_after_a_number_is_found(after: int) -> None:
    assert unpacked(filled(3 * BLOCK + 5), after) == told(3 * BLOCK + 5)[after:]


def test_the_oldest_go_and_the_bytes_stay_within_their_bound() -> None:
    history = filled(100 * BLOCK, most_bytes=20_000)
    kept = unpacked(history)
    assert kept == told(100 * BLOCK)[history.first - 1 :]
    assert history.first > 1
    assert sum(len(piece.packed) for piece in history.pieces()) <= 20_000


@pytest.mark.parametrize("ms", [0, 1, 2, BLOCK, BLOCK + 1, 2 * BLOCK + 7, 10**6])
def test_a_time_gives_the_number_of_the_last_record_before_it(ms: int) -> None:
    count = 2 * BLOCK + 7
    assert filled(count).before(ms * MS) == min(max(ms - 1, 0), count)


def test_how_the_line_was_set_up_is_kept_until_it_is_opened_again() -> None:
    recorder = Recorder(history_bytes=0)
    recorder.record("tx", b"of another opening")
    recorder.record("opened")
    for _ in range(2 * OPENING):
        recorder.record("tx", b"&3F6PD\r")
    assert [record[2] for record in recorder.opening] == ["opened", *["tx"] * (OPENING - 1)]
