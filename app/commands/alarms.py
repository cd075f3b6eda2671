"""Alarms from the command line: `alarms`, and `alarms reset`."""

from collections.abc import Iterator
from typing import Annotated, Any, Final
from urllib.parse import quote

import typer

from app import exits
from app.client import LOCAL, Client, Json, KeyFile, Url
from app.exits import Failure
from app.output import json_text

ALL_STANDING: Final = "/alarms?standing=true&limit=2000"

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
    path = "/alarms" if everything else ALL_STANDING
    listed = Client.at(url, key_file).request("GET", path)
    if as_json:
        typer.echo(json_text(listed))
    else:
        typer.echo("\n\n".join(map(_told, _boxed(listed["alarms"]))) or "No alarm stands.")


@alarms.command()
def reset(
    ids: Annotated[list[str] | None, typer.Argument(help="Ids of alarms, as `alarms` shows them.")] = None,
    over: Annotated[bool, typer.Option("--over", help="All whose cause is over.")] = False,
    url: Url = LOCAL,
    key_file: KeyFile = None,
) -> None:
    """Reset alarms whose cause is over. Nothing moves, and nothing is sent."""
    if bool(ids) == over:
        raise typer.BadParameter("give ids of alarms, or --over")
    client, codes = Client.at(url, key_file), [exits.DONE]
    chosen = ids or _over(client)
    if not chosen:
        typer.echo("No alarm is over.")
    for alarm_id in chosen:
        try:
            alarm = client.request("POST", f"/alarms/{quote(alarm_id, safe='')}/reset")
        except Failure as failure:
            typer.echo(str(failure), err=True)
            codes.append(failure.code)
        else:
            typer.echo(f"{_who(alarm)}  {alarm['cause']} is reset ({alarm['id']}).")
    raise typer.Exit(exits.worst(*codes))


def _over(client: Client) -> list[str]:
    """The ids of the alarms that stand though their cause is over, oldest first."""
    listed = client.request("GET", ALL_STANDING)["alarms"]
    return [alarm["id"] for alarm in reversed(listed) if alarm["ended_at"]]


def _boxed(listed: list[dict[str, Any]]) -> Iterator[dict[str, Any]]:
    """Each alarm that stands alone, and behind it those that tell the same event."""
    ids = {alarm["id"] for alarm in listed}
    for head in (alarm for alarm in listed if alarm.get("part_of") not in ids):
        yield head
        yield from (part for part in listed if part.get("part_of") == head["id"])


def _told(alarm: dict[str, Any]) -> str:
    words, over = alarm["en"], alarm["ended_at"]
    state = f"reset {alarm['reset_at']}" if alarm["reset_at"] else f"over {over}" if over else "stands now"
    if alarm.get("part_of"):
        state += f"  (part of {alarm['part_of']})"
    facts = (_who(alarm), alarm["cause"], f"since {alarm['raised_at']}", state, f"({alarm['id']})")
    sentences = filter(None, (words["happened"], words["motor"], words["remedy"]))
    calls = (f"{call['method']} {call['path']} ({call['right']}): {call['en']}" for call in alarm["next"])
    return "\n".join(["  ".join(facts), *(f"    {said}" for said in (*sentences, *calls))])


def _who(alarm: dict[str, Any]) -> str:
    """The subject of an alarm, as people call it: `line1.3F` for `/bodies/line1.3F`."""
    return str(alarm["subject"]).rpartition("/")[2]
