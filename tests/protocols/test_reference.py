"""The reference page is what the rows say."""

from pathlib import Path

from protocols.fics.commands import ROWS
from protocols.fics.moves import MoveAbsolute
from protocols.reference import page
from protocols.rorze.commands import COMMANDS

PAGE = Path(__file__).parents[2] / "docs" / "commands.md"


def test_the_page_in_the_docs_is_up_to_date() -> None:
    assert PAGE.read_text("utf-8") == page(), (
        "write it anew: python -m protocols.reference > docs/commands.md"
    )


def test_every_command_has_its_line() -> None:
    rorze, _, fics = page().partition("## C-HOST")
    lines = rorze.splitlines()
    for row in COMMANDS.values():
        assert sum(line.startswith(f"| `{row.code}` | `{row.name()}` |") for line in lines) == 1
    lines = fics.splitlines()
    for command in ROWS:
        assert sum(f"| `{command.name()}` |" in line for line in lines) == 1


def test_a_line_tells_the_rules_of_its_row() -> None:
    (line,) = [line for line in page().splitlines() if f"`{MoveAbsolute.name()}`" in line]
    assert line == (
        "| `LMA` | `move-absolute` | move the present unit to a position (絶対移動) | `{coordinates}` | "
        "on_completion | a b c | no | conditional | `LMA 100,,-30.5` `LMA` |"
    )
