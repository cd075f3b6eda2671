"""Alarms from the command line: `alarms`, and `alarms reset`."""

from typing import Annotated, Any
from urllib.parse import quote

import typer

from app import exits
from app.client import LOCAL, Client, Json, KeyFile, Url
from app.exits import Failure
from app.output import json_text

alarms = typer.Typer(help="Show alarms with what to do next, or reset them.", invoke_without_command=True)


@alarms.callback()
def show(
    context: typer.Context,
    everything: Annotated[bool, typer.Option("--all", help="Those that were reset, too.")] = False,
    url: Url = LOCAL,
    key_file: KeyFile = None,
    as_json: Json = False,
) -> None:
    """Show the alarms that stand: what has happened, what the motor did, what to do next."""
    if context.invoked_subcommand:
        return
    path = "/alarms" if everything else "/alarms?standing=true"
    listed = Client.at(url, key_file).request("GET", path)
    if as_json:
        typer.echo(json_text(listed))
    else:
        typer.echo("\n\n".join(map(_told, listed["alarms"])) or "No alarm stands.")


@alarms.command()
def reset(
    ids: Annotated[list[str], typer.Argument(help="Ids of alarms, as `alarms` shows them.")],
    url: Url = LOCAL,
    key_file: KeyFile = None,
) -> None:
    """Reset alarms whose cause is over. Nothing moves, and nothing is sent."""
    client, codes = Client.at(url, key_file), [exits.DONE]
    for alarm_id in ids:
        try:
            alarm = client.request("POST", f"/alarms/{quote(alarm_id, safe='')}/reset")
        except Failure as failure:
            typer.echo(str(failure), err=True)
            codes.append(failure.code)
        else:
            typer.echo(f"{alarm['id']}  {alarm['cause']}  of {alarm['subject']} is reset.")
    raise typer.Exit(exits.worst(*codes))


def _told(alarm: dict[str, Any]) -> str:
    state = "reset" if alarm["reset_at"] else "over" if alarm["ended_at"] else "lasts"
    words = alarm["en"]
    facts = (alarm["id"], alarm["raised_at"], alarm["cause"], alarm["subject"], state)
    sentences = filter(None, (words["happened"], words["motor"], words["remedy"]))
    calls = (f"{call['method']} {call['path']} ({call['right']}): {call['en']}" for call in alarm["next"])
    return "\n".join(["  ".join(facts), *(f"    {said}" for said in (*sentences, *calls))])
