"""The command line as a whole."""

import errno
import os
import subprocess
import sys
from importlib.metadata import version
from typing import Any, get_args

import pytest
import typer
from typer.main import get_command
from typer.testing import CliRunner

from app import client, exits, targets
from app.cli import COMMANDS, app
from app.commands import jog, lease, program, stop
from gateway.core.errors import Ambiguous, GarbledReply, NoReply
from gateway.core.leases import LONGEST_S
from gateway.core.move_record import MoveStatus
from gateway.core.stops import CONFIRM_WITHIN_S, StopMode
from protocols.rorze.programs import LAST_ADDRESS
from protocols.rorze.row import FIRST_GROUP
from tests.app.fake_gateway import always, move

OWN = {"serve", "init", "keys", "journal", "data", "audit", "bridge", "commission", "plant"}
"""Commands that ask no gateway: they are one or stand beside it, look after its files, or take minutes."""
HEAVY = {"asyncio", "httpx", "importlib.metadata", "logging", "pydantic", "rich", "sqlite3", "uvicorn"}


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


@pytest.mark.parametrize("name", sorted({place.partition(":")[0] for place in COMMANDS.values()} - OWN))
def test_a_call_loads_nothing_that_takes_long(name: str) -> None:
    """A command that asks a running gateway is at its port in a fraction of a second."""
    program = f"import sys, app.cli, app.commands.{name}; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)  # noqa: S603
    assert HEAVY.isdisjoint(done.stdout.split())


def test_what_is_written_out_to_load_nothing_is_that_of_the_gateway() -> None:
    assert {status for status in MoveStatus if status.final} == client.OVER
    assert {NoReply.kind, GarbledReply.kind} == client.UNANSWERED
    assert Ambiguous.kind == client.AMBIGUOUS
    assert get_args(stop.StopMode) == get_args(StopMode.__value__)
    assert lease.LONGEST_S == LONGEST_S
    assert jog.STILL_WITHIN_S == 2 * CONFIRM_WITHIN_S
    assert program.LAST_ADDRESS == LAST_ADDRESS
    assert targets.FIRST_GROUP == FIRST_GROUP


def test_every_command_is_found_by_its_name() -> None:
    assert {name: command.name for name, command in get_command(app).commands.items()} == {  # type: ignore[attr-defined]  # it is a group
        name: name for name in (*COMMANDS, "version", "simulate")
    }


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
