"""The command table as a page to read: `python -m protocols.rorze.reference > docs/commands.md`."""

from inspect import getdoc

from protocols.rorze.commands import CHAPTERS, COMMANDS, Row
from protocols.rorze.row import LinkMasterCommand

_HEAD = """\
# The RC-420 command table

Written from the rows in `protocols/rorze/` by `python -m protocols.rorze.reference`; `GET /commands` gives
the same with the schemas of parameters and replies. A name is the last part of a command's route,
`/bodies/{body_id}/commands/{name}`. *Modes* are those of EAS: 0 stepping, 1 encoder, 2 servo. *Moving* says
whether a running motor allows the command, *retry* what the gateway may do by itself when the outcome is not
known (`read`, `setting`, `conditional`, `never`, `stop`).
"""


def page() -> str:
    """Write the whole page, in the order of the manual's chapters."""
    parts = [_HEAD]
    for chapter in CHAPTERS:
        rows = [row for row in COMMANDS.values() if row.__module__ == chapter.__name__]
        title = (getdoc(chapter) or "").partition("\n")[0].rstrip(".")
        parts += [f"## {title}\n", *_HEADERS, *map(_line, rows), ""]
    return "\n".join(parts)


_HEADERS = (
    "| code | name | | parameters | modes | moving | retry | errors | example |",
    "|---|---|---|---|---|---|---|---|---|",
)


def _line(row: Row) -> str:
    japanese, english = row.titles()
    parameters = " or ".join(f"`{form}`" if form != "no parameters" else "none" for form in row.usage())
    link_master = issubclass(row, LinkMasterCommand)
    cells = (
        f"`{row.code}`",
        f"`{row.name()}`",
        f"{english} ({japanese})",
        parameters,
        "" if link_master else row.modes,
        "yes" if row.moving else "no",
        row.retry,
        " ".join(f"{code:02X}" for code in sorted(row.errors)),
        " ".join(f"`{text}`" for text in row.example[:2]),
    )
    return f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in cells)} |"


if __name__ == "__main__":
    print(page(), end="")
