"""The command line's part for journals: looked over, written out, copied, made smaller."""

import json
import os
import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, NoReturn

import typer

from gateway.core.journal import files
from gateway.core.journal.retention import Retention

EXIT_BROKEN = 1
EXIT_USAGE = 2

journal = typer.Typer(
    help="Look after the journal of a gateway; a gateway may be writing it.", no_args_is_help=True
)

Data = Annotated[Path, typer.Option("--data", help="The gateway's data directory.")]


def default_directory() -> Path:
    """Where a gateway keeps its journal if nothing else is said."""
    if os.geteuid() == 0:
        return Path("/var/lib/motion-gateway")
    state = os.environ.get("XDG_STATE_HOME")
    return (Path(state) if state else Path.home() / ".local" / "state") / "motion-gateway"


@journal.command()
def verify(data: Data) -> None:
    """See whether a journal is sound, and print what is wrong with it."""
    with _journals():
        complaints = files.verify(data)
    for complaint in complaints:
        typer.echo(complaint)
    if complaints:
        raise typer.Exit(EXIT_BROKEN)
    typer.echo("The journal is sound.")


@journal.command()
def export(data: Data) -> None:
    """Print every entry as a line of JSON, with the name of its table."""
    with _journals():
        for row in files.export(data):
            typer.echo(json.dumps(row, ensure_ascii=False))


@journal.command()
def backup(
    target: Annotated[Path, typer.Argument(help="The file to be made; it must not exist.")], data: Data
) -> None:
    """Copy a journal as it is at one moment."""
    with _journals():
        files.backup(data, target)
    typer.echo(f"The journal was copied to {target}.")


@journal.command()
def prune(
    data: Data,
    days: Annotated[float, typer.Option(min=0, help="Keep what is over for so long.")] = Retention.days,
    events: Annotated[int, typer.Option(min=0, help="Keep so many events.")] = Retention.events,
    moves: Annotated[int, typer.Option(min=0, help="Keep so many moves.")] = Retention.moves,
) -> None:
    """Forget what is too old or too much, and give its room back."""
    with _journals():
        forgotten = files.prune(data, Retention(days=days, events=events, moves=moves))
    typer.echo(f"{forgotten} entries were forgotten.")


@contextmanager
def _journals() -> Iterator[None]:
    """Tell in one sentence why a journal could not be used."""
    try:
        yield
    except FileExistsError as error:
        _fail(f"{error.filename} exists already; nothing was written.", EXIT_USAGE)
    except OSError as error:
        _fail(error.strerror or str(error), EXIT_USAGE)
    except sqlite3.Error as error:
        _fail(f"The journal cannot be read: {error}.", EXIT_BROKEN)


def _fail(sentence: str, code: int) -> NoReturn:
    typer.echo(sentence, err=True)
    raise typer.Exit(code)
