"""Leases from the command line: `lease take`, `lease list` and `lease release`."""

import time
from dataclasses import replace
from typing import Annotated, Any, Final

import typer

from app import exits, words
from app.client import LEASE_VARIABLE, LOCAL, Client, Json, KeyFile, Url
from app.exits import Failure
from app.output import json_text, table
from app.targets import addresses, find

lease = typer.Typer(
    help="Lease what nobody else may move meanwhile. Stops need no lease.", no_args_is_help=True
)

LONGEST_S: Final = 30.0
"""Longest time in seconds that a lease lasts without renewal, as in `gateway.core.leases`."""
RENEWALS: Final = 3
"""The renewals in the time in which one has to come."""


@lease.command(cls=words.WordedCommand)
def take(
    scope: Annotated[
        str,
        typer.Argument(
            help="A line, an address or a name: line1, 3F, 80, r1, lift.", autocompletion=addresses
        ),
    ],
    ttl: Annotated[
        float, typer.Option(min=0.5, max=LONGEST_S, help=words.of("takeLease", "ttl_s"))
    ] = LONGEST_S,
    hold: Annotated[
        bool, typer.Option("--hold", help="Renew it until Ctrl-C, and give it back then.")
    ] = False,
    take_over: Annotated[bool, typer.Option("--take-over", help=words.of("takeLease", "take_over"))] = False,
    url: Url = LOCAL,
    key_file: KeyFile = None,
    as_json: Json = False,
) -> None:
    """Take a lease, and print its token alone; other commands send the one in MOTION_GATEWAY_LEASE."""
    client = Client.at(url, key_file)
    wanted = {"scope": _address(client, scope), "ttl_s": ttl, "take_over": take_over}
    taken = client.request("POST", "/leases", wanted)
    typer.echo(json_text(taken) if as_json else str(taken["token"]))
    typer.echo(
        f"{taken['scope']} is leased as {taken['lease']} for {ttl:g} s{', and renewed' if hold else ''}: "
        f"`export {LEASE_VARIABLE}={taken['token']}` where it is to be moved.",
        err=True,
    )
    if hold:
        _hold(replace(client, lease=str(taken["token"])), f"/leases/{taken['lease']}", ttl)


def _hold(client: Client, path: str, ttl_s: float) -> None:
    """Renew a lease until Ctrl-C, and give it back.

    :raises Failure: it was not renewed.
    """
    try:
        while True:
            time.sleep(ttl_s / RENEWALS)
            client.request("POST", f"{path}/renew")
    except KeyboardInterrupt:
        client.request("DELETE", path)


@lease.command("list")
def list_leases(url: Url = LOCAL, key_file: KeyFile = None, as_json: Json = False) -> None:
    """Show who has leased what, and for how long."""
    listed = Client.at(url, key_file).request("GET", "/leases")
    if as_json:
        typer.echo(json_text(listed))
        return
    rows = (
        (lease["lease"], lease["scope"], lease["holder"], f"{lease['expires_in_s']:.1f} s")
        for lease in listed["leases"]
    )
    typer.echo(table(("LEASE", "SCOPE", "HOLDER", "LASTS"), rows))


@lease.command()
def release(
    word: Annotated[
        str, typer.Argument(help="The id of a lease, or what is leased.", autocompletion=addresses)
    ],
    url: Url = LOCAL,
    key_file: KeyFile = None,
) -> None:
    """Give a lease back; an admin ends any client's lease. Moves under way go on to their end."""
    client = Client.at(url, key_file)
    for held in _leases_of(client, word):
        client.request("DELETE", f"/leases/{held['lease']}")
        typer.echo(f"{held['lease']} of {held['scope']} is given back.")


def _leases_of(client: Client, word: str) -> list[dict[str, Any]]:
    """The lease of an id, or those of an address or name.

    :raises Failure: there is none.
    """
    leases: list[dict[str, Any]] = client.request("GET", "/leases")["leases"]
    found = [lease for lease in leases if word in (lease["lease"], lease["scope"])]
    if not found and leases:
        address = _address(client, word)
        found = [lease for lease in leases if address in (lease["scope"], lease["scope"].rpartition(".")[2])]
    if not found:
        raise Failure(
            f"There is no lease {word!r}; `motion-gateway lease list` lists them. Nothing was given back.",
            exits.USAGE,
        )
    return found


def _address(client: Client, word: str) -> str:
    """The address of a line, or of what else a word means.

    :raises Failure: it means nothing.
    """
    lines = client.request("GET", "/lines")["lines"]
    return word if any(line["line_id"] == word for line in lines) else find(client, word).address
