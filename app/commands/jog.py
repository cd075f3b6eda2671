"""A jog from the command line: `jog` moves what it names for as long as it runs."""

import signal
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Annotated, Any, Final, Literal

import typer

from app import exits
from app.client import LOCAL, Client, KeyFile, Url
from app.exits import Failure, Misuse
from app.output import ProgressLine, json_text
from app.targets import NamedTarget, addresses, find

HEARTBEATS: Final = 3
"""The heartbeats in the time in which one has to come."""
CHECK_S: Final = 0.1
STILL_WITHIN_S: Final = 4.0
"""Standstill that is not seen by then is not waited for."""
_WAYS: Final = ("+", "-", "cw", "ccw")
_ENDS: Final = {
    "stopping": "Standstill is not confirmed, and the stop is repeated. Use the hardware stop.",
    "lost": "The gateway has stopped it, since no heartbeat came in time. It stands still.",
    "stopped": "Somebody else, or the end of the gateway, has stopped it. It stands still.",
}
"""Sentences for the ends of a jog that its holder has not ended, by the jog's status."""


def jog(
    address: Annotated[
        str,
        typer.Argument(
            help="Address or name of a body or a robot's unit: 3F, LINE.3F, r1/units/1.",
            autocompletion=addresses,
        ),
    ],
    way: Annotated[str, typer.Argument(help="Which way: +, -, cw or ccw; for robots with the axis: X+, A-.")],
    speed: Annotated[
        Literal["low", "high"] | None,
        typer.Option(help="Of bodies; low, without ramps, where it is left out."),
    ] = None,
    pattern: Annotated[
        int | None, typer.Option(min=0, max=29, help="Acceleration pattern of bodies.")
    ] = None,
    at_most: Annotated[float | None, typer.Option(help="How far bodies go at most, in --unit.")] = None,
    unit: Annotated[str, typer.Option(help="pulse, or the unit of the body.")] = "pulse",
    url: Url = LOCAL,
    key_file: KeyFile = None,
) -> None:
    """Jog until Ctrl-C, and print the jog as JSON when the motor stands still.

    The motor stops, too, within half a second when this program or its connection dies.
    """
    client = Client.at(url, key_file)
    furthest = None if at_most is None else {"value": at_most, "unit": unit}
    options = {"speed": speed, "pattern": pattern, "at_most": furthest}
    target = find(client, address)
    path, content = _asked(
        target, way, {name: option for name, option in options.items() if option is not None}
    )
    with _at(signal.default_int_handler, signal.SIGTERM, signal.SIGHUP):
        _jog(client, f"{path}/jogs", content)


def _asked(target: NamedTarget, way: str, options: dict[str, Any]) -> tuple[str, dict[str, Any]]:
    """Where a jog is asked for, and how.

    :raises Failure: nothing of the kind jogs, or not this way.
    """
    if target.kind == "robots":
        unit = int(target.unit_path().rpartition("/")[2])
        axis, direction = way[:-1].upper(), way[-1:]
        if not axis or direction not in ("+", "-"):
            raise Misuse(f"{way!r} is no axis with a direction: say X+ or X-")
        if options:
            raise Misuse(f"Robots take no --{next(iter(options)).replace('_', '-')}: their settings say it")
        return f"/robots/{target.address}", {"unit": unit, "axis": axis, "direction": direction}
    if target.kind != "bodies":
        raise Misuse("Only bodies and units of robots jog; name one of them")
    if way not in _WAYS:
        raise Misuse(f"{way!r} is no direction: say {', '.join(_WAYS)}")
    return target.path, {"direction": way, **options}


def _jog(client: Client, path: str, content: dict[str, Any]) -> None:
    """Jog until it is over, and end."""
    try:
        jogging = client.request("POST", path, content)
    except KeyboardInterrupt:
        raise Failure(
            "It may have begun to jog. No heartbeat follows: the gateway stops it itself.", exits.UNKNOWN
        ) from None
    path = f"{path}/{jogging['id']}"
    trouble = _hold(client, path, jogging["heartbeat_within_ms"] / 1000 / HEARTBEATS)
    try:
        with _at(signal.SIG_IGN, signal.SIGINT, signal.SIGTERM, signal.SIGHUP):  # the stop is seen through
            over = _end(client, path)
    except Failure as failure:
        raise Failure(
            f"{trouble or failure} No heartbeat follows: the gateway stops it itself within half a second. "
            "If it goes on, use the hardware stop.",
            exits.UNKNOWN,
        ) from None
    typer.echo(json_text(over))
    if over["state"] == "ended":
        if trouble is not None:
            typer.echo(str(trouble), err=True)
        raise typer.Exit(exits.DONE)
    raise Failure(_ENDS[over["state"]], exits.UNKNOWN if over["state"] == "stopping" else exits.REFUSED)


def _hold(client: Client, path: str, every_s: float) -> Failure | None:
    """Send heartbeats until Ctrl-C, or until one is not taken: the jog is over then, or out of reach."""
    with ProgressLine() as progress:
        progress.note("It jogs; Ctrl-C stops it.")
        try:
            while True:
                time.sleep(every_s)
                client.request("POST", f"{path}/heartbeat")
        except KeyboardInterrupt:
            return None
        except Failure as failure:
            return failure


def _end(client: Client, path: str) -> dict[str, Any]:
    """Stop it, and see it stand still, or tell that this was not seen in time.

    :raises Failure: the gateway does not answer, or refuses.
    """
    late_at = time.monotonic() + STILL_WITHIN_S
    over = client.request("POST", f"{path}/stop")
    while over["state"] == "stopping" and time.monotonic() < late_at:
        time.sleep(CHECK_S)
        over = client.request("POST", f"{path}/stop")
    return over


@contextmanager
def _at(handler: Callable[..., Any] | signal.Handlers, *numbers: signal.Signals) -> Iterator[None]:
    """Do something else at these signals while the block runs."""
    before = {number: signal.signal(number, handler) for number in numbers}
    try:
        yield
    finally:
        for number, usual in before.items():
            signal.signal(number, usual)
