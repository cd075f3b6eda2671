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
    own: Annotated[
        bool, typer.Option("--all", help="Show what the gateway asks by itself, too; JSON always does.")
    ] = False,
    url: Url = LOCAL,
    key_file: KeyFile = None,
    as_json: Json = False,
) -> None:
    """Print what went over a line: an answer behind its question, what they mean, and who asked."""
    client = Client.at(url, key_file)
    query = {name: value for name, value in (("bodies", bodies), ("request_id", request)) if value}
    query["last"] = str(last)
    try:
        for text in _texts(_records(client, f"/lines/{line}/trace", query, follow_on), own, as_json):
            typer.echo(text)
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


def _texts(records: Iterable[dict[str, Any]], own: bool, as_json: bool) -> Iterator[str]:
    if as_json:
        yield from (json.dumps(record, ensure_ascii=False) for record in records)
        return
    from app.wire import folded, meaning

    for record, answer in folded(records, own=own):
        kind = record["kind"]
        asked = (record.get(name) for name in ("caller", "request_id"))
        heard = None if answer is None else f"<-  {answer['data']}"
        sent = (record["at"], _DIRECTIONS.get(kind, kind), record["data"])
        yield "  ".join(filter(None, (*sent, heard, meaning(record, answer), *asked)))
