"""The log of the server, written by a thread: text, JSON, or as the journal of systemd takes it."""

import json
import logging
import os
import re
import time
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from logging.handlers import QueueHandler, QueueListener
from queue import SimpleQueue
from typing import Any, Final, Literal, TextIO

from gateway.access.limits import Rates
from gateway.core.origin import current
from gateway.security.folding import network_of

Format = Literal["text", "json"]
MOST_WAITING: Final = 10_000
"""Lines that may wait to be read; more are lost, and nothing waits for them."""
GATHER_S: Final = 0.02
"""Seconds that a line may wait for others before it is written."""
LINES_AT_ONCE: Final = 50
LINES_PER_S: Final = 2.0
"""Lines of one sort that the requests with one key, or from one network address, may cause."""
ENDS_AT_ONCE: Final = 200
ENDS_PER_S: Final = 20.0
"""Lines a second about ends of motions of one key or network: more, as stops are not limited."""
_DOORS: Final = ("api", "uvicorn")
"""The loggers of what clients send; others may warn as often as they like."""

_PRIORITY: Final = {
    logging.DEBUG: 7,
    logging.INFO: 6,
    logging.WARNING: 4,
    logging.ERROR: 3,
    logging.CRITICAL: 2,
}
"""Priorities of the levels, as sd-daemon(3) counts them."""
_CONTROL: Final = {code: f"\\x{code:02x}" for code in (*range(32), 0x7F, 0x85, 0x2028, 0x2029) if code != 9}
"""Escapes of characters that begin a line or move a terminal's cursor: the network may send them."""

_ESCAPED: Final = {code: f"\\u{code:04x}" for code in (0x7F, 0x85, 0x2028, 0x2029)}
"""Escapes of characters that JSON leaves as they are, and some readers take for the end of a line."""


_PLAIN: Final = re.compile(r"[^\s\"\\=\[\]]+")
"""A value that needs no quotes."""


def _facts_of(record: logging.LogRecord) -> dict[str, Any]:
    facts: dict[str, Any] = getattr(record, "facts", {})
    return {name: value for name, value in facts.items() if value is not None}


class TextLines(logging.Formatter):
    """One line each, with its time, its level and its facts; a traceback follows."""

    def format(self, record: logging.LogRecord) -> str:
        """Write a record."""
        at = datetime.fromtimestamp(record.created).astimezone().isoformat(timespec="milliseconds")
        return f"{at} {record.levelname} {record.name}: {_sentence(record)}{_trace(self, record)}"


class JournalLines(logging.Formatter):
    """As the journal of systemd takes them: with a priority, and without the time, which it notes itself."""

    def format(self, record: logging.LogRecord) -> str:
        """Write a record; each line of a traceback has the priority."""
        text = f"{record.name}: {_sentence(record)}{_trace(self, record)}"
        priority = f"<{_PRIORITY.get(record.levelno, 6)}>"
        return "\n".join(priority + line for line in text.split("\n"))


class JsonLines(logging.Formatter):
    """One object a line."""

    def format(self, record: logging.LogRecord) -> str:
        """Write a record."""
        told = {
            "time": datetime.fromtimestamp(record.created, UTC).isoformat(timespec="milliseconds"),
            "level": record.levelname.lower(),
            "logger": record.name,
            "message": record.getMessage(),
            **_facts_of(record),
        }
        if trace := _trace(self, record):
            told["traceback"] = trace.strip()
        return json.dumps(told, ensure_ascii=False).translate(_ESCAPED)


def _sentence(record: logging.LogRecord) -> str:
    facts = " ".join(f"{name}={_word(value)}" for name, value in _facts_of(record).items())
    return (record.getMessage() + (f" [{facts}]" if facts else "")).translate(_CONTROL)


def _word(value: object) -> str:
    """Write a value so that it can neither end itself nor begin another fact."""
    text = str(value)
    if _PLAIN.fullmatch(text):
        return text
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    return f'"{escaped}"'


