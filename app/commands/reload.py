"""The configuration of a running gateway, read again: `reload`."""

from collections.abc import Iterator
from typing import Annotated, Any

import typer

from app import exits, words
from app.client import LOCAL, Client, Json, KeyFile, Url
from app.exits import Failure
from app.output import json_text


def reload(
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help=words.of("reloadConfiguration", "dry_run"))
    ] = False,
    url: Url = LOCAL,
    key_file: KeyFile = None,
    as_json: Json = False,
) -> None:
    """Let a gateway read its configuration file again; lines that did not change go on undisturbed."""
    client = Client.at(url, key_file)
    try:
        answer = client.request("POST", "/system/reload", {"dry_run": dry_run})
    except Failure as failure:  # all that can be wrong with this request is the file
        code = exits.CONFIG if failure.code == exits.USAGE else failure.code
        raise Failure(str(failure), code) from None
    typer.echo(json_text(answer) if as_json else "\n".join(_told(answer)))


def _told(answer: dict[str, Any]) -> Iterator[str]:
    for line in answer["lines"]:
        keys = f": {', '.join(line['keys'])}" if line["keys"] else ""
        yield f"line {line['line_id']}  {line['change']}{keys}"
    if answer["needs_restart"]:
        yield f"A restart alone changes {', '.join(answer['needs_restart'])}."
    if answer["busy"]:
        yield f"Refused while {', '.join(answer['busy'])} moves or is at work."
    if not answer["lines"]:
        yield "All lines are as they were."
    elif not answer["applied"]:
        yield "Nothing was changed."
