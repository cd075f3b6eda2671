"""The newest records of a line or of the requests, packed: minutes of them take a megabyte."""

import marshal
import zlib
from collections import deque
from typing import Any, Generic, NamedTuple, TypeVar

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
