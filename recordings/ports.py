"""Ports in the place of recorded lines: they answer as it was recorded, and tell the first difference."""

import asyncio
import traceback
from bisect import bisect_left, bisect_right
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import accumulate, islice, takewhile
from math import inf
from operator import attrgetter
from pathlib import PurePath
from typing import Final

from protocols.table import Effect
from recordings.dialects import UNIT, Dialect
from recordings.form import line_member
from recordings.line_script import NS, Exchange, LineScript, Numbered
from transports.base import Receiver, Transport, TransportLost, TransportUnavailable
from transports.trace import Sender, escape

EARLY_S: Final = 0.05
"""Seconds by which an opening of a port or an answer may precede its recorded time."""
OPENING_S: Final = 0.001
"""An answer's lead where all is written in the same order."""
LONGEST_DRAWN: Final = 11
"""Bytes of a mark."""
DEPTH: Final = 5


@dataclass(frozen=True, slots=True)
class Line:
    """A line that is replayed."""

    line_id: str
    address: str
    byte_time_s: float
    is_bridged: bool
    dialect: Dialect


@dataclass(frozen=True, slots=True)
class Written:
    """A frame and who had it written."""

    frame: bytes
    caller: str | None
    request_id: str | None

    def __str__(self) -> str:
        why = f"request {self.request_id}" if self.request_id else None
        return f"{escape(self.frame)} ({', '.join(filter(None, (self.caller, why))) or 'nobody'})"


@dataclass(frozen=True, slots=True)
class Difference:
    """A difference: a frame is written now that was not written then."""

    line_id: str
    number: int
    """The number of the record that it begins at."""
    then: Written | None
    now: Written | None
    decided: Sequence[str] = ()
    """Functions of the gateway that decided the frame, the innermost last."""

    @property
    def place(self) -> str:
        """The record, as `lines/ID.jsonl:N`."""
        return f"{line_member(self.line_id)}:{self.number}"

    def __str__(self) -> str:
        then = f"then {self.then}" if self.then else "then nothing"
        now = f"now {self.now}" if self.now else "now nothing"
        decided = f"; decided in {' > '.join(self.decided)}" if self.decided and self.now else ""
        return f"{self.place}: {then}, {now}{decided}"


class ReplayPort(Transport):
    """A port that no bytes leave."""

    def __init__(self, line: Line) -> None:
        super().__init__(line.address)
        self.line = line
        self.byte_time_s, self.is_bridged = line.byte_time_s, line.is_bridged
        self.sender: Callable[[], Sender] = lambda: (None, None)
        """The author of a frame, asked for at each write."""
        self.difference: Difference | None = None
        self.on_difference: Callable[[], object] = lambda: None
        self.began_at = 0.0
        """Time of the loop at which the recording begins."""
        self._receiver: Receiver | None = None
        self.numbers: Sequence[int] = ()
        """The numbers of the fences that were written then."""
        self._fences = self._drawn = 0
        """Numbers of fences that are written, and that were drawn to be written."""

    async def open(self, receiver: Receiver) -> None:
        """Open it, if it could be opened then."""
        if self.difference is not None or not self._may_open():
            raise TransportUnavailable(f"{self.address} was not opened: it was not open then.")
        self._receiver = receiver
        self._drawn = 0  # what was drawn before is not written any more

    def draw(self, other: int) -> int:
        """Draw the number of the next fence: that of then, or another beyond the last."""
        place = self._fences + self._drawn
        self._drawn += 1
        return self.numbers[place] if place < len(self.numbers) else other

    def write(self, data: bytes) -> None:
        """Compare what is written with what was written, and answer as then."""
        if self._receiver is None:
            raise TransportLost(f"{self.address} is not open")
        if self.line.dialect.drawn_number(data, self.sender()[0]) is not None:
            self._fences, self._drawn = self._fences + 1, max(self._drawn - 1, 0)
        if self.difference is None:
            self._compare(data)

    def unsent(self) -> int:
        """Nothing waits."""
        return 0

    async def close(self) -> None:
        """Close it."""
        self._receiver = None

    @property
    def now_s(self) -> float:
        """Seconds after the beginning of the recording."""
        return asyncio.get_running_loop().time() - self.began_at

    def end(self) -> None:
        """Look whether something was written then that is not written now."""

    def _may_open(self) -> bool:
        return True

    def _compare(self, data: bytes) -> None:
        """Compare, and answer."""

    def _hear(self, at_s: float, data: bytes) -> None:
        """Let bytes come at a time of the recording."""
        loop = asyncio.get_running_loop()
        loop.call_at(max(self.began_at + at_s, loop.time()), self._deliver, data)

    def _deliver(self, data: bytes) -> None:
        if self._receiver is not None and self.difference is None:
            self._receiver.data_received(data)

    def _lose(self) -> None:
        receiver, self._receiver = self._receiver, None
        if receiver is not None:
            receiver.connection_lost(TransportLost(f"{self.address} was lost, as then"))

    def _differs(self, number: int, then: Written | None, now: bytes | None) -> None:
        written = None if now is None else Written(now, *self.sender())
        decided = _functions() if now is not None else ()
        self.difference = Difference(self.line.line_id, number, then, written, decided)
        self.on_difference()


