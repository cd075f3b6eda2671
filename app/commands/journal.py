"""The command line's part for journals: looked over, written out, copied, made smaller."""

import json
import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer

from app import exits
from app.data_directory import Data, data_directory
from app.exits import Failure
from gateway.core.journal import files
from gateway.core.journal.disk import DiskFailed, NotWritable
from gateway.core.journal.schema import VERSION
from gateway.core.journal.writes import Retention

journal = typer.Typer(
    help="Look after the journal of a gateway; a gateway may be writing it.", no_args_is_help=True
)


@journal.command()
def verify(data: Data = None) -> None:
    """See whether a journal is sound, and print what is wrong with it."""
    directory = data or data_directory()
    with explained():
        complaints = files.verify(directory)
        for complaint in complaints:
            typer.echo(complaint)
        if complaints:
            raise typer.Exit(exits.REFUSED)
        version = files.version_of(directory)
    typer.echo("The journal is sound.")
    if version < VERSION:
        typer.echo(
            f"Its tables are of version {version}; the next start of this gateway brings them to {VERSION}."
        )


@journal.command()
def export(data: Data = None) -> None:
    """Print every entry as a line of JSON, with the name of its table."""
    with explained():
        for row in files.export(data or data_directory()):
            typer.echo(json.dumps(row, ensure_ascii=False))


@journal.command()
def backup(
    target: Annotated[Path, typer.Argument(help="The file to be made; it must not exist.")],
    data: Data = None,
) -> None:
    """Copy a journal as it is at one moment."""
    with explained():
        files.backup(data or data_directory(), target)
    typer.echo(f"The journal was copied to {target}.")


@journal.command()
def prune(
    data: Data = None,
    days: Annotated[float, typer.Option(min=0, help="Keep ended entries for this time.")] = Retention.days,
    events: Annotated[int, typer.Option(min=0, help="Keep so many events.")] = Retention.events,
    moves: Annotated[int, typer.Option(min=0, help="Keep so many moves.")] = Retention.moves,
    mebibytes: Annotated[
        int, typer.Option(min=1, help="Keep the file below this size.")
    ] = Retention.mebibytes,
) -> None:
    """Forget what is too old or too much, and give its room back unless a gateway runs."""
    with explained():
        kept = Retention(days=days, events=events, moves=moves, mebibytes=mebibytes)
        pruned = files.prune(data or data_directory(), kept)
    typer.echo(f"{pruned.forgotten} entries were forgotten.")
    if not pruned.is_smaller:
        typer.echo(
            "A gateway runs on this journal: the file keeps its size, and the room in it is used again. "
            "Prune while none runs to make the file smaller."
        )


@contextmanager
def explained(unchanged: str = "") -> Iterator[None]:
    """Tell in one sentence why files of a data directory could not be used; `unchanged` is its last clause.

    :raises Failure: they could not.
    """
    try:
        yield
    except FileExistsError as error:
        raise Failure(f"{error.filename} exists already; nothing was written.", exits.USAGE) from None
    except (NotWritable, DiskFailed) as error:
        raise Failure(f"The journal cannot be used: {error}.", exits.REFUSED) from None
    except files.OtherVersion as error:
        raise Failure(str(error), exits.REFUSED) from None
    except BrokenPipeError:
        raise  # nobody reads on
    except OSError as error:
        place = f"{error.filename}: " if error.filename else ""
        told = f"{place}{error.strerror}{unchanged}." if error.strerror else str(error)  # which is a sentence
        raise Failure(told, exits.USAGE) from None
    except sqlite3.Error as error:
        raise Failure(f"The journal cannot be read: {error}.", exits.REFUSED) from None
