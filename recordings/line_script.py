"""The course of a line, as a replay needs it: what was written, with what came because of it."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Final

from recordings.dialects import Dialect
from transports.trace import TraceEntry

Numbered = tuple[int, TraceEntry]
"""A record of a line with its number in its member, from 1."""
NS: Final = 1e-9


@dataclass(frozen=True, slots=True)
class Heard:
    """Bytes that came."""

    after_s: float
    """Seconds after the frame they belong to was written."""
    data: bytes


@dataclass(slots=True)
class Exchange:
    """A frame that was written, and what came because of it."""

    number: int
    """The number of its record."""
    at_s: float
    """Seconds after the beginning of the recording."""
    frame: bytes
    caller: str | None
    request_id: str | None
    key: bytes
    heard: list[Heard] = field(default_factory=list)


@dataclass(frozen=True, slots=True)
class Turn:
    """The port was opened or lost."""

    at_s: float
    opened: bool


@dataclass
class LineScript:
    """The whole of a line."""

    exchanges: list[Exchange]
    turns: list[Turn]

    @property
    def begins_open(self) -> bool:
        """Tell whether it begins with the opening of the port, so that how it was set up is in it."""
        return bool(self.turns) and self.turns[0].opened and self.turns[0].at_s <= self.first_s

    @property
    def first_s(self) -> float:
        """When the first frame was written."""
        return self.exchanges[0].at_s if self.exchanges else 0.0


def script_of(records: Iterable[Numbered], dialect: Dialect, began_ns: int) -> LineScript:
    """Read the records of a line; a frame that was recorded in pieces is one."""
    script = LineScript([], [])
    coming, came_at_s = b"", 0.0
    for number, entry in records:
        at_s = (entry.monotonic_ns - began_ns) * NS
        if entry.kind == "rx":
            coming, came_at_s = _attribute(script.exchanges, dialect, coming + entry.data, at_s)
        elif entry.kind == "tx":
            coming = _flush(script.exchanges, coming, came_at_s)
            dialect.saw(entry.data)
            key = dialect.key(entry.data, entry.caller)
            script.exchanges.append(Exchange(number, at_s, entry.data, entry.caller, entry.request_id, key))
        else:
            coming = _flush(script.exchanges, coming, came_at_s)
            script.turns.append(Turn(at_s, entry.kind == "opened"))
    _flush(script.exchanges, coming, came_at_s)
    return script


def _attribute(
    exchanges: Sequence[Exchange], dialect: Dialect, data: bytes, at_s: float
) -> tuple[bytes, float]:
    """Give whole frames to what they may answer; returns the rest."""
    *frames, rest = data.split(b"\r")
    for frame in frames:
        owner = _owner_of(frame.lstrip(b"\n"), exchanges[-RECENT:], dialect)
        if owner is not None:
            owner.heard.append(Heard(at_s - owner.at_s, frame + b"\r"))
    return rest, at_s


def _owner_of(reply: bytes, recent: Sequence[Exchange], dialect: Dialect) -> Exchange | None:
    """Find the frame that a reply answers; a message comes because of what was done last."""
    is_unasked = dialect.is_unasked(reply)
    for exchange in reversed(recent):
        if not dialect.asks(exchange.frame) if is_unasked else dialect.answers(reply, exchange.frame):
            return exchange
    return recent[-1] if recent else None


RECENT: Final = 256
"""Number of preceding frames that a reply may answer."""


def _flush(exchanges: Sequence[Exchange], rest: bytes, at_s: float) -> bytes:
    """Give a piece that has no end to the frame before it."""
    if rest and exchanges:
        exchanges[-1].heard.append(Heard(at_s - exchanges[-1].at_s, rest))
    return b""
