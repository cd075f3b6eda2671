"""A line of a gateway that is gone, taken over by a spare one: `take-over`."""

import sys
from typing import Annotated

import typer

from app import exits, words
from app.client import LOCAL, Client, Json, KeyFile, Url
from app.exits import Failure, Misuse
from app.output import json_text

READY = ("ready", "out_of_step")


def take_over(
    line: Annotated[str, typer.Argument(help="The id of the line.")],
    old: Annotated[str, typer.Option("--from", help=words.of("takeOverLine", "old"))],
    has_cut: Annotated[
        bool,
        typer.Option(
            "--i-have-cut-the-old-one",
            help=words.of("takeOverLine", "has_cut"),
        ),
    ] = False,
    url: Url = LOCAL,
    key_file: KeyFile = None,
    as_json: Json = False,
) -> None:
    """Have the gateway at the URL take a line over. The terminal server throws the old gateway out.

    Exit code 0 only when the line is ready. A move under way goes on.
    """
    if not has_cut:
        _ask(line, old)
    client = Client.at(url, key_file)
    told = client.request("POST", f"/lines/{line}/take-over", {"old": old, "has_cut": True}, wait_s=TAKES_S)
    if as_json:
        typer.echo(json_text(told))
    else:
        owner = told["owner"]
        typer.echo(
            f"{line} is {told['state']}: gateway {owner['gateway']} has it since epoch {owner['epoch']}."
        )
    if told["state"] not in READY:
        raise Failure(
            f"The line is not ready: {told['down_reason'] or told['state']}. Moves of {old} are unknown.",
            exits.UNDER_WAY,
        )


TAKES_S = 30.0


def _ask(line: str, old: str) -> None:
    """Ask a person what was cut; a script has to say it by the option."""
    if not sys.stdin.isatty():
        raise Misuse(f"Say --i-have-cut-the-old-one once {old} is off, or cannot reach the terminal server")
    typer.echo(
        f"Two gateways on {line} could move its motors at once. Switch {old} off, or pull its network cable.",
        err=True,
    )
    if not typer.confirm(f"Have you cut {old} off?", err=True):
        raise Misuse(f"{line} stays with {old}")
