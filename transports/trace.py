"""Trace entries, and their bytes as text."""

import re
from datetime import UTC, datetime, timedelta
from typing import Annotated, Final, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, PlainSerializer, WithJsonSchema

Kind = Literal["rx", "tx", "opened", "lost", "closed"]

Sender = tuple[str | None, str | None]
"""The caller of a frame, and the id of its request; None where it is not told."""
NOBODY: Final[Sender] = (None, None)

# A trace entry as it is kept, not formatted before somebody asks: wall ns, monotonic ns, kind, data, sender.
Record = tuple[int, int, Kind, bytes, str | None, str | None]

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
    kind: Kind
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
