"""The traffic of a line from the command line: `trace`."""

import json
import re
from collections.abc import Iterable, Iterator, Mapping
from typing import Annotated, Any, Final
from urllib.parse import urlencode

import typer

from app import exits, words
from app.client import LOCAL, Client, Json, KeyFile, Url
from app.commands.watch import follow

MOST: Final = 10_000
"""Records that the gateway tells at once."""
_ONLY_POLLS: Final = "Lately only the gateway itself has asked, to see how things are: --all shows it."
_NOTHING: Final = "Nothing of that went over the line lately."
_DIRECTIONS: Final = {"tx": "->", "rx": "<-"}


def trace(
    line: Annotated[str, typer.Argument(help="The line, as the configuration names it.")],
    bodies: Annotated[str | None, typer.Option(help=words.of("getTrace", "bodies"))] = None,
    request: Annotated[str | None, typer.Option(help=words.of("getTrace", "request_id"))] = None,
    last: Annotated[int, typer.Option(min=1, max=MOST, help="How many of the newest to show.")] = 100,
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
    query["polls"] = str(own or as_json).lower()
    path = f"/lines/{line}/trace"
    if not follow_on:
        _show_newest(client, path, query, last, as_json)
        return
    try:
        for text in _texts(_followed(client, f"{path}/stream", {**query, "last": str(last)}), as_json):
            typer.echo(text)
    except KeyboardInterrupt:
        raise typer.Exit(exits.DONE) from None


def _show_newest(client: Client, path: str, query: dict[str, str], last: int, as_json: bool) -> None:
    """Show as many lines as wanted, most of them two records; or say that there is none."""
    texts = list(_texts(_records(client, path, query, min(2 * last, MOST)), as_json))[-last:]
    for text in texts:
        typer.echo(text)
    if not texts:
        polled = _records(client, path, {**query, "polls": "true"}, 1)
        typer.echo(_ONLY_POLLS if polled else _NOTHING, err=True)


def _records(client: Client, path: str, query: dict[str, str], limit: int) -> list[dict[str, Any]]:
    told = client.request("GET", f"{path}?{urlencode({**query, 'limit': limit})}")
    return list(told["entries"])


def _followed(client: Client, path: str, query: dict[str, str]) -> Iterator[dict[str, Any]]:
    for told in follow(client, path, query):
        if missed := told.get("missed"):
            typer.echo(f"{missed} records were forgotten before they could be told.", err=True)
        else:
            yield told


def _texts(records: Iterable[dict[str, Any]], as_json: bool) -> Iterator[str]:
    if as_json:
        yield from (json.dumps(record, ensure_ascii=False) for record in records)
        return
    for record, answer in folded(records):
        kind = record["kind"]
        asked = (record.get(name) for name in ("caller", "request_id"))
        heard = None if answer is None else f"<-  {answer['data']}"
        sent = (record["at"], _DIRECTIONS.get(kind, kind), record["data"])
        yield "  ".join(filter(None, (*sent, heard, meaning(record, answer), *asked)))


Record = Mapping[str, Any]
ACCEPTED: Final = "accepted"
_RORZE: Final = re.compile(r">?&([0-9A-F]{2})(?:@([0-9A-F]{2})|([0-9A-Z][0-9A-Z+*-][0-9A-Z])(.*?))(?:\\r|$)")
_FICS: Final = re.compile(r"([0-9A-Z]{3})(?: (.*?))?(?:\\r|$)")
_NUMBER: Final = re.compile(r"[+-]?\d+")


def folded(records: Iterable[Record]) -> Iterator[tuple[Record, Record | None]]:
    """Put an answer that follows its question behind it."""
    question: Record | None = None
    for record in records:
        if question is not None and record["kind"] == "rx" and _subject(record) == _subject(question):
            yield question, record
            question = None
            continue
        if question is not None:
            yield question, None
        question = record if record["kind"] == "tx" else None
        if question is None:
            yield record, None
    if question is not None:
        yield question, None


def _subject(record: Record) -> str:
    """The part that a command and its answer share: a refusal names its body alone."""
    found = _RORZE.match(record["data"]) or _FICS.match(record["data"])
    return found[1] if found else ""


def meaning(record: Record, answer: Record | None) -> str:
    """Say what was asked, and what the answer tells; nothing of what no table knows."""
    if found := _RORZE.match(record["data"]):
        return _of_rorze(found[3] or "", answer)
    if found := _FICS.match(record["data"]):
        return _of_fics(found[1], answer)
    return ""


def _of_rorze(code: str, answer: Record | None) -> str:
    from protocols.rorze.commands import COMMANDS  # a family's tables take a quarter of a second

    told = None if answer is None else _told(answer["data"], code)
    return _joined(_title(COMMANDS.get(code)), told)


def _of_fics(code: str, answer: Record | None) -> str:
    from protocols.fics.commands import COMMANDS

    if code not in COMMANDS:
        return ""
    said = None if answer is None else _FICS.match(answer["data"])
    return _joined(_title(COMMANDS[code][0]), None if said is None else said[2] or ACCEPTED)


def _told(data: str, code: str) -> str:
    """The value of a reply, or why it is refused."""
    from protocols.rorze.errors import lookup
    from protocols.rorze.status import CONTROLLER_STATUS_BITS, END_CAUSE_BITS, SENSOR_BITS, names_of

    bits = {"9CD": CONTROLLER_STATUS_BITS, "9MD": END_CAUSE_BITS, "CLD": SENSOR_BITS}
    found = _RORZE.match(data)
    if found is None:
        return ""
    if found[2] is not None:
        return f"refused: {lookup(int(found[2], 16), code).en}"
    value = found[4]
    if code in bits and re.fullmatch("H[0-9A-F]{2}", value):
        return ", ".join(names_of(int(value[1:], 16), bits[code])).replace("_", " ") or "none"
    return str(int(value)) if _NUMBER.fullmatch(value) else value or ACCEPTED


def _title(row: type[Any] | None) -> str:
    return "" if row is None else str(row.titles()[1])


def _joined(title: str, told: str | None) -> str:
    return ": ".join(filter(None, (title, told)))
