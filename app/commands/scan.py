"""Finding controllers by a running gateway, and letting it serve them: `scan`."""

from collections.abc import Iterable
from typing import Annotated, Any

import typer

from app import exits
from app.client import LOCAL, STEP_S, Client, KeyFile, Url
from app.exits import Failure
from app.output import ProgressLine

SCAN_S = 120.0
"""A scan of 120 body numbers is over sooner, however slow the line; so is one of a port."""
FOUND_BY_SCAN = "Found by a scan."


def scan(
    where: Annotated[
        str,
        typer.Argument(
            metavar="LINE|PORT",
            help="A line, as the configuration names it; or a port that no line has: /dev/ttyUSB1, "
            "tcp://HOST:PORT, dpram:///dev/uio0.",
        ),
    ],
    add: Annotated[
        bool, typer.Option("--add", help="Serve what is new, and write it into the configuration.")
    ] = False,
    url: Url = LOCAL,
    key_file: KeyFile = None,
) -> None:
    """Ask who answers: all 120 body numbers of a line, or an RC-400 or a robot at a port.

    Nothing is sent that moves or changes a motor. Ctrl-C breaks the scan of a port off.
    """
    client = Client.at(url, key_file)
    if "/" in where:
        _scan_port(client, where, add=add)
    else:
        _scan_line(client, where, add=add)


def _scan_line(client: Client, line: str, *, add: bool) -> None:
    scan = _follow(client, f"/lines/{line}/scans", None)
    if scan["status"] == "failed":
        raise Failure(f"The scan of {line} has failed: {scan['error']}", exits.REFUSED)
    found = scan["found"]
    for body in found:
        typer.echo(f"{body['body_id']}{'' if body['configured'] else '  (not in the configuration)'}")
    bodies = [{"id": body["body_id"].rpartition(".")[2]} for body in found if not body["configured"]]
    if add and bodies:
        client.request("POST", f"/lines/{line}/bodies", {"bodies": bodies, "comment": FOUND_BY_SCAN})
        _say_added(f"{line}.{body['id']}" for body in bodies)


def _scan_port(client: Client, port: str, *, add: bool) -> None:
    try:
        scan = _follow(client, "/system/scans", {"ports": [port]})
    except KeyboardInterrupt:
        scan = client.request("DELETE", "/system/scans/current")
    for note in scan["notes"]:
        typer.echo(note, err=True)
    for device in scan["found"]:
        typer.echo(device["told"])
    if scan["status"] == "failed":
        raise Failure(f"The scan of {port} has failed: {scan['error']}", exits.REFUSED)
    if not scan["found"]:
        raise Failure(f"Nobody was found at {port}: check power and cable.", exits.REFUSED)
    for device in scan["found"] if add else ():
        client.request("POST", "/lines", {"line": device["line"], "comment": device["comment"]})
        _say_added([device["line"]["id"]])
        typer.echo(device["comment"], err=True)


def _follow(client: Client, path: str, content: object) -> dict[str, Any]:
    """Begin a scan, and give it when it is over; a failure ends the command."""
    scan = client.request("POST", path, content, wait_s=STEP_S)
    with ProgressLine() as progress:
        for _ in range(int(SCAN_S / STEP_S) - 1):
            if scan["status"] != "running":
                break
            progress.say(_how_far(scan))
            scan = client.request("GET", f"{path}/{scan['id']}", wait_s=STEP_S)
    if scan["status"] == "running":
        raise Failure(f"The scan {scan['id']} is still running.", exits.UNDER_WAY)
    return scan


def _how_far(scan: dict[str, Any]) -> str:
    if "doing" in scan:
        return "; ".join(scan["doing"])
    return f"asked {scan['asked']} of 120; {len(scan['found'])} found"


def _say_added(addresses: Iterable[str]) -> None:
    typer.echo(f"Served now, and written into the configuration: {', '.join(addresses)}.", err=True)
