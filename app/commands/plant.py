"""Starting the process in front of several gateways: `plant`."""

import asyncio
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from app import exits
from app.exits import Failure

DEMO_PORT = 8430

if TYPE_CHECKING:
    from fleet.settings import PlantConfig


def plant(
    config: Annotated[Path | None, typer.Option(help="The configuration file of the plant (TOML).")] = None,
    demo: Annotated[
        bool, typer.Option("--demo", help="Serve two simulated gateways and a NATS server of their own.")
    ] = False,
    port: Annotated[int | None, typer.Option(min=0, max=65535, help="Listen on this port instead.")] = None,
) -> None:
    """Serve several gateways as one plant, until it is told to end (SIGINT or SIGTERM).

    It owns nothing: commands go to the gateway that owns the line, with the caller's own key.
    """
    if (config is None) == (not demo):
        raise Failure("Say either --config FILE or --demo.", exits.USAGE)
    try:
        from fleet.settings import load_plant
    except ImportError as error:
        raise Failure(
            "The plant process needs nats-py and httpx: pip install 'motion-gateway[plant]'", exits.CONFIG
        ) from error
    import uvloop

    from app.server import CannotListen
    from gateway.core.toml_files import ConfigError

    try:
        if config is None:
            _serve_demo(port or DEMO_PORT)
            return
        settings = load_plant(config)
        with asyncio.Runner(loop_factory=uvloop.new_event_loop) as runner:
            runner.run(_serve(settings, port))
    except ConfigError as error:
        raise Failure(str(error), exits.CONFIG) from None
    except CannotListen as error:
        raise Failure(str(error), exits.NOT_SENT) from None


def _serve_demo(port: int) -> None:
    from app.demo_plant import run

    run(port)


async def _serve(config: "PlantConfig", port: int | None) -> None:
    from app.logs import logging_to
    from app.plant_server import serve

    with logging_to(sys.stderr, config.server.log_level, config.server.log_format):
        await serve(config, port)
