"""Sessions and the security log of a running gateway: `sessions`, `sessions end` and `security`."""

from collections.abc import Mapping
from typing import Annotated, Any, Final
from urllib.parse import quote

import typer

from app import exits
from app.client import LOCAL, Client, Json, KeyFile, Url
from app.exits import Failure
from app.output import json_text, table

MOST: Final = 1000
"""Entries of the security log that one question gives."""

sessions = typer.Typer(invoke_without_command=True)


@sessions.callback()
def show(context: typer.Context, url: Url = LOCAL, key_file: KeyFile = None, as_json: Json = False) -> None:
    """Show who has signed in with a browser, or end that."""
    if context.invoked_subcommand is None:
        list_sessions(url, key_file, as_json)


@sessions.command("list")
def list_sessions(url: Url = LOCAL, key_file: KeyFile = None, as_json: Json = False) -> None:
    """Show who has signed in with a browser, from where, and when the session was last used."""
    listed = Client.at(url, key_file).request("GET", "/access/sessions")
    if as_json:
        typer.echo(json_text(listed))
        return
    rows = (
        (
            session["name"],
            session["role"],
            session["address"] or "-",
            session["began_at"],
            session["used_at"],
            session["id"],
        )
        for session in listed["sessions"]
    )
    typer.echo(table(("NAME", "ROLE", "ADDRESS", "BEGAN", "USED", "ID"), rows))


@sessions.command()
def end(
    session_id: Annotated[str | None, typer.Argument(help="An id, as `sessions list` shows it.")] = None,
    key: Annotated[str | None, typer.Option(help="The name of a key: all sessions of it.")] = None,
    url: Url = LOCAL,
    key_file: KeyFile = None,
) -> None:
    """End a session, or all of a key, which itself stays good."""
    if bool(session_id) == bool(key):
        raise typer.BadParameter("give the id of a session, or --key")
    client = Client.at(url, key_file)
    if session_id:
        ended = [client.request("DELETE", f"/access/sessions/{quote(session_id, safe='')}")]
    else:
        ended = client.request("DELETE", f"/access/sessions?key={quote(key or '', safe='')}")["sessions"]
    if not ended:
        raise Failure(f"{key} has no session; none was ended.", exits.REFUSED)
    for session in ended:
        typer.echo(
            f"The session of {session['name']} from {session['address'] or 'an unknown address'} is ended."
        )


def security(
    limit: Annotated[int, typer.Option(min=1, max=MOST, help="So many entries, the newest.")] = 50,
    url: Url = LOCAL,
    key_file: KeyFile = None,
    as_json: Json = False,
) -> None:
    """Show the newest entries of the security log: who was let in, who was refused, who changed what."""
    listed = Client.at(url, key_file).request("GET", f"/security?limit={limit}")
    if as_json:
        typer.echo(json_text(listed))
        return
    head = ("TIME", "TYPE", "CALLER", "ADDRESS", "TARGET", "MORE")
    typer.echo(table(head, map(_row, reversed(listed["entries"]))))


def _row(entry: Mapping[str, Any]) -> tuple[str, ...]:
    more = [f"{entry['count']} times"] if entry["count"] > 1 else []
    more += [f"{name}={value}" for name, value in entry["data"].items() if value is not None]
    caller, address = entry["caller"] or "-", entry["address"] or "-"
    return entry["time"], entry["type"], caller, address, entry["target"], ", ".join(more)
