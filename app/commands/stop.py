"""The software stop from the command line: `stop`."""

from typing import Annotated, Any, Literal

import typer

from app import exits, targets, words
from app.client import LOCAL, Client, Json, KeyFile, Url, exit_of_stop
from app.exits import Failure
from app.output import json_text
from app.targets import find, numbered
from gateway.core.parts import spelled

StopMode = Literal["decelerate", "immediate"]
"""Modes of a stop, as in `gateway.core.stops`, which takes long to load: no stop waits for that."""
Stopped = dict[str, Any] | Failure


def stop(
    addresses: Annotated[
        list[str] | None,
        typer.Argument(
            help="Addresses or names: 3F, LINE.3F, 80, r1, lift. None: everything stops.",
            autocompletion=targets.addresses,
        ),
    ] = None,
    mode: Annotated[StopMode, typer.Option(help=words.of("stopAll", "mode"))] = "decelerate",
    url: Url = LOCAL,
    key_file: KeyFile = None,
    as_json: Json = False,
) -> None:
    """Stop everything, or what is named, by software. It does not replace a hardware stop.

    Exit code 0 only when every controller has reported standstill; after 4 use the hardware stop.
    """
    client, content = Client.at(url, key_file), {"mode": mode}
    try:
        outcomes = _outcomes(client, addresses, content)
    except KeyboardInterrupt:
        raise Failure(
            "Interrupted before standstill was confirmed. The gateway goes on with a stop that has reached "
            "it. If anything moves, use the hardware stop.",
            exits.UNKNOWN,
        ) from None
    reports = [outcome for outcome in outcomes if not isinstance(outcome, Failure)]
    failures = [outcome for outcome in outcomes if isinstance(outcome, Failure)]
    if as_json:
        typer.echo(json_text(_united(reports, failures)))
    else:
        for report in reports:
            _print(report)
    for failure in failures:
        typer.echo(str(failure), err=True)
    raise typer.Exit(exits.worst(*map(exit_of_stop, reports), *(failure.code for failure in failures)))


def _outcomes(client: Client, addresses: list[str] | None, content: object) -> list[Stopped]:
    if not addresses:
        return [_post(client, "/stop", content)]
    from concurrent.futures import ThreadPoolExecutor  # no stop of everything waits for that

    with ThreadPoolExecutor(len(addresses)) as together:  # nobody's stop waits for another's
        return list(together.map(lambda word: _stop(client, word, content), addresses))


def _stop(client: Client, word: str, content: object) -> Stopped:
    """Stop the target of a word; an address needs no question, which a crowded gateway would not answer."""
    target = numbered(word)
    if target is not None:
        return _post(client, f"{target.path}/stop", content)
    if (address := spelled(word)) is not None:
        outcome = _post(client, f"/robots/{address}/stop", content)
        if not isinstance(outcome, Failure) or outcome.code != exits.USAGE:
            return outcome
    try:
        return _post(client, f"{find(client, word).path}/stop", content)
    except Failure as failure:
        return Failure(f"{failure} `motion-gateway stop` without a name stops everything.", failure.code)


def _post(client: Client, path: str, content: object) -> Stopped:
    try:
        return client.request("POST", path, content)
    except Failure as failure:
        return failure


def _united(reports: list[dict[str, Any]], failures: list[Failure]) -> dict[str, Any]:
    return {
        "confirmed": not failures and all(report["confirmed"] for report in reports),
        "bodies": [body for report in reports for body in report["bodies"]],
        "robots": [robot for report in reports for robot in report["robots"]],
    }


def _print(report: dict[str, Any]) -> None:
    for stop_report in (*report["bodies"], *report["robots"]):
        detail = f": {stop_report['detail']}" if stop_report.get("detail") else ""
        typer.echo(f"{stop_report.get('body_id') or stop_report['robot_id']}  {stop_report['state']}{detail}")
