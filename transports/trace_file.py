"""A ring of JSON-lines files that trace records are written to, off the event loop."""

import contextlib
import logging
import threading
from collections import deque
from io import FileIO
from pathlib import Path

from transports.trace import Record, TraceEntry

# How late a record may reach the disk.
BATCH_INTERVAL_S = 0.5
# Records that may wait for a slow disk; beyond that the oldest are dropped and counted.
WAITING_RECORDS = 20_000
# How long closing waits for a disk that hangs.
CLOSE_TIMEOUT_S = 5.0

log = logging.getLogger(__name__)


class FileRing:
    """Appends lines to `path`; full, it becomes `path.1` and so on, until the oldest is overwritten."""

    def __init__(self, path: Path, file_bytes: int, files: int) -> None:
        if files < 2 or file_bytes < 1:
            raise ValueError("a ring needs at least 2 files of at least 1 byte")
        self._path = path
        self._file_bytes = file_bytes
        self._files = files
        self._file: FileIO | None = None

    def append(self, line: bytes) -> None:
        """Write all of a line, which is no longer than a file may be, or as far as the disk lets us nothing.

        :raises OSError: the line is not written; the next one tries anew.
        """
        file = self._file or self._open()
        if file.tell() + len(line) > self._file_bytes:
            file = self._rotate()
        start = file.tell()
        try:
            while line:
                line = line[file.write(line) :]
        except OSError:
            with contextlib.suppress(OSError):
                file.truncate(start)
            self.close()
            raise

    def close(self) -> None:
        """Close the file; a later line opens it again."""
        if self._file is not None:
            with contextlib.suppress(OSError):
                self._file.close()
            self._file = None

    def _open(self) -> FileIO:
        self._path.parent.mkdir(parents=True, exist_ok=True)
        self._file = FileIO(self._path, "ab")
        return self._file

    def _rotate(self) -> FileIO:
        self.close()
        for number in reversed(range(1, self._files)):
            with contextlib.suppress(FileNotFoundError):
                self._numbered(number - 1).replace(self._numbered(number))
        return self._open()

    def _numbered(self, number: int) -> Path:
        return self._path.with_name(f"{self._path.name}.{number}") if number else self._path


class TraceFile:
    """Writes records to a ring of files in a thread of its own.

    A slow, full or broken disk costs records, which are counted and told once; it never holds up the line.
    """

    def __init__(self, path: Path, file_bytes: int = 8_000_000, files: int = 4) -> None:
        self._path = path
        self._ring = FileRing(path, file_bytes, files)
        self._waiting: deque[Record] = deque(maxlen=WAITING_RECORDS)
        # Each counter has one writing thread, so that neither needs a lock.
        self._overtaken = 0
        self._unwritten = 0
        self._failing = False
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._run, name=f"trace {path.name}", daemon=True)
        self._thread.start()

    @property
    def dropped(self) -> int:
        """Records that are in no file because the disk was too slow, full or broken."""
        return self._overtaken + self._unwritten

    def put(self, record: Record) -> None:
        """Take a record to be written within `BATCH_INTERVAL_S`."""
        if len(self._waiting) == WAITING_RECORDS:
            self._overtaken += 1
        self._waiting.append(record)

    def close(self) -> None:
        """Write what is waiting and stop. It waits for the disk: keep it off the event loop."""
        self._closing.set()
        self._thread.join(CLOSE_TIMEOUT_S)

    def _run(self) -> None:
        while not self._closing.wait(BATCH_INTERVAL_S):
            self._write_waiting()
        self._write_waiting()
        self._ring.close()

    def _write_waiting(self) -> None:
        for _ in range(len(self._waiting)):
            self._write(self._waiting.popleft())

    def _write(self, record: Record) -> None:
        try:
            self._ring.append(TraceEntry.of(record).model_dump_json().encode() + b"\n")
        except Exception as error:  # a fault of our own would end the thread, and with it the file
            self._unwritten += 1
            if not self._failing:
                log.warning(
                    "Recording to %s has failed (%s). The line goes on without it; free or mend the disk.",
                    self._path,
                    error,
                )
            self._failing = True
        else:
            if self._failing:
                log.warning("Recording to %s goes on; %d records are missing.", self._path, self.dropped)
            self._failing = False
