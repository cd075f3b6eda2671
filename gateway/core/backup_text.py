"""The text of a backup: headings in brackets, a line for each thing that is kept, comments after `;`."""

import re
from collections.abc import Iterable, Sequence
from typing import NamedTuple

from gateway.core.errors import InvalidText, Misplaced

COMMENT_COLUMN = 30
MOST_TOLD = 100
"""Faults of a text that are told at once, at most."""

_HEADING = re.compile(r"\[\s*(?P<words>[^\[\]]*?)\s*\]\s*(;.*)?")


class BackupLine(NamedTuple):
    """A line of a section."""

    number: int
    """Number of the line, from 1."""
    text: str


class BackupPart(NamedTuple):
    """The part of a backup that is about one controller."""

    name: str
    """Name in the heading: a body's number, a robot's id."""
    line: int
    sections: dict[str, list[BackupLine]]
    headings: dict[str, int]
    """The lines of the sections' headings."""


def refuse(faults: Sequence[Misplaced]) -> None:
    """Refuse a text that has faults.

    :raises InvalidText: it has, each with its line and column.
    """
    if faults:
        first = faults[0]
        more = f" There are {len(faults)} faults in all." if len(faults) > 1 else ""
        raise InvalidText(
            "backup",
            f"Line {first.line}, column {first.column}: {first.reason}{more} Nothing was sent.",
            "Correct the backup.",
            faults[:MOST_TOLD],
        )


def parts_of(text: str, kind: str) -> list[BackupPart]:
    """Cut a backup into its parts and their sections; `kind` begins the heading of a part, such as `body`.

    :raises InvalidText: a line has no place, a heading comes twice, or there is no part.
    """
    parts: list[BackupPart] = []
    faults: list[Misplaced] = []
    lines: list[BackupLine] | None = None
    for number, raw in enumerate(text.splitlines(), 1):
        line = raw.strip()
        heading = _HEADING.fullmatch(line)
        if heading is None:
            if lines is not None:
                lines.append(BackupLine(number, raw))
            elif line and not line.startswith(";"):
                faults.append(Misplaced(number, 1, "A heading such as [settings] has to come first."))
            continue
        words = " ".join(heading["words"].split())
        begins, _, name = words.partition(" ")
        if begins == kind:
            lines = None
            if any(part.name == name for part in parts):
                faults.append(Misplaced(number, 1, f"[{words}] comes twice."))
            parts.append(BackupPart(name, number, {}, {}))
        elif not parts or words in parts[-1].sections:
            twice = f"[{words}] comes twice."
            missing = f"A heading such as [{kind} ...] has to come first."
            faults.append(Misplaced(number, 1, twice if parts else missing))
        else:
            lines = parts[-1].sections[words] = []
            parts[-1].headings[words] = number
    if not parts and not faults:
        faults.append(Misplaced(1, 1, f"There is no heading [{kind} ...]."))
    empty = [part for part in parts if not part.sections]
    faults += [Misplaced(part.line, 1, f"[{kind} {part.name}] has no sections.") for part in empty]
    refuse(sorted(faults))
    return parts


def commented(text: str, comment: str) -> str:
    """A line with its comment."""
    return f"{text:<{COMMENT_COLUMN - 1}} ; {comment}\n"


def section(name: str, lines: Iterable[str]) -> str:
    """A section with its heading."""
    return f"\n[{name}]\n{''.join(lines)}"
