"""Looking at a running gateway from the command line: `status` and `watch`."""

import json
import time
from collections.abc import Iterable, Iterator
from itertools import islice
from typing import Annotated, Any

import typer

from app import exits, http, words
from app.client import ANSWER_S, LOCAL, Client, Json, KeyFile, Url, refusal, why_not_reached
from app.exits import Failure
from app.output import Row, json_text, table
from app.targets import find

SILENT_S = 45.0
"""A stream says that it is still here every 15 s; one that does not is begun anew."""
TRY_AGAIN_S = 1.0
SHOWN = (
    *("status", "state", "command", "position", "end_cause", "reason", "detail", "seconds"),
    *("pulses", "value", "sensor", "number", "name", "on", "text"),
)
"""Members of an event's data that are shown in its line."""


def status(url: Url = LOCAL, key_file: KeyFile = None, as_json: Json = False) -> None:
    """Show the lines, bodies, SCARA robots and robots of a running gateway; no controller is asked."""
    client = Client.at(url, key_file)
    everything = {
        kind: client.made(kind) if kind == "scaras" else client.request("GET", f"/{kind}")[kind]
        for kind in ("lines", "bodies", "scaras", "robots")
    }
    if as_json:
        typer.echo(json_text(everything))
        return
    tables = [
        table(("LINE", "STATE", "ADDRESS", "TROUBLE"), map(_line_row, everything["lines"])),
        table(("BODY", "NAME", "STATE", "POSITION", "NOTE"), map(_body_row, everything["bodies"])),
        table(("SCARA", "NAME", "STATE", "AXES", "NOTE"), map(_scara_row, everything["scaras"])),
        table(("ROBOT", "NAME", "STATE", "UNITS", "NOTE"), map(_robot_row, everything["robots"])),
    ]
    typer.echo("\n\n".join(table for table in tables if "\n" in table))


def _line_row(line: dict[str, Any]) -> Row:
    return line["line_id"], line["state"], line["address"], line["down_reason"] or ""


def _body_row(body: dict[str, Any]) -> Row:
    position = "" if body["position"] is None else str(body["position"])
    errors = (bit.replace("_", " ") for bit in body["status"] or () if bit.endswith("_error"))
    note = "; ".join(filter(None, (_lost_power(body), *errors)))
    return body["body_id"], body["name"], _state(body), position, note


def _scara_row(scara: dict[str, Any]) -> Row:
    axes = ", ".join(axis["body_id"] for axis in scara["axes"])
    return scara["scara_id"], scara["name"], _state(scara), axes, _lost_power(scara)


def _robot_row(robot: dict[str, Any]) -> Row:
    units = ", ".join(
        f"{unit['number']}: {''.join(axis['name'] for axis in unit['axes'])}" for unit in robot["units"]
    )
    error = f"error {robot['error']['code']}" if robot["error"] else ""
    missing = ", ".join(f"no unit {number}" for number in robot["missing_units"])
    note = "; ".join(filter(None, (_lost_power(robot), error, missing)))
    return robot["robot_id"], robot["name"], _state(robot), units, note


def _state(body: dict[str, Any]) -> str:
    if not body["online"]:
        return "offline"
    return {True: "moving", False: "standing", None: "not known"}[body["moving"]]


def _lost_power(body: dict[str, Any]) -> str:
    return "has lost its power" if body["power_cycled"] else ""


def watch(
    bodies: Annotated[
        str | None, typer.Option(help="Only these: addresses or names joined by commas, 3F,lift,r1.")
    ] = None,
    types: Annotated[str | None, typer.Option(help=words.of("listEvents", "types"))] = None,
    sample: Annotated[
        float | None, typer.Option(min=0.1, max=50, help="Live values too, so many times a second at most.")
    ] = None,
    after: Annotated[str | None, typer.Option(help="Begin after this cursor; left out, now.")] = None,
    count: Annotated[int | None, typer.Option(min=1, help="End after so many events.")] = None,
    url: Url = LOCAL,
    key_file: KeyFile = None,
    as_json: Json = False,
) -> None:
    """Print events as they happen, one a line, until interrupted; after a lost connection none is missing."""
    client = Client.at(url, key_file)
    try:
        query = {"types": types, "bodies": bodies and _addresses(client, bodies)}
        query["sample"] = None if sample is None else f"{sample:g}"
        wanted = {name: value for name, value in query.items() if value}
        events = follow(client, "/events/stream", wanted, after)
        for event in islice(events, count):
            typer.echo(json.dumps(event, ensure_ascii=False) if as_json else _line(event))
    except KeyboardInterrupt:
        raise typer.Exit(exits.DONE) from None


def _addresses(client: Client, words: str) -> str:
    return ",".join(find(client, word.strip()).filter for word in words.split(","))


def follow(
    client: Client, path: str, query: dict[str, str], cursor: str | None = None
) -> Iterator[dict[str, Any]]:
    """All that a stream tells after a cursor, over as many connections as it takes; the first has to be made.

    :raises Failure: the gateway is not there, or refuses.
    """
    reached = lost = False
    while True:
        try:
            for event_cursor, event in _stream(client, path, query, cursor):
                if event is not None:
                    yield event
                cursor, reached, lost = event_cursor, True, False
        except (http.NotReached, http.AnswerLost, Failure) as error:
            if isinstance(error, Failure) and (not reached or error.code != exits.NOT_SENT):
                raise
            if not reached:
                raise Failure(why_not_reached(client.url, error), exits.NOT_SENT) from None
            if not lost:
                typer.echo(f"The connection to {client.url} is lost; it is tried again.", err=True)
            lost = True
        time.sleep(TRY_AGAIN_S)


def _stream(
    client: Client, path: str, query: dict[str, str], cursor: str | None
) -> Iterator[tuple[str, dict[str, Any] | None]]:
    """The events of one connection, each with its cursor; first the cursor alone from which on they come.

    :raises Failure: the gateway refuses.
    """
    headers = {**client.headers(), **({"Last-Event-ID": cursor} if cursor else {})}
    with http.stream(
        "GET",
        client.url + path,
        params=query,
        headers=headers,
        timeout=ANSWER_S,
        silence=SILENT_S,
        trust_env=client.trust_environment,
    ) as answer:
        if not answer.is_success:
            answer.read()
            raise refusal(answer.status_code, _problem(answer), headers["X-Request-Id"])
        yield from _server_sent(_lines(answer.iter_text()))


def _problem(answer: http.HttpAnswer) -> dict[str, Any]:
    try:
        return dict(answer.json())
    except (TypeError, ValueError):
        return {}


def _lines(pieces: Iterable[str]) -> Iterator[str]:
    """Cut at line feeds and nothing else: a text may hold what Unicode calls an end of line."""
    begun = ""
    for piece in pieces:
        *lines, begun = (begun + piece).split("\n")
        yield from lines


def _server_sent(lines: Iterable[str]) -> Iterator[tuple[str, dict[str, Any] | None]]:
    """Read server-sent events, and where those go on that come after a comment, or after an end."""
    cursor = ""
    for line in lines:
        name, _, value = line.partition(": ")
        if name == "" and value.startswith("events after "):
            cursor = value.removeprefix("events after ")
        elif name == "id":
            cursor = value
        elif line == "" and cursor:
            yield cursor, None
        elif name == "data":
            yield cursor, json.loads(value)


def _line(event: dict[str, Any]) -> str:
    data = event.get("data") or {}
    facts = [f"{name}={data[name]}" for name in SHOWN if data.get(name) is not None]
    return "  ".join((event["time"], event["type"], event["subject"], *facts))