def _trace(formatter: logging.Formatter, record: logging.LogRecord) -> str:
    if record.exc_info and not record.exc_text:
        record.exc_text = formatter.formatException(record.exc_info)
    return f"\n{record.exc_text}" if record.exc_text else ""


class _Crowds:
    """Leaves out what one client would fill the log with: by logger, words, address and key."""

    def __init__(self) -> None:
        self._said = Rates(LINES_AT_ONCE, LINES_PER_S)
        self._done = Rates(ENDS_AT_ONCE, ENDS_PER_S)
        self._left_out = 0

    def pass_over(self, record: logging.LogRecord) -> bool:
        """True if a record is left out; the next one that is written says how many were."""
        if not self._has_room(record):
            self._left_out += 1
            return True
        if self._left_out:
            record.__dict__["facts"] = {**_facts_of(record), "left_out_before": self._left_out}
            self._left_out = 0
        return False

    def _has_room(self, record: logging.LogRecord) -> bool:
        of_doors, origin = record.name.partition(".")[0] in _DOORS, current()
        if not of_doors and (record.levelno > logging.INFO or not origin.address):
            return True
        rates, sort = self._said if of_doors else self._done, _facts_of(record).get("event", record.msg)
        key, has_key, _ = origin.caller.partition(" (")
        causes = [network_of(origin.address), *([key] if has_key else [])]
        return all(rates.passes(f"{record.name} {sort} {cause}") for cause in causes)


class _Hand(QueueHandler):
    """Hands records to the thread that writes: the loop of the lines waits for no terminal."""

    def __init__(self, queue: SimpleQueue[Any]) -> None:
        super().__init__(queue)
        self._crowds = _Crowds()

    def emit(self, record: logging.LogRecord) -> None:
        """Hand a record over, if its client has not caused too many like it."""
        if not self._crowds.pass_over(record):
            super().emit(record)

    def prepare(self, record: logging.LogRecord) -> logging.LogRecord:
        """Put its words together now: what they tell of may change."""
        record.msg, record.args = record.getMessage(), None
        return record

    queue: SimpleQueue[Any]

    def enqueue(self, record: logging.LogRecord) -> None:
        """Queue a record, or lose it if the queue is full because its reader has stalled."""
        if self.queue.qsize() < MOST_WAITING:
            self.queue.put(record)


class _Writer(QueueListener):
    """Writes what has gathered, then lets more gather: to wake it costs more than a line."""

    queue: SimpleQueue[Any]

    def dequeue(self, block: bool) -> logging.LogRecord:
        """Take the next record; where there is none yet, look again a moment later."""
        if self.queue.empty():
            time.sleep(GATHER_S)
        return super().dequeue(block)


def _is_journal(stream: TextIO) -> bool:
    """True if a stream leads into the journal of systemd (systemd.exec(5), JOURNAL_STREAM)."""
    try:
        found = os.fstat(stream.fileno())
    except (OSError, ValueError):
        return False
    return os.environ.get("JOURNAL_STREAM") == f"{found.st_dev}:{found.st_ino}"


def formatter_for(wanted: Format, stream: TextIO) -> logging.Formatter:
    """How lines are written to a stream."""
    if wanted == "json":
        return JsonLines()
    return JournalLines() if _is_journal(stream) else TextLines()


@contextmanager
def logging_to(stream: TextIO, level: str, wanted: Format) -> Iterator[None]:
    """Write what is logged to a stream until this ends; what waits then is written before."""
    writer = logging.StreamHandler(stream)
    writer.setFormatter(formatter_for(wanted, stream))
    queue: SimpleQueue[Any] = SimpleQueue()
    hand, listener = _Hand(queue), _Writer(queue, writer)
    root = logging.getLogger()
    before = root.level
    root.addHandler(hand)
    root.setLevel(level.upper())
    listener.start()
    try:
        yield
    finally:
        root.removeHandler(hand)
        root.setLevel(before)
        listener.stop()
