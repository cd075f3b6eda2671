"""Frames of a line in words: an answer behind its question, by the tables of both families."""

import re
from collections.abc import Iterable, Iterator, Mapping
from typing import Any, Final

from protocols.fics.commands import COMMANDS as FICS
from protocols.rorze.commands import COMMANDS as RORZE
from protocols.rorze.errors import lookup
from protocols.rorze.status import CONTROLLER_STATUS_BITS, END_CAUSE_BITS, SENSOR_BITS, names_of

Record = Mapping[str, Any]
ACCEPTED: Final = "accepted"
_RORZE: Final = re.compile(r">?&([0-9A-F]{2})(?:@([0-9A-F]{2})|([0-9A-Z][0-9A-Z+*-][0-9A-Z])(.*?))(?:\\r|$)")
_FICS: Final = re.compile(r"([0-9A-Z]{3})(?: (.*?))?(?:\\r|$)")
_BITS: Final = {"9CD": CONTROLLER_STATUS_BITS, "9MD": END_CAUSE_BITS, "CLD": SENSOR_BITS}
_NUMBER: Final = re.compile(r"[+-]?\d+")


def folded(records: Iterable[Record]) -> Iterator[tuple[Record, Record | None]]:
    """Put an answer that follows its question behind it."""
    question: Record | None = None
    for record in records:
        if question is not None and record["kind"] == "rx" and _subject(record) == _subject(question):
            yield question, record
            question = None
            continue
        if question is not None:
            yield question, None
        question = record if record["kind"] == "tx" else None
        if question is None:
            yield record, None
    if question is not None:
        yield question, None


def _subject(record: Record) -> str:
    """The part that a command and its answer share: a refusal names its body alone."""
    found = _RORZE.match(record["data"]) or _FICS.match(record["data"])
    return found[1] if found else ""


def meaning(record: Record, answer: Record | None) -> str:
    """Say what was asked, and what the answer tells; nothing of what no table knows."""
    found = _RORZE.match(record["data"])
    if found is not None:
        told = None if answer is None else _told(answer["data"], found[3] or "")
        return _joined(_title(RORZE.get(found[3] or "")), told)
    found = _FICS.match(record["data"])
    rows = FICS.get(found[1]) if found else None
    if not rows:
        return ""
    said = None if answer is None else _FICS.match(answer["data"])
    return _joined(_title(rows[0]), None if said is None else said[2] or ACCEPTED)


def _told(data: str, code: str) -> str:
    """The value of a reply, or why it is refused."""
    found = _RORZE.match(data)
    if found is None:
        return ""
    if found[2] is not None:
        return f"refused: {lookup(int(found[2], 16), code).en}"
    value = found[4]
    if code in _BITS and re.fullmatch("H[0-9A-F]{2}", value):
        return ", ".join(names_of(int(value[1:], 16), _BITS[code])).replace("_", " ") or "none"
    return str(int(value)) if _NUMBER.fullmatch(value) else value or ACCEPTED


def _title(row: type[Any] | None) -> str:
    return "" if row is None else str(row.titles()[1])


def _joined(title: str, told: str | None) -> str:
    return ": ".join(filter(None, (title, told)))
