"""The tables of pages that are made of the assumptions: `python -m commissioning.page` writes them anew."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Final

from commissioning.assumptions import ASSUMPTIONS, BOTH, FICS, RORZE, Assumption, Level

DOCS: Final = Path(__file__).parent.parent / "docs"
HEAD: Final = (
    "| name | what is assumed | how it is tried | takes | may do | if it does not hold | the gateway then |"
)
_FAMILIES: Final = (
    ("Lines of both kinds", BOTH),
    ("An RC-400 with its RC-420s", RORZE),
    ("A Fics robot", FICS),
)
_LEVELS: Final = {
    Level.QUESTIONS: "questions",
    Level.SETTINGS: "`--allow settings`",
    Level.MOTION: "`--allow motion`",
}


def decision() -> Iterator[str]:
    """The table of decision 5."""
    yield "| assumption | where |"
    yield "|---|---|"
    yield from (f"| {row.assumed.rstrip('.')} | {row.held} |" for row in ASSUMPTIONS if row.slug != "echo")


def hardware() -> Iterator[str]:
    """The tables of the page of the first day at a machine."""
    for title, rows in _FAMILIES:
        yield from (f"### {title}", "", HEAD, "|---|---|---|---|---|---|---|", *_rows(rows), "")


def _rows(rows: Iterable[Assumption]) -> Iterator[str]:
    for row in rows:
        takes = _LEVELS[row.level] + (", a person at the power switch" if row.person else "")
        cells = (
            f"`{row.slug}`",
            row.assumed,
            row.probe,
            takes,
            row.motor,
            f"{row.false} {_remedy(row)}",
            _shown(row),
        )
        yield f"| {' | '.join(cells)} |"


def _remedy(row: Assumption) -> str:
    """The remedy where an assumption does not hold."""
    if not row.key:
        return "Nothing has to be changed." if row.harmless else "It contradicts the gateway: no motion."
    otherwise = " Without it, too, the gateway is right." if row.harmless else ""
    return f"`{row.key}` is proposed.{otherwise}"


def _shown(row: Assumption) -> str:
    """How the gateway does on a simulator that is otherwise, as the tests show."""
    changed = "is right with the change, and honest without it" if row.key else "is honest"
    shown = "is right as it is" if row.harmless else changed
    return f"{shown}; {row.rest}" if row.rest else shown


PAGES: Final[Mapping[str, tuple[str, Callable[[], Iterator[str]]]]] = MappingProxyType(
    {
        "decisions/0005-real-hardware-assumptions.md": ("| assumption | where |", decision),
        "hardware.md": ("### Lines of both kinds", hardware),
    }
)
"""Pages by their paths under docs: the row with which the tables begin, and the function that writes them."""


def written(name: str) -> str:
    """A page with its tables as the rows say now; what stands above them is written by hand."""
    begins, tables = PAGES[name]
    by_hand, _, _ = (DOCS / name).read_text("utf-8").partition(f"{begins}\n")
    return by_hand + "\n".join(tables()).rstrip("\n") + "\n"


if __name__ == "__main__":
    for page in PAGES:
        (DOCS / page).write_text(written(page), "utf-8")
