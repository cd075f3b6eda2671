"""Frames of a line in words: an answer behind its question, by the tables of both families."""

import re
from collections.abc import Iterable, Iterator, Mapping
from typing import Any, Final

Record = Mapping[str, Any]
ACCEPTED: Final = "accepted"
_RORZE: Final = re.compile(r">?&([0-9A-F]{2})(?:@([0-9A-F]{2})|([0-9A-Z][0-9A-Z+*-][0-9A-Z])(.*?))(?:\\r|$)")
_FICS: Final = re.compile(r"([0-9A-Z]{3})(?: (.*?))?(?:\\r|$)")
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
    if found := _RORZE.match(record["data"]):
        return _of_rorze(found[3] or "", answer)
    if found := _FICS.match(record["data"]):
        return _of_fics(found[1], answer)
    return ""


def _of_rorze(code: str, answer: Record | None) -> str:
    from protocols.rorze.commands import COMMANDS  # a family's tables take a quarter of a second

    told = None if answer is None else _told(answer["data"], code)
    return _joined(_title(COMMANDS.get(code)), told)


def _of_fics(code: str, answer: Record | None) -> str:
    from protocols.fics.commands import COMMANDS

    if code not in COMMANDS:
        return ""
    said = None if answer is None else _FICS.match(answer["data"])
    return _joined(_title(COMMANDS[code][0]), None if said is None else said[2] or ACCEPTED)


def _told(data: str, code: str) -> str:
    """The value of a reply, or why it is refused."""
    from protocols.rorze.errors import lookup
    from protocols.rorze.status import CONTROLLER_STATUS_BITS, END_CAUSE_BITS, SENSOR_BITS, names_of

    bits = {"9CD": CONTROLLER_STATUS_BITS, "9MD": END_CAUSE_BITS, "CLD": SENSOR_BITS}
    found = _RORZE.match(data)
    if found is None:
        return ""
    if found[2] is not None:
        return f"refused: {lookup(int(found[2], 16), code).en}"
    value = found[4]
    if code in bits and re.fullmatch("H[0-9A-F]{2}", value):
        return ", ".join(names_of(int(value[1:], 16), bits[code])).replace("_", " ") or "none"
    return str(int(value)) if _NUMBER.fullmatch(value) else value or ACCEPTED


def _title(row: type[Any] | None) -> str:
    return "" if row is None else str(row.titles()[1])


def _joined(title: str, told: str | None) -> str:
    return ": ".join(filter(None, (title, told)))
