from datetime import timedelta
from pathlib import Path
from random import Random

import pytest

from tests.transports.far_ends import Ear
from transports import Receiver, Transport, TransportLost
from transports.recorder import BLOCK, OPENING, RECORD_BYTES, History, Recorded, Recorder
from transports.trace import Record, TraceEntry
from transports.trace_file import TraceFile


class LoopBack(Transport):
    """A port in memory that hears itself."""

    receiver: Receiver | None = None
    waiting = 0
    byte_time_s = 0.001
    is_bridged = True

    async def open(self, receiver: Receiver) -> None:
        self.receiver = receiver

    def write(self, data: bytes) -> None:
        if self.receiver is None:
            raise TransportLost("loop is not open; nothing was sent.")
        self.waiting += len(data)
        self.receiver.data_received(data)

    def unsent(self) -> int:
        return self.waiting

    async def close(self) -> None:
        self.receiver = None


def test_memory_keeps_the_newest_records_oldest_first() -> None:
    recorder = Recorder(capacity=3)
    for data in (b"1", b"2", b"3", b"4", b"5"):
        recorder.record("rx", data)
    assert [entry.data for entry in recorder.entries()] == [b"3", b"4", b"5"]
    assert [entry.data for entry in recorder.entries(last=2)] == [b"4", b"5"]
    assert [entry.data for entry in recorder.entries(last=99)] == [b"3", b"4", b"5"]
    assert recorder.entries(last=0) == []
    assert recorder.dropped == 0


def test_entries_are_found_by_their_time(monkeypatch: pytest.MonkeyPatch) -> None:
    times = iter(range(1_790_000_000_000_000_999, 1_790_000_000_000_009_999, 1000))
    monkeypatch.setattr("transports.recorder.time.time_ns", lambda: next(times))
    recorder = Recorder()
    for data in (b"1", b"2", b"3"):
        recorder.record("tx", data)
    second = recorder.entries()[1]
    assert [entry.data for entry in recorder.entries(since=second.at)] == [b"2", b"3"]
    assert [entry.data for entry in recorder.entries(last=1, since=second.at)] == [b"3"]
    assert recorder.entries(since=second.at + timedelta(microseconds=2)) == []


def test_a_flood_is_cut_into_records_of_bounded_size() -> None:
    flood = bytes(range(256)) * 10
    recorder = Recorder()
    recorder.record("rx", flood)
    entries = recorder.entries()
    assert [len(entry.data) for entry in entries] == [RECORD_BYTES] * 5
    assert b"".join(entry.data for entry in entries) == flood


def test_the_file_holds_what_memory_has_forgotten(tmp_path: Path) -> None:
    path = tmp_path / "line.jsonl"
    recorder = Recorder(capacity=1, file=TraceFile(path))
    recorder.record("opened")
    recorder.record("tx", b"&3F6PD\r")
    recorder.close()
    entries = [TraceEntry.model_validate_json(line) for line in path.read_bytes().splitlines()]
    assert [(entry.kind, entry.data) for entry in entries] == [("opened", b""), ("tx", b"&3F6PD\r")]
    assert entries[1:] == recorder.entries()


def test_what_the_file_has_lost_is_counted() -> None:
    recorder = Recorder(file=TraceFile(Path("/dev/full")))
    recorder.record("opened")
    recorder.close()
    assert recorder.dropped == 1
    assert len(recorder.entries()) == 1


def story(recorder: Recorder) -> list[tuple[str, bytes]]:
    return [(entry.kind, entry.data) for entry in recorder.entries()]


@pytest.mark.anyio
async def test_a_recorded_port_tells_its_whole_story() -> None:
    recorder, ear, loop = Recorder(), Ear(), LoopBack("loop")
    port = Recorded(loop, recorder)
    await port.open(ear)
    port.write(b"&3F6PD\r")
    assert (port.address, port.byte_time_s, port.is_bridged, port.unsent()) == ("loop", 0.001, True, 7)
    await port.close()
    await port.close()
    assert ear.heard == b"&3F6PD\r"
    assert story(recorder) == [("opened", b""), ("rx", b"&3F6PD\r"), ("tx", b"&3F6PD\r"), ("closed", b"")]


@pytest.mark.anyio
async def test_what_is_sent_has_its_sender_and_nothing_else_has(tmp_path: Path) -> None:
    path = tmp_path / "line.jsonl"
    recorder = Recorder(file=TraceFile(path))
    port = Recorded(LoopBack("loop"), recorder)
    await port.open(Ear())
    recorder.sender = "http 10.0.0.1", "job-17"
    port.write(b"&3F6PD\r")
    recorder.sender = "gateway: poll", None
    port.write(bytes(RECORD_BYTES + 1))
    recorder.close()
    senders = [(entry.caller, entry.request_id) for entry in recorder.entries() if entry.kind == "tx"]
    assert senders == [("http 10.0.0.1", "job-17"), ("gateway: poll", None), ("gateway: poll", None)]
    assert {entry.caller for entry in recorder.entries() if entry.kind != "tx"} == {None}
    written = [TraceEntry.model_validate_json(line) for line in path.read_bytes().splitlines()]
    assert written == recorder.entries()
    assert b"caller" not in path.read_bytes().splitlines()[0]


@pytest.mark.anyio
async def test_a_loss_is_recorded_and_passed_on_and_closing_afterwards_is_not() -> None:
    recorder, ear, loop = Recorder(), Ear(), LoopBack("loop")
    port = Recorded(loop, recorder)
    await port.open(ear)
    loss = TransportLost("unplugged")
    port.connection_lost(loss)
    await port.close()
    assert ear.losses == [loss]
    assert story(recorder) == [("opened", b""), ("lost", b"")]


@pytest.mark.anyio
async def test_bytes_that_the_port_refuses_are_not_recorded_as_sent() -> None:
    recorder = Recorder()
    with pytest.raises(TransportLost):
        Recorded(LoopBack("loop"), recorder).write(b"&3F1+M\r")
    assert story(recorder) == []


def test_records_are_followed_by_their_number() -> None:
    recorder = Recorder(capacity=3)
    assert recorder.after(0) == (1, [])
    for data in (b"1", b"2"):
        recorder.record("rx", data)
    first, records = recorder.after(1)
    assert (first, [record[3] for record in records]) == (2, [b"2"])
    for data in (b"3", b"4", b"5"):
        recorder.record("rx", data)
    first, records = recorder.after(1)
    assert (recorder.recorded, first, [record[3] for record in records]) == (5, 3, [b"3", b"4", b"5"])
    assert recorder.after(5) == (6, [])


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