class ExactPort(ReplayPort):
    """A port for a replay in which all is written in the same order: every frame is compared."""

    def __init__(self, line: Line, records: Sequence[Numbered], began_ns: int) -> None:
        super().__init__(line)
        self._records = records
        self._times = [(entry.monotonic_ns - began_ns) * NS for _, entry in records]
        self._next = 0
        came = [entry.data if entry.kind == "rx" else b"" for _, entry in records]
        self._heard = b"".join(came)
        self._offsets = [0, *accumulate(map(len, came))]

    def _may_open(self) -> bool:
        """At the time of its record: what came and went before is over."""
        opened = self._find("opened")
        if opened is None or self._times[opened] > self.now_s + OPENING_S:
            return False
        self._next = opened + 1
        self._go_on(self._times[opened])
        return True

    def _find(self, kind: str) -> int | None:
        """Find the next record of a kind, unless a frame is to be written before."""
        for place in range(self._next, len(self._records)):
            found = self._records[place][1].kind
            if found == kind:
                return place
            if found == "tx":
                return None
        return None

    def _go_on(self, anchor_s: float) -> None:
        """Let come what comes before the next frame is written."""
        shift_s = self.now_s - anchor_s
        end = self._next
        while end < len(self._records) and self._records[end][1].kind in ("rx", "lost"):
            end += 1
        coming = range(self._next, end)
        self._next = end
        for place in coming:
            at_s = self._times[place] + shift_s
            if self._records[place][1].kind == "rx":
                self._hear(at_s, self._of_now(place))
            else:
                loop = asyncio.get_running_loop()
                loop.call_at(max(self.began_at + at_s, loop.time()), self._lose)

    def _of_now(self, place: int) -> bytes:
        """The bytes that came then, with what is drawn now, which may have come in pieces and is as long."""
        begin, end = self._offsets[place], self._offsets[place + 1]
        first = max(begin - LONGEST_DRAWN, 0)
        around = self.line.dialect.of_now(self._heard[first : end + LONGEST_DRAWN])
        return around[begin - first : end - first]

    def _compare(self, data: bytes) -> None:
        place = self._next
        while place < len(self._records) and self._records[place][1].kind != "tx":
            place += 1
        if place == len(self._records):
            if self.now_s <= self._end_s:
                self._differs(len(self._records), None, data)
            return
        number, entry = self._records[place]
        then = Written(entry.data, entry.caller, entry.request_id)
        dialect, caller = self.line.dialect, self.sender()[0]
        if dialect.key(data, caller) != dialect.key(entry.data, entry.caller):
            self._differs(number, then, data)
            return
        dialect.note(entry.data, data, caller)
        self._next = place + 1
        self._go_on(self._times[place])

    @property
    def _end_s(self) -> float:
        return self._times[-1] if self._times else 0.0

    def end(self) -> None:
        """Nothing is left that was written then."""
        left = next((record for record in self._records[self._next :] if record[1].kind == "tx"), None)
        if self.difference is None and left is not None:
            number, entry = left
            self._differs(number, Written(entry.data, entry.caller, entry.request_id), None)


