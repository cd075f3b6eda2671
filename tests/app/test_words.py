"""The command line says of an option what the row of the door says of it, where both mean the same."""

from collections.abc import Iterator
from typing import Any

import pytest
import typer
from typer.testing import CliRunner

from app import words
from app.cli import app


def commands(command: Any) -> Iterator[Any]:
    yield command
    for inner in getattr(command, "commands", {}).values():
        yield from commands(inner)


def taken() -> Iterator[tuple[Any, str]]:
    """Each command with an option whose words are a row's, and these."""
    for command in commands(typer.main.get_command(app)):
        for option in command.params:
            text = getattr(option, "help", None) or ""
            if text.startswith("\0"):
                yield command, text.removeprefix("\0")


def test_words_of_rows_are_found_and_are_shown_by_commands_that_put_them_in() -> None:
    found = list(taken())
    assert len(found) >= 15
    for command, text in found:
        assert isinstance(command, words.WordedCommand), command.name
        assert len(words.told(*text.split("."))) > 10


@pytest.mark.parametrize(
    ("command", "sentence"),
    [
        (["stop"], "`decelerate` is command 5SS"),
        (["diff"], "(`[scale]`)"),
        (["lease", "take"], "End the leases of others"),
        (["restore"], "compare again"),
        (["trace"], "Only records about these bodies of the line"),
    ],
)
def test_help_has_the_words_of_the_row(command: list[str], sentence: str) -> None:
    said = CliRunner().invoke(app, [*command, "--help"], env={"COLUMNS": "300", "TERM": "dumb"})
    assert said.exit_code == 0
    assert sentence in " ".join(said.stdout.split())


def test_shells_are_told_the_same() -> None:
    stop = typer.main.get_command(app).commands["stop"]  # type: ignore[attr-defined]  # it is a group
    shown = stop.shell_complete(stop.make_context("stop", []), "--mo")
    assert [word.value for word in shown] == ["--mode"]
    assert "5SS" in shown[0].help


def test_what_no_row_has_is_a_fault() -> None:
    with pytest.raises(LookupError):
        words.told("stopAll", "speed")
    with pytest.raises(ValueError, match="unpack"):
        words.told("stopAl", "mode")
