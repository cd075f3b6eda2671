"""The flight recorder of a port: which bytes went which way, and when; and minutes of records, packed."""

import logging
import marshal
import time
import zlib
from collections import deque
from datetime import datetime
from itertools import islice
from typing import Any, Generic, NamedTuple, TypeVar

from transports.base import Receiver, Transport, TransportLost
from transports.trace import NOBODY, Record, Sender, TraceEntry, TraceKind, wall_ns
from transports.trace_file import TraceFile

BLOCK = 64
"""Records that are packed together; packing a block takes about 0.1 ms."""
LEVEL = 1

R = TypeVar("R", bound=tuple[Any, ...])


class Piece(NamedTuple, Generic[R]):
    """Records that follow one another; a thread may unpack them."""

    first: int
    """Number of the first of them."""
    last_ns: int
    """Time of the last of them, on the clock that never jumps, in nanoseconds."""
    packed: bytes

    def records(self) -> list[R]:
        """Unpack them, in 0.1 ms."""
        unpacked: list[R] = marshal.loads(zlib.decompress(self.packed))  # noqa: S302  # packed below
        return unpacked


class History(Generic[R]):
    """Keeps the newest records, oldest first, within `most_bytes`.

    A record is a tuple of numbers and texts; the first two are its wall time and the time of the clock that
    never jumps, in nanoseconds.
    """

    def __init__(self, most_bytes: int) -> None:
        self._most_bytes = most_bytes
        self._packed: deque[Piece[R]] = deque()
        self._bytes = 0
        self._newest: list[R] = []
        self.recorded = 0
        """Number of the newest record, and so of all records there were, forgotten ones included."""

    def append(self, record: R) -> None:
        """Keep one more record, for which the oldest may go."""
        self._newest.append(record)
        self.recorded += 1
        if len(self._newest) == BLOCK:
            piece = self._pack()
            self._newest = []
            self._packed.append(piece)
            self._bytes += len(piece.packed)
            while self._bytes > self._most_bytes:
                self._bytes -= len(self._packed.popleft().packed)

    @property
    def first(self) -> int:
        """Number of the oldest record that is kept."""
        return self._packed[0].first if self._packed else self.recorded - len(self._newest) + 1

    def pieces(self, after: int = 0) -> list[Piece[R]]:
        """Give what is kept of the records after a number; the first piece may begin before it."""
        found = [piece for piece in self._packed if piece.first + BLOCK - 1 > after]
        return [*found, self._pack()] if self._newest and self.recorded > after else found

    def before(self, monotonic_ns: int) -> int:
        """Give the number of the last record before a time."""
        pieces = (*self._packed, *([self._pack()] if self._newest else ()))
        for piece in pieces:
            if piece.last_ns >= monotonic_ns:
                earlier = [record for record in piece.records() if record[1] < monotonic_ns]
                number: int = piece.first - 1 + len(earlier)
                return number
        return self.recorded

    def _pack(self) -> Piece[R]:
        packed = zlib.compress(marshal.dumps(self._newest), LEVEL)
        return Piece(self.recorded - len(self._newest) + 1, self._newest[-1][1], packed)


log = logging.getLogger(__name__)

# Longer data becomes several records, so that a bound on records is a bound on bytes.
RECORD_BYTES = 512
OPENING = 400
"""Records after the last opening that are kept as long as it lasts: how the line was set up."""


def clocks() -> tuple[int, int]:
    """Read the wall clock and the one that never jumps, in nanoseconds."""
    return time.time_ns(), time.monotonic_ns()


