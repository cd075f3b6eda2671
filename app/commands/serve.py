"""Starting the gateway from the command line: `serve`, with a configuration or with the built-in demo.

The modules that it needs are loaded when it runs: no other command waits for them, a stop least of all.
"""

import asyncio
import gc
import sys
from contextlib import AsyncExitStack
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Annotated

import typer
import uvloop

from app import exits
from app.data_directory import Data, data_of, take
from app.exits import Failure

if TYPE_CHECKING:
    from app.server import Special
    from gateway.config import Config
    from gateway.config_file import ConfigFile


def serve(
    config: Annotated[Path | None, typer.Option(help="The configuration file (TOML).")] = None,
    demo: Annotated[bool, typer.Option(help="Serve a built-in simulated line and robot.")] = False,
    port: Annotated[int | None, typer.Option(min=0, max=65535, help="Listen on this port instead.")] = None,
    data: Data = None,
) -> None:
    """Start the gateway and keep it running until it is told to end (SIGINT or SIGTERM).

    SIGHUP reads the configuration file again.
    """
    if (config is None) == (not demo):
        raise Failure("Say either --config FILE or --demo.", exits.USAGE)
    _start(config, port, data)


def _start(config: Path | None, port: int | None, data: Path | None, plant: str | None = None) -> None:
    gc.disable()  # until the gateway runs: nothing of what is loaded is garbage
    from app.server import CannotListen
    from gateway.config_file import ConfigFile
    from gateway.core.journal.disk import InUse
    from gateway.core.journal.schema import TooNew
    from gateway.core.toml_files import ConfigError

    try:
        given = data or (data_of(config) if config else None)
        serving = (
            _serve_file(ConfigFile(config, port), given)
            if config and given
            else _serve_demo(port, data, plant)
        )
        with asyncio.Runner(loop_factory=uvloop.new_event_loop) as runner:
            runner.run(serving)
    except ConfigError as error:
        raise Failure(str(error), exits.CONFIG) from None
    except CannotListen as error:
        raise Failure(str(error), exits.NOT_SENT) from None
    except InUse as error:
        raise Failure(
            f"The journal is in use: {error}. No line was opened. Another gateway has this directory: name "
            "another one with --data.",
            exits.NOT_SENT,
        ) from None
    except TooNew as error:
        raise Failure(
            f"The journal is of a later version: {error}. No line was opened, and nothing was changed. Start "
            "the later version, or bring back the copy of the data that was made before the upgrade.",
            exits.NOT_SENT,
        ) from None


async def _serve_file(file: "ConfigFile", data: Path) -> None:
    config = file.load()
    take(data, file.path)
    await _serve(config, data, file)


def demo(
    port: Annotated[int | None, typer.Option(min=0, max=65535, help="Listen on this port instead.")] = None,
    data: Data = None,
    plant: Annotated[str | None, typer.Option(hidden=True, help="NAME=SERVER of a demo plant.")] = None,
) -> None:
    """Try it without hardware: a simulated line and robot, as `serve --demo`."""
    _start(None, port, data, plant)


async def _serve(
    config: "Config", data: Path, file: "ConfigFile | None" = None, special: "Special | None" = None
) -> None:
    from app.logs import logging_to
    from app.server import Special
    from app.server import serve as run_server

    with logging_to(sys.stderr, config.server.log_level, config.server.log_format):
        await run_server(config, data, file, special or Special())


def _started_as() -> str:
    """Give the command as it was typed; one that was found on PATH by its name."""
    return sys.argv[0] if sys.argv[0].startswith(".") else "motion-gateway"


async def _serve_demo(port: int | None, data: Path | None, plant: str | None = None) -> None:
    """Serve a simulated line and a simulated robot that run in this very process."""
    from app.demo import BODIES, LINE, ROBOT, demo_config, welcome
    from app.demo_faults import DemoFaults, SimulatedPlant
    from app.server import Special
    from simulator.cli import demo_line, demo_robot
    from simulator.fics.dpram_port import serve_dpram
    from simulator.ports import serve_pty

    line, robot = demo_line(BODIES), demo_robot()

    with TemporaryDirectory(prefix="motion-gateway-") as folder:
        line_path, robot_path = Path(folder) / "line1", Path(folder) / "cell1"
        async with AsyncExitStack() as stack:
            line_port, robot_port = serve_pty(line, line_path), serve_dpram(robot, robot_path)
            stack.push_async_callback(line_port.aclose)
            stack.push_async_callback(robot_port.aclose)
            faults = DemoFaults(SimulatedPlant(line, line_port, robot, robot_port), LINE, ROBOT)
            special = Special(
                tuple(faults.rows()),
                faults.open_disk,
                lambda url: typer.echo(welcome(url, _started_as()), err=True),
            )
            config = demo_config(line_path, robot_path, port, plant)
            await _serve(config, data or Path(folder) / "data", special=special)
