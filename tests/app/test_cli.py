"""The command line as a whole."""

import errno
import os
import subprocess
import sys
from importlib.metadata import version
from typing import Any

import pytest
import typer
from typer.testing import CliRunner

from app import exits
from app.cli import app
from tests.app.fake_gateway import always, move


@pytest.mark.parametrize("words", [["--version"], ["version"]])
def test_version(words: list[str]) -> None:
    said = CliRunner().invoke(app, words)
    assert (said.exit_code, said.stdout.strip()) == (0, version("motion-gateway"))


def test_shells_can_complete_it() -> None:
    said = CliRunner().invoke(app, ["--help"], env={"COLUMNS": "100"})
    assert "--install-completion" in said.stdout


def test_every_exit_code_is_explained() -> None:
    codes = {value for name, value in vars(exits).items() if name.isupper() and isinstance(value, int)}
    assert all(f" {code} " in exits.IN_WORDS for code in codes)


def test_the_worst_of_several_codes_is_what_has_to_be_seen_to_first() -> None:
    assert exits.worst() == exits.DONE
    assert exits.worst(exits.DONE, exits.USAGE, exits.REFUSED) == exits.REFUSED
    assert exits.worst(exits.UNKNOWN, exits.NOT_SENT, exits.REFUSED) == exits.UNKNOWN


def test_a_move_that_was_begun_and_cannot_be_printed_is_not_called_refused(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    say = typer.echo

    def echo(message: str, *, err: bool = False, **_: Any) -> None:
        if not err:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        say(message, err=True)

    monkeypatch.setattr(typer, "echo", echo)
    said = always(move("sent")).run(monkeypatch, "move", "3F", "relative", "5")
    assert said.exit_code == exits.UNKNOWN
    assert said.stderr.startswith(
        "The outcome cannot be printed: No space left on device. What was asked for may"
    )


def test_a_server_loads_nothing_that_only_commands_need() -> None:
    told = subprocess.run(  # noqa: S603  # our own words
        [
            *(sys.executable, "-c"),
            "import sys, app.cli, app.server, api.app; print({'httpx', 'rich', 'jwt'} & sys.modules.keys())",
        ],
        check=True,
        capture_output=True,
        text=True,
    )
    assert told.stdout.strip() == "set()"