class Recorder:
    """Keeps the newest records in memory and, given a file, hands each one to it as well.

    The `history` has more of them, packed, for recordings.
    """

    def __init__(self, capacity: int = 10_000, file: TraceFile | None = None, history_bytes: int = 0) -> None:
        self._records: deque[Record] = deque(maxlen=capacity)
        self._file = file
        self.history: History[Record] = History(history_bytes)
        self.opening: list[Record] = []
        self.clocks = clocks
        self.sender: Sender = NOBODY
        """The caller whose frame is written, and the id of its request; set right before each write."""
        self.recorded = 0
        """Number of the newest record, and so of all records there were, forgotten ones included."""

    @property
    def dropped(self) -> int:
        """Records that the file has lost; memory loses none but the oldest."""
        return self._file.dropped if self._file is not None else 0

    def record(self, kind: TraceKind, data: bytes = b"") -> None:
        """Keep what happened just now."""
        if len(data) > RECORD_BYTES:
            for start in range(0, len(data), RECORD_BYTES):
                self.record(kind, data[start : start + RECORD_BYTES])
            return
        sender = self.sender if kind == "tx" else NOBODY
        record = (*self.clocks(), kind, data, *sender)
        self._records.append(record)
        self.recorded += 1
        self.history.append(record)
        if kind == "opened":
            self.opening = []
        if len(self.opening) < OPENING:
            self.opening.append(record)
        if self._file is not None:
            self._file.put(record)

    def records(self, since: datetime | None = None) -> list[Record]:
        """Records in memory, oldest first, since `since` (an aware time) if it is given."""
        if since is None:
            return list(self._records)
        earliest = wall_ns(since)
        return [record for record in self._records if record[0] >= earliest]

    def after(self, number: int) -> tuple[int, list[Record]]:
        """Records in memory after a number, behind the number of the first of them."""
        first = max(number, self.recorded - len(self._records)) + 1
        skipped = len(self._records) - (self.recorded - first + 1)
        return first, list(islice(self._records, skipped, None))

    def entries(self, last: int | None = None, since: datetime | None = None) -> list[TraceEntry]:
        """Entries in memory, oldest first: of the `last` ones those since `since` (an aware time).

        Formatting takes microseconds an entry: ask for thousands in a thread.
        """
        skipped = 0 if last is None else max(0, len(self._records) - last)
        earliest = 0 if since is None else wall_ns(since)
        kept = list(islice(self._records, skipped, None))  # a copy first: records go on arriving
        return [TraceEntry.of(record) for record in kept if record[0] >= earliest]

    def close(self) -> None:
        """Finish the file. It waits for the disk: keep it off the event loop."""
        if self._file is not None:
            self._file.close()


class Recorded(Transport):
    """A transport with a recorder between its port and its receiver, in both directions."""

    def __init__(self, transport: Transport, recorder: Recorder) -> None:
        super().__init__(transport.address)
        self._transport = transport
        self.byte_time_s, self.is_bridged = transport.byte_time_s, transport.is_bridged
        self.stuck_s = transport.stuck_s
        self._recorder = recorder
        self._receiver: Receiver | None = None
        self._fails = False
        """True once a record was lost by a fault, so that the loss is logged once."""

    def _note(self, kind: TraceKind, data: bytes = b"") -> None:
        """Record it; a line goes on without its records where a fault of our own keeps them away."""
        try:
            self._recorder.record(kind, data)
        except Exception:
            if not self._fails:
                log.exception("The trace of %s has met a fault; the line goes on.", self.address)
            self._fails = True

    async def open(self, receiver: Receiver) -> None:
        """Open the recorded port."""
        await self._transport.open(self)
        self._receiver = receiver
        self._note("opened")

    def write(self, data: bytes) -> None:
        """Write, then record what the port took."""
        self._transport.write(data)
        self._note("tx", data)

    def unsent(self) -> int:
        """The recorded port's."""
        return self._transport.unsent()

    async def close(self) -> None:
        """Close the recorded port; the recorder stays open."""
        if self._receiver is not None:
            self._receiver = None
            self._note("closed")
        await self._transport.close()

    def data_received(self, data: bytes) -> None:
        """Record what the port received, and pass it on."""
        self._note("rx", data)
        if self._receiver is not None:
            self._receiver.data_received(data)

    def connection_lost(self, error: TransportLost) -> None:
        """Record that the port was lost, and pass it on."""
        self._note("lost")
        receiver, self._receiver = self._receiver, None
        if receiver is not None:
            receiver.connection_lost(error)
