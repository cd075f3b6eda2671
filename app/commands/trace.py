"""The traffic of a line from the command line: `trace`."""

import json
from collections.abc import Iterable, Iterator
from typing import Annotated, Any, Final
from urllib.parse import urlencode

import typer

from app import exits, words
from app.client import LOCAL, Client, Json, KeyFile, Url
from app.commands.watch import follow

_DIRECTIONS: Final = {"tx": "->", "rx": "<-"}


def trace(
    line: Annotated[str, typer.Argument(help="The line, as the configuration names it.")],
    bodies: Annotated[str | None, typer.Option(help=words.of("getTrace", "bodies"))] = None,
    request: Annotated[str | None, typer.Option(help=words.of("getTrace", "request_id"))] = None,
    last: Annotated[int, typer.Option(min=1, max=10_000, help=words.of("getTrace", "limit"))] = 100,
    follow_on: Annotated[bool, typer.Option("--follow", help="Go on with what comes, until Ctrl-C.")] = False,
    url: Url = LOCAL,
    key_file: KeyFile = None,
    as_json: Json = False,
) -> None:
    """Print what was sent and received on a line, a record each, with who asked for it."""
    client = Client.at(url, key_file)
    query = {name: it for name, it in (("bodies", bodies), ("request_id", request)) if it}
    query["last"] = str(last)
    try:
        for record in _records(client, f"/lines/{line}/trace", query, follow_on):
            typer.echo(json.dumps(record, ensure_ascii=False) if as_json else _line(record))
    except KeyboardInterrupt:
        raise typer.Exit(exits.DONE) from None


def _records(client: Client, path: str, query: dict[str, str], follow_on: bool) -> Iterable[dict[str, Any]]:
    if not follow_on:
        return list(client.request("GET", f"{path}?{urlencode(query)}")["entries"])
    return _followed(client, f"{path}/stream", query)


def _followed(client: Client, path: str, query: dict[str, str]) -> Iterator[dict[str, Any]]:
    for told in follow(client, path, query):
        if missed := told.get("missed"):
            typer.echo(f"{missed} records were forgotten before they could be told.", err=True)
        else:
            yield told


def _line(record: dict[str, Any]) -> str:
    kind = record["kind"]
    asked = (record.get(name) for name in ("caller", "request_id"))
    facts = (record["at"], _DIRECTIONS.get(kind, kind), record["data"], *asked)
    return "  ".join(filter(None, facts))
