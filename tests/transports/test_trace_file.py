import logging
from io import FileIO
from itertools import pairwise
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from typing_extensions import Buffer

from transports import trace_file
from transports.recorder import RECORD_BYTES
from transports.trace import NOBODY, Record, TraceEntry
from transports.trace_file import FileRing, TraceFile

# A file that opens and always answers "no space left on device".
FULL_DISK = Path("/dev/full")


@given(lines=st.lists(st.binary(max_size=20).map(lambda data: data.hex().encode() + b"\n"), max_size=60))
def test_a_ring_keeps_the_newest_lines_whole_and_never_outgrows_its_bound(
    lines: list[bytes], tmp_path_factory: pytest.TempPathFactory
) -> None:
    path = tmp_path_factory.mktemp("ring") / "trace.jsonl"
    ring = FileRing(path, file_bytes=100, files=3)
    for line in lines:
        ring.append(line)
    ring.close()
    files = [
        file
        for file in (path.with_name("trace.jsonl.2"), path.with_name("trace.jsonl.1"), path)
        if file.exists()
    ]
    assert set(path.parent.iterdir()) == set(files)
    assert all(file.stat().st_size <= 100 for file in files)
    kept = b"".join(file.read_bytes() for file in files)
    assert b"".join(lines).endswith(kept)
    assert kept or not lines


def test_a_ring_goes_on_where_an_earlier_run_ended(tmp_path: Path) -> None:
    path = tmp_path / "traces" / "line.jsonl"
    for line in (b"first\n", b"second\n"):
        ring = FileRing(path, file_bytes=100, files=2)
        ring.append(line)
        ring.close()
    assert path.read_bytes() == b"first\nsecond\n"


@pytest.mark.parametrize(("file_bytes", "files"), [(100, 1), (0, 2)])
def test_a_ring_without_room_is_refused(file_bytes: int, files: int, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="at least 2 files"):
        FileRing(tmp_path / "trace.jsonl", file_bytes, files)


def test_a_line_that_does_not_fit_the_disk_leaves_nothing_of_itself(tmp_path: Path) -> None:
    path = tmp_path / "trace.jsonl"
    ring = FileRing(path, 1000, 2)
    ring.append(b"whole\n")
    assert ring._file is not None
    half_full = _HalfFull(path, "ab")
    ring._file.close()
    ring._file = half_full
    with pytest.raises(OSError, match="No space left"):
        ring.append(b"too much\n")
    assert half_full.closed
    ring.append(b"fits again\n")
    ring.close()
    assert path.read_bytes() == b"whole\nfits again\n"


class _HalfFull(FileIO):
    """A file on a disk with room for four more bytes."""

    room = 4

    def write(self, data: Buffer, /) -> int:
        if not self.room:
            raise OSError(28, "No space left on device")
        written, self.room = super().write(memoryview(data)[: self.room]), 0
        return written


def test_what_is_recorded_is_in_the_file_when_it_is_closed(tmp_path: Path) -> None:
    path = tmp_path / "trace.jsonl"
    file = TraceFile(path)
    for number in range(1000):
        file.put((number, number, "tx", b"&3F6PD\r", *NOBODY))
    file.close()
    entries = [TraceEntry.model_validate_json(line) for line in path.read_bytes().splitlines()]
    assert len(entries) == 1000
    assert all(one.monotonic_ns < other.monotonic_ns for one, other in pairwise(entries))
    assert file.dropped == 0


def test_a_full_disk_costs_records_which_are_counted_and_told_once(caplog: pytest.LogCaptureFixture) -> None:
    file = TraceFile(FULL_DISK)
    for number in range(50):
        file.put((number, number, "rx", b">&3F6PD+000000000\r", *NOBODY))
    file.close()
    assert file.dropped == 50
    assert [record.levelno for record in caplog.records] == [logging.WARNING]
    assert "No space left on device" in caplog.text


def test_a_disk_that_recovers_is_recorded_to_again_and_says_how_much_is_missing(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    path = tmp_path / "traces" / "line.jsonl"
    path.parent.write_text("in the way of the folder")
    file = TraceFile(path)
    file.close()
    file._write((1, 1, "rx", b"lost", *NOBODY))
    file._write((2, 2, "rx", b"lost too", *NOBODY))
    path.parent.unlink()
    file._write((3, 3, "rx", b"kept", *NOBODY))
    file._ring.close()
    assert [TraceEntry.model_validate_json(line).data for line in path.read_bytes().splitlines()] == [b"kept"]
    failed, recovered = caplog.messages
    assert "has failed" in failed
    assert "goes on; 2 records are missing" in recovered


def test_the_longest_record_fits_the_smallest_file_that_can_be_configured() -> None:
    sender = f"websocket {'f' * 39}%interface-name0", '"' * 128
    longest = TraceEntry.of((2**63 - 1, 2**63 - 1, "opened", bytes(RECORD_BYTES), *sender))
    assert len(longest.model_dump_json()) < 4096


def test_a_disk_that_is_too_slow_costs_the_oldest_records(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(trace_file, "WAITING_RECORDS", 10)
    monkeypatch.setattr(trace_file, "BATCH_INTERVAL_S", 3600.0)
    path = tmp_path / "trace.jsonl"
    file = TraceFile(path)
    for number in range(25):
        file.put((number, number, "rx", b"", *NOBODY))
    file.close()
    entries = [TraceEntry.model_validate_json(line) for line in path.read_bytes().splitlines()]
    assert [entry.monotonic_ns for entry in entries] == list(range(15, 25))
    assert file.dropped == 15


def test_a_record_that_cannot_be_told_costs_itself_and_not_the_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = TraceFile(tmp_path / "trace.jsonl")
    good = TraceEntry.of
    left = [1]

    def fail_once(record: Record) -> TraceEntry:
        if left:
            left.pop()
            raise ZeroDivisionError
        return good(record)

    monkeypatch.setattr(TraceEntry, "of", fail_once)
    for data in (b"first", b"second"):
        file.put((1, 1, "rx", data, *NOBODY))
    file.close()
    assert file.dropped == 1
    assert b"second" in (tmp_path / "trace.jsonl").read_bytes()
