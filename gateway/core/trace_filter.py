"""Records of a line's traffic that are about some controllers, or one request."""

from collections.abc import Callable, Collection, Iterable, Iterator
from typing import NamedTuple

from transports.trace import Record

_END = b"\r"
_LONGEST = 4096
"""Bytes after which text without an end is no frame."""


class FrameSubject(NamedTuple):
    """The subject of a frame."""

    address: bytes
    """Address of the frame's receiver or sender; replies have that of their command."""
    bodies: frozenset[int] = frozenset()


class TraceFilter:
    """Lets records pass in their order. Received bytes come in pieces, which pass when their frame ends.

    A reply belongs to the request of the last command to its address.
    """

    def __init__(
        self,
        subject_of: Callable[[bytes], FrameSubject],
        *,
        bodies: Collection[int] | None = None,
        request_id: str | None = None,
    ) -> None:
        self._subject_of = subject_of
        self._bodies, self._request_id = bodies, request_id
        self._asked: set[bytes] = set()
        """Addresses to which the last command was of the request."""
        self._pieces: list[Record] = []
        """Received since the last frame ended."""
        self._text = b""

    def pass_on(self, records: Iterable[Record]) -> Iterator[Record]:
        """Give the records that pass."""
        if self._bodies is None and self._request_id is None:
            yield from records
            return
        for record in records:
            kind, data = record[2], record[3]
            if kind == "tx":
                if self._is_wanted_command(data, record[5]):
                    yield record
            elif kind == "rx":
                yield from self._received(record, data)
            elif self._request_id is None:
                yield record

    def _is_wanted_command(self, data: bytes, request_id: str | None) -> bool:
        subject = self._subject_of(data)
        if request_id == self._request_id:
            self._asked.add(subject.address)
        else:
            self._asked.discard(subject.address)
        return self._is_about(subject) and self._request_id in (None, request_id)

    def _received(self, record: Record, data: bytes) -> Iterator[Record]:
        self._pieces.append(record)
        *frames, self._text = (self._text + data).split(_END)
        if not frames and len(self._text) < _LONGEST:
            return
        if any(map(self._is_wanted_reply, frames)):
            yield from self._pieces
            self._pieces.clear()  # the last one is not told twice, though the next frame may begin in it
        self._pieces = self._pieces[-1:] if self._text else []

    def _is_wanted_reply(self, frame: bytes) -> bool:
        subject = self._subject_of(frame)
        return self._is_about(subject) and (self._request_id is None or subject.address in self._asked)

    def _is_about(self, subject: FrameSubject) -> bool:
        return self._bodies is None or not subject.bodies.isdisjoint(self._bodies)
