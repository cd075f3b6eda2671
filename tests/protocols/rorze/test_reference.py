"""The reference page is what the rows say."""

from pathlib import Path

from protocols.rorze.commands import COMMANDS
from protocols.rorze.reference import page

PAGE = Path(__file__).parents[3] / "docs" / "commands.md"


def test_the_page_in_the_docs_is_up_to_date() -> None:
    assert PAGE.read_text("utf-8") == page(), "write it anew: python -m protocols.rorze.reference"


def test_every_command_has_its_line() -> None:
    lines = page().splitlines()
    for code in COMMANDS:
        assert sum(line.startswith(f"| `{code}` |") for line in lines) == 1
