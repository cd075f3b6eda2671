"""The command tables as a page to read: `python -m protocols.reference > docs/commands.md`."""

from collections.abc import Callable, Iterable, Mapping
from inspect import getdoc
from types import ModuleType
from typing import Any, Final

from protocols.fics import commands as fics
from protocols.rorze import commands as rorze
from protocols.rorze.row import LinkMasterCommand
from protocols.rorze.user_program.operations import OPERATIONS, OperationRow
from protocols.table import Command

Row = type[Command[Any]]
Columns = Mapping[str, Callable[[Any], str]]
"""The facts of a row, by the heads of the columns."""

_HEAD = """\
# The command tables

Written from the rows in `protocols/` by `make documents`; `GET /commands` gives the same with
the schemas of parameters and replies. *Retry* says what comes of repeating a command when no reply came.
The gateway repeats only `read` and software stops. `setting`: read back, and repeat what
differs; `conditional`: look first, for it may hide an alarm, wear the flash memory or move; `never`: it is
done twice. Whatever steps the position index (`P[+]`, `P[-]`) is never repeated.
"""
_RORZE_HEAD = """\
## RC-420 and RC-400

A name is the last part of a command's route, `/bodies/{body_id}/commands/{name}`, for a group
`/groups/{group_id}/commands/{name}` and for the link master `/lines/{line_id}/commands/{name}`. *Modes* are
those of EAS: 0 stepping, 1 encoder, 2 servo. *Moving* says whether a running motor allows the command.
"""
_OPERATIONS_HEAD = """\
### What only a user program can have (RC-420 manual 16, 20)

`protocols/rorze/user_program/` assembles program texts: one instruction a line, a comment after `;`. An
instruction is one of these, a command of the tables above that programs may have, with data memories
(D0-D199, DIX, DIY) for its numbers, or a label, `*` and a name. Commands and labels take 3 of 6,039 steps.
"""
_FICS_HEAD = """\
## C-HOST of Fics robots

A name is the last part of a command's route, `/robots/{robot_id}/units/{unit}/commands/{name}` or, where
the command knows no unit, `/robots/{robot_id}/commands/{name}`. *Answered* says when a robot answers:
`always`, at once and with data; `on_completion` or `at_once`, when the command is done or accepted, with
its bare name, and in Ver.2 not at all. *Blocked* has the letters of C-HOST manual 1-7: a the teaching
terminal runs something, b it edits something, c something moves by a command, d something moves in the
present unit. *Upload* says whether the command is allowed between POF 1 and POF 2.
"""


def page() -> str:
    """Write the whole page, in the order of the manuals."""
    parts = [
        _HEAD,
        _RORZE_HEAD,
        *_chapters(rorze.CHAPTERS, rorze.COMMANDS.values(), _RORZE_COLUMNS),
        _OPERATIONS_HEAD,
        *_operations(),
        _FICS_HEAD,
        *_chapters(fics.TOPICS, fics.ROWS, _FICS_COLUMNS),
    ]
    return "\n".join(parts)


def _chapters(topics: Iterable[ModuleType], rows: Iterable[Row], columns: Columns) -> Iterable[str]:
    everything = list(rows)
    for topic in topics:
        title = (getdoc(topic) or "").partition("\n")[0].rstrip(".")
        yield f"### {title}\n"
        yield _line(columns)
        yield "|" + "---|" * len(columns)
        for row in everything:
            if row.__module__ == topic.__name__:
                yield _line(cell(row) for cell in columns.values())
        yield ""


def _operations() -> Iterable[str]:
    yield _line(_OPERATION_COLUMNS)
    yield "|" + "---|" * len(_OPERATION_COLUMNS)
    for row in OPERATIONS.values():
        yield _line(cell(row) for cell in _OPERATION_COLUMNS.values())
    yield ""


def _operands(row: OperationRow) -> str:
    """Every form of an operation: its operands, each of some kind."""
    forms = [" ".join(f"[{kind.words}]" for kind in form.kinds) for form in row.forms]
    return " or ".join(forms)


def _steps(row: OperationRow) -> str:
    return " or ".join(str(steps) for steps in sorted({form.steps for form in row.forms}))


def _line(cells: Iterable[str]) -> str:
    return f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in cells)} |"


def _titles(row: Row) -> str:
    japanese, english = row.titles()
    return f"{english} ({japanese})"


def _parameters(row: Row) -> str:
    return " or ".join(f"`{form}`" if form != "no parameters" else "none" for form in row.usage())


def _example(row: Row) -> str:
    return " ".join(f"`{text}`" for text in row.example[:2])


def _yes_or_no(value: bool) -> str:
    return "yes" if value else "no"


def _modes(row: rorze.Row) -> str:
    return "" if issubclass(row, LinkMasterCommand) else row.modes


_RORZE_COLUMNS: Final[Columns] = {
    "code": lambda row: f"`{row.code}`",
    "name": lambda row: f"`{row.name()}`",
    "": _titles,
    "parameters": _parameters,
    "modes": _modes,
    "moving": lambda row: _yes_or_no(row.moving),
    "retry": lambda row: row.retry,
    "errors": lambda row: " ".join(f"{code:02X}" for code in sorted(row.errors)),
    "example": _example,
}
_OPERATION_COLUMNS: Final[Mapping[str, Callable[[OperationRow], str]]] = {
    "code": lambda row: f"`{row.code}`",
    "": lambda row: f"{row.en} ({row.ja})",
    "operands": _operands,
    "steps": _steps,
}
_FICS_COLUMNS: Final[Columns] = {
    "code": lambda row: f"`{row.code}`" if row.code else "",
    "name": lambda row: f"`{row.name()}`",
    "": _titles,
    "parameters": _parameters,
    "answered": lambda row: row.answered,
    "blocked": lambda row: " ".join(sorted(row.blocked)),
    "upload": lambda row: _yes_or_no(row.during_upload),
    "retry": lambda row: row.retry,
    "example": _example,
}


if __name__ == "__main__":
    print(page(), end="")
