"""The names in the documentation exist: links, files, targets of make, commands and their options."""

import re
from pathlib import Path
from typing import Any

import pytest
from typer.main import get_command

from app.cli import app
from simulator.cli import app as simulator_app

ROOT = Path(__file__).parent.parent
PAGES = sorted([ROOT / "README.md", *(ROOT / "docs").rglob("*.md")])
FOLDERS = "|".join(folder.name for folder in ROOT.iterdir() if folder.is_dir() and folder.name[0] != ".")
NAMED_FILE = re.compile(rf"`((?:{FOLDERS})/[\w./-]*\w)")
LINK = re.compile(r"\]\((?!https?:)([^)#\s]*)(?:#([^)\s]+))?\)")
CALL = re.compile(r"(?<![\w/-])motion-gateway ([a-z][^`|;#)\n>]*)")

each_page = pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))


@each_page
def test_links_lead_to_a_file_and_a_heading(page: Path) -> None:
    for file, heading in LINK.findall(page.read_text("utf-8")):
        target = (page.parent / file).resolve() if file else page
        assert target.exists(), file
        assert not heading or heading in headings(target), f"{file}#{heading}"


@each_page
def test_named_files_are_there(page: Path) -> None:
    names = NAMED_FILE.findall(page.read_text("utf-8"))
    assert [name for name in names if not (ROOT / name).exists()] == []


@each_page
def test_named_targets_of_make_are_there(page: Path) -> None:
    makefile = (ROOT / "Makefile").read_text("utf-8")
    named = re.findall(r"(?:^ {4}|`)make (\w+)", page.read_text("utf-8"), re.MULTILINE)
    assert [target for target in named if f"\n{target}:" not in makefile] == []


@each_page
def test_commands_have_the_options_that_are_named(page: Path) -> None:
    for call in CALL.findall(page.read_text("utf-8")):
        command = command_of(call.split())
        known = {name for parameter in command.params for name in parameter.opts}
        assert {word.partition("=")[0] for word in call.split() if word.startswith("--")} <= known, call


def test_every_command_stands_in_the_page_of_the_command_line() -> None:
    page = (ROOT / "docs/command-line.md").read_text("utf-8")
    assert [name for name in command_of([]).commands if f"`{name}" not in page] == []


def command_of(words: list[str]) -> Any:
    """The command that is called; without words, the command line itself."""
    command: Any = get_command(app)
    if words[:1] == ["simulate"]:
        command, words = get_command(simulator_app), words[1:]
    while words and words[0] in getattr(command, "commands", ()):
        command, words = command.commands[words[0]], words[1:]
    return command


def headings(page: Path) -> set[str]:
    """The headings of a page, as links name them."""
    found = re.findall(r"^#+ (.*)$", page.read_text("utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in found}


def test_the_first_page_is_read_in_a_minute_and_shows_a_picture() -> None:
    page = (ROOT / "README.md").read_text("utf-8")
    before, _, _ = page.partition("\n    ")
    assert len(before.split()) <= 90
    assert len(page.split()) <= 400
    assert any(file.endswith(".png") for file, _ in LINK.findall(before))