class MatchingPort(ReplayPort):
    """A port for any recording: what clients had done keeps its order, questions are answered as recorded.

    The gateway's own frames, such as those that set a line up, are answered as recorded, and not compared.
    Before the recording begins, and for a question that it lacks, the answer is that from before.
    """

    def __init__(self, line: Line, script: LineScript, before: LineScript) -> None:
        super().__init__(line)
        self._script = script
        self._before = {
            key: exchange for exchange in before.exchanges for key in (_text(exchange.key), exchange.key)
        }
        self._written: set[bytes] = set()
        self._addressed: set[bytes] = set()
        self.unanswered: set[bytes] = set()
        self.has_begun = False
        """False while the gateway sets the line up as it was before the recording."""
        exchanges, dialect = script.exchanges, line.dialect
        self._by_key = _grouped(exchanges, lambda exchange: exchange.key)
        self._by_text = _grouped(exchanges, lambda exchange: exchange.key.partition(UNIT)[2])
        deeds = [exchange for exchange in exchanges if self._is_compared(exchange.frame, exchange.caller)]
        self._deeds = _grouped(deeds, lambda exchange: dialect.target(exchange.frame))
        self._done: dict[bytes, int] = defaultdict(int)
        """Number of recorded deeds that are done, for each target."""
        self._shift_s: dict[bytes, float] = defaultdict(float)
        """Seconds by which the deeds of each target are later than recorded."""

    @property
    def begins_open(self) -> bool:
        """Tell whether how the line was set up is in the recording."""
        return self._script.begins_open

    def begin(self) -> None:
        """Let the recording begin now."""
        loop = asyncio.get_running_loop()
        self.began_at, self.has_begun = loop.time(), True
        for turn in self._script.turns:
            if not turn.opened:
                loop.call_at(self.began_at + turn.at_s, self._lose)

    def _may_open(self) -> bool:
        if not self.has_begun:
            return not self.begins_open
        times = [turn.at_s for turn in self._script.turns]
        last = bisect_right(times, self.now_s + EARLY_S) - 1
        return self._script.turns[last].opened if last >= 0 else not self.begins_open

    def _is_compared(self, frame: bytes, caller: str | None) -> bool:
        dialect = self.line.dialect
        by_itself = (caller or "").startswith(BY_ITSELF)
        return not (by_itself or dialect.asks(frame) or dialect.prepares(frame))

    def _compare(self, data: bytes) -> None:
        dialect, caller = self.line.dialect, self.sender()[0]
        dialect.saw(data)
        key, target = dialect.key(data, caller), dialect.target(data)
        self._written.add(_text(key))
        self._addressed.add(target)
        if self._is_compared(data, caller) and self.has_begun:
            found = self._deed(key, target, data)
            if self.difference is not None:
                return
        else:
            found = self._answer_of(key, target) if self.has_begun else None
            found = found or self._before.get(key) or self._before.get(_text(key))
        if found is not None:
            dialect.note(found.frame, data, None)
            for heard in found.heard:
                reply = dialect.fitted(heard.data, data, caller)
                self._hear(self.now_s + max(heard.after_s, len(data) * self.byte_time_s), reply)
        elif (told := dialect.reply_to(data, caller)) is not None:
            self._hear(self.now_s + len(data) * self.byte_time_s, told)
        else:
            self.unanswered.add(data)

    def _deed(self, key: bytes, target: bytes, data: bytes) -> Exchange | None:
        """Match what has an effect with the next that had one."""
        deeds, done = self._deeds.get(target, []), self._done[target]
        if done and self._is_again(deeds[done - 1], key):
            ahead = deeds[done] if done < len(deeds) else None
            if ahead is None or ahead.key != key:
                return deeds[done - 1]
        done += self._said_again(deeds, done, key)
        expected = deeds[done] if done < len(deeds) else None
        if expected is not None and _text(expected.key) == _text(key):
            self._done[target] = done + 1
            self._shift_s[target] = self.now_s - expected.at_s
            return expected
        self._differs(*self._place_of(min(self._missing(expected), key=_number, default=expected)), data)
        return None

    def _missing(self, expected: Exchange | None) -> list[Exchange]:
        """The frames before the expected one that are missing now: a difference begins there."""
        before = inf if expected is None else expected.number
        missing = [*self._left(), *filter(self._is_strange, self._script.exchanges)]
        return [exchange for exchange in missing if exchange.number <= before]

    def _never_addressed(self) -> list[Exchange]:
        """The frames to targets that were not written to until the end: before it they may be yet to come."""
        return [
            exchange
            for exchange in self._script.exchanges
            if self.line.dialect.target(exchange.frame) not in self._addressed
        ]

    def _said_again(self, deeds: Sequence[Exchange], done: int, key: bytes) -> int:
        """Count the next stops that were repeated in the recording and are not repeated now."""
        last = deeds[done - 1].key if done else b""
        again = takewhile(lambda deed: deed.key != key and self._is_again(deed, last), deeds[done:])
        return len(list(again))

    def _place_of(self, then: Exchange | None) -> tuple[int, Written | None]:
        if then is not None:
            return then.number, _as_written(then)
        return (self._script.exchanges[-1].number if self._script.exchanges else 1), None

    def _is_again(self, deed: Exchange, key: bytes) -> bool:
        """Tell whether it is a stop that is said again: that is done until it is confirmed."""
        return deed.key == key and self.line.dialect.effect(deed.frame) is Effect.STOP

    def _answer_of(self, key: bytes, target: bytes) -> Exchange | None:
        """Find how something was answered at this time, between what was done last and what is done next."""
        asked = self._by_key.get(key) or self._by_text.get(_text(key), [])
        deeds, done = self._deeds.get(target, []), self._done[target]
        floor = deeds[done - 1].number if done else 0
        ceiling = deeds[done].number if done < len(deeds) else inf
        first = bisect_right(asked, floor, key=_number)
        end = bisect_left(asked, ceiling, first, key=_number)
        due_s = self.now_s - self._shift_s[target] + EARLY_S
        last_due = bisect_right(asked, due_s, first, end, key=_at_s) - 1
        place = max(last_due, first) if first < end else first - 1
        return asked[place] if place >= 0 else None

    def end(self) -> None:
        """Look for what was done then and is not now, and for what was written then and cannot be now."""
        first = min([*self._missing(None), *self._never_addressed()], key=_number, default=None)
        if self.difference is None and first is not None:
            self._differs(first.number, _as_written(first), None)

    def _left(self) -> Iterator[Exchange]:
        for target, deeds in self._deeds.items():
            last = deeds[self._done[target] - 1].key if self._done[target] else b""
            left = (deed for deed in deeds[self._done[target] :] if not self._is_again(deed, last))
            yield from islice(left, 1)

    def _is_strange(self, then: Exchange) -> bool:
        """Tell whether a recorded frame of a client, or one that is no command, has no like now."""
        is_none = self.line.dialect.effect(then.frame) is None
        return (bool(then.request_id) or is_none) and _text(then.key) not in self._written


BY_ITSELF: Final = "gateway:"
"""Prefix of the caller of requests that the gateway makes itself."""


def _text(key: bytes) -> bytes:
    return key.partition(UNIT)[2]


_number: Final = attrgetter("number")
_at_s: Final = attrgetter("at_s")


def _as_written(exchange: Exchange) -> Written:
    return Written(exchange.frame, exchange.caller, exchange.request_id)


def _grouped(exchanges: Sequence[Exchange], key: Callable[[Exchange], bytes]) -> dict[bytes, list[Exchange]]:
    groups: dict[bytes, list[Exchange]] = defaultdict(list)
    for exchange in exchanges:
        groups[key(exchange)].append(exchange)
    return dict(groups)


def _functions() -> list[str]:
    """The innermost functions of the gateway that are at work; the driver, which writes all, is left out."""
    found = []
    for frame in traceback.extract_stack():
        *_, package, module = parts = ("", "", *PurePath(frame.filename).parts)
        if not {"gateway", "api"}.isdisjoint(parts) and (package, module) != ("core", "line.py"):
            found.append(f"{package}/{module}:{frame.lineno} {frame.name}")
    return found[-DEPTH:]
