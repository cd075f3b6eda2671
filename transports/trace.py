"""Trace entries, their bytes as text, and those that are about some controllers, or one request."""

import re
from collections.abc import Callable, Collection, Iterable, Iterator
from datetime import UTC, datetime, timedelta
from typing import Annotated, Final, Literal, NamedTuple

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, PlainSerializer, WithJsonSchema
from typing_extensions import TypeAliasType

TraceKind = TypeAliasType("TraceKind", Literal["rx", "tx", "opened", "lost", "closed"])

Sender = tuple[str | None, str | None]
"""The caller of a frame, and the id of its request; None where it is not told."""
NOBODY: Final[Sender] = (None, None)

# A trace entry as it is kept, not formatted before somebody asks: wall ns, monotonic ns, kind, data, sender.
Record = tuple[int, int, TraceKind, bytes, str | None, str | None]

_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
_ESCAPED = re.compile(r"(?:[ -\[\]-~]|\\[\\rnt]|\\x[0-9a-f]{2})*")


def wall_ns(moment: datetime) -> int:
    """Nanoseconds from 1970 to an aware time."""
    return (moment - _EPOCH) // timedelta(microseconds=1) * 1000


def escape(data: bytes) -> str:
    r"""Write bytes as readable ASCII: `&3F6PD\r`; a backslash is doubled, unprintable bytes are `\x00`."""
    return data.decode("latin-1").encode("unicode_escape").decode("ascii")


def unescape(text: str) -> bytes:
    r"""Undo `escape`.

    :raises ValueError: `escape` does not write this.
    """
    readable = _ESCAPED.fullmatch(text)
    data = text.encode("ascii").decode("unicode_escape").encode("latin-1") if readable else b""
    if escape(data) != text:
        raise ValueError(r"expected printable ASCII; \\, \r, \n, \t; other bytes as \x00")
    return data


def _is_none(value: object) -> bool:
    return value is None


EscapedBytes = Annotated[
    bytes,
    BeforeValidator(lambda value: unescape(value) if isinstance(value, str) else value),
    PlainSerializer(escape, return_type=str),
    WithJsonSchema({"type": "string", "description": r"The bytes; unprintable ones as \r, \n, \t or \x00."}),
]


class TraceEntry(BaseModel):
    """An event at a port: bytes were received or sent, or the port opened, was lost or closed.

    `at` is UTC wall time, which jumps when the clock is set; `monotonic_ns` never does. Only sent bytes have
    a caller, and a request if there was one.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    at: datetime
    monotonic_ns: int
    kind: TraceKind
    data: EscapedBytes = b""
    caller: str | None = Field(None, exclude_if=_is_none)
    request_id: str | None = Field(None, exclude_if=_is_none)

    @classmethod
    def of(cls, record: Record) -> "TraceEntry":
        """Format a kept record."""
        wall_ns, monotonic_ns, kind, data, caller, request_id = record
        at = _EPOCH + timedelta(microseconds=wall_ns // 1000)
        return cls(
            at=at, monotonic_ns=monotonic_ns, kind=kind, data=data, caller=caller, request_id=request_id
        )


_END = b"\r"
UNNAMED = b""
"""The address of a frame that names none."""
_LONGEST = 4096
"""Bytes after which text without an end is no frame."""


class FrameSubject(NamedTuple):
    """The subject of a frame."""

    address: bytes
    """Address of the frame's receiver or sender; replies have that of their command."""
    bodies: frozenset[int] = frozenset()


class TraceFilter:
    """Lets records pass in their order. Received bytes come in pieces, which pass when their frame ends.

    A reply belongs to the request of the last command to its address; to the last of all, if it names none.
    """

    def __init__(
        self,
        subject_of: Callable[[bytes], FrameSubject],
        *,
        bodies: Collection[int] | None = None,
        request_id: str | None = None,
        without: Collection[str] = (),
    ) -> None:
        self._subject_of = subject_of
        self._bodies, self._request_id, self._without = bodies, request_id, without
        self._asked: set[bytes] = set()
        """Addresses to which the last command was of the request."""
        self._polled: set[bytes] = set()
        """Addresses of which a caller that is left out has asked something that is not answered yet."""
        self._pieces: list[Record] = []
        """Received since the last frame ended."""
        self._text = b""

    def pass_on(self, records: Iterable[Record]) -> Iterator[Record]:
        """Give the records that pass."""
        if self._bodies is None and self._request_id is None and not self._without:
            yield from records
            return
        for record in records:
            kind, data = record[2], record[3]
            if kind == "tx":
                if self._is_wanted_command(data, record[4], record[5]):
                    yield record
            elif kind == "rx":
                yield from self._received(record, data)
            elif self._request_id is None:
                yield record

    def _is_wanted_command(self, data: bytes, caller: str | None, request_id: str | None) -> bool:
        subject = self._subject_of(data)
        is_of_request, is_poll = request_id == self._request_id, caller in self._without
        for addresses, is_in in ((self._asked, is_of_request), (self._polled, is_poll)):
            for address in (subject.address, UNNAMED):
                (addresses.add if is_in else addresses.discard)(address)
        is_of_request |= self._request_id is None
        return self._is_about(subject) and is_of_request and not is_poll

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
        is_of_request = self._request_id is None or subject.address in self._asked
        is_of_poll = subject.address in self._polled
        self._polled.discard(subject.address)  # what comes without a question is nobody's answer
        return self._is_about(subject) and is_of_request and not is_of_poll

    def _is_about(self, subject: FrameSubject) -> bool:
        return self._bodies is None or not subject.bodies.isdisjoint(self._bodies)
