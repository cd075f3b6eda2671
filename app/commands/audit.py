"""The command line's part for the security log: the chain of its entries, followed to its end."""

from typing import Annotated

import typer

from app import exits
from app.data_directory import Data, data_directory
from app.exits import Failure
from gateway.security import chain

audit = typer.Typer(
    help="Look after the security log of a gateway; a gateway may be writing it.", no_args_is_help=True
)


@audit.command()
def verify(
    data: Data = None,
    head: Annotated[
        str | None, typer.Option(help="NUMBER:HASH of an entry as it was printed before; it must be there.")
    ] = None,
) -> None:
    """Follow the chain of the security log, and print the first entry that does not hold.

    The last entry's number and hash are printed: kept elsewhere, they show later what was cut off or forged.
    """
    directory = data or data_directory()
    try:
        verdict = chain.verify(directory, head)
    except FileNotFoundError as error:
        raise Failure(str(error), exits.USAGE) from None
    except OSError as error:
        raise Failure(f"The security log cannot be read: {error.strerror}.", exits.USAGE) from None
    if verdict.fault is not None:
        typer.echo(verdict.fault)
        raise typer.Exit(1)
    typer.echo(f"The chain holds: entries {verdict.first} to {verdict.head.number}.")
    if verdict.torn:
        typer.echo("The last line was cut off while it was written; the next entry takes it off and says so.")
    typer.echo(f"Its head is {verdict.head.number}:{verdict.head.hash}")
