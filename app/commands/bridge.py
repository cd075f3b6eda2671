"""Bridges to MQTT and OPC UA: processes of their own, which use the gateway as any client does."""

import sys
import tomllib
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer

from app import exits, words
from app.data_directory import data_directory
from app.exits import Failure

if TYPE_CHECKING:
    from bridges.common.process import Kind
    from bridges.common.settings import BridgeFile

app = typer.Typer(help="Bridge a running gateway to MQTT or OPC UA.", no_args_is_help=True)

KINDS: Final = {"mqtt": "bridges.mqtt.bridge", "opcua": "bridges.opcua.bridge"}
"""Protocols, and the modules that have their `KIND`."""

Config = Annotated[Path, typer.Option(help="The bridge's file (TOML): docs/mqtt.md, docs/opcua.md.")]
BridgeData = Annotated[
    Path | None,
    typer.Option(
        help="Where the bridge keeps how far it has come; left out, motion-gateway-bridge beside the "
        "gateway's usual data directory."
    ),
]


@app.command(cls=words.WordedCommand)
def mqtt(config: Config, data: BridgeData = None) -> None:
    """Publish states, events and alarms to an MQTT broker, and take commands if the file says so.

    It runs until it is told to end (SIGINT or SIGTERM).
    """
    _run("mqtt", config, data)


@app.command(cls=words.WordedCommand)
def opcua(config: Config, data: BridgeData = None) -> None:
    """Serve the plant to OPC UA clients: axes, methods, events and alarms; each signs in with its own key.

    It runs until it is told to end (SIGINT or SIGTERM).
    """
    _run("opcua", config, data)


@app.command(cls=words.WordedCommand)
def check(config: Config) -> None:
    """Read a bridge's file, tell every fault with its line, and try the gateway and the other side.

    Nothing is published, and nothing moves.
    """
    import asyncio

    from bridges.common.checks import check as of_gateway
    from bridges.common.settings import BridgeFile

    names = _tables_of(config)
    if not names:
        _load(config, BridgeFile)
        raise Failure(f"{config}:1: has no table for a protocol: {' or '.join(KINDS)}.", exits.CONFIG)
    files = [(kind, _load(config, kind.file)) for kind in map(_kind, names)]
    troubles = asyncio.run(of_gateway(files[0][1], typer.echo))
    for kind, file in files:
        troubles += asyncio.run(kind.check(file, typer.echo))
    if troubles:
        raise Failure("\n".join(troubles), exits.REFUSED)
    typer.echo(f"{config} is in order.")


def _tables_of(config: Path) -> list[str]:
    """Give the protocols that a file has a table for, whatever is wrong in it."""
    try:
        tables = tomllib.loads(config.read_text("utf-8-sig"))
    except (OSError, ValueError, RecursionError):
        return []
    return [name for name in KINDS if name in tables]


def _kind(name: str) -> "Kind[Any]":
    """Give a protocol.

    :raises Failure: what it needs is not installed.
    """
    try:
        kind: Kind[Any] = import_module(KINDS[name]).KIND
    except ModuleNotFoundError as error:
        raise Failure(
            f"The bridge to {name} needs {error.name}, which is not installed; nothing was started. "
            f"Install it: pip install 'motion-gateway[{name}]'.",
            exits.NOT_SENT,
        ) from None
    return kind


def _load(config: Path, model: "type[BridgeFile]") -> Any:
    from gateway.core.toml_files import ConfigError, load

    try:
        return load(config, model)
    except ConfigError as error:
        raise Failure(str(error), exits.CONFIG) from None


def _run(name: str, config: Path, data: Path | None) -> None:
    import asyncio
    import logging

    import uvloop

    from app.logs import logging_to
    from app.process import Watchdog, notify, watchdog_wanted

    kind = _kind(name)
    from bridges.common.listener import CannotListen
    from bridges.common.position import InUse
    from bridges.common.process import Life, run

    file = _load(config, kind.file)
    watchdog = Watchdog(kind.sides) if watchdog_wanted() else None
    life = Life(notify, watchdog.worked) if watchdog else Life(notify)
    place = data or data_directory().with_name("motion-gateway-bridge")
    with logging_to(sys.stderr, file.bridge.log_level, file.bridge.log_format):
        logging.getLogger("httpx").setLevel(logging.WARNING)  # a line for each request
        try:
            with asyncio.Runner(loop_factory=uvloop.new_event_loop) as runner:
                runner.run(run(file, place, name, kind, life))
        except (InUse, CannotListen) as error:
            raise Failure(f"{error} Nothing was published.", exits.NOT_SENT) from None
        except OSError as error:
            raise Failure(
                f"The bridge has ended: {place}: {error.strerror or error}.", exits.NOT_SENT
            ) from None
