"""Starting the gateway from the command line: `serve`, with a configuration or with the built-in demo.

What it takes is loaded when it is asked for: no other command waits for that, a stop least of all.
"""

import asyncio
import logging
from contextlib import AsyncExitStack
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Annotated

import typer
import uvloop

from app import exits
from app.data_directory import Data, data_directory
from app.exits import fail

if TYPE_CHECKING:
    from gateway.config import Config
    from gateway.config_file import ConfigFile

DEMO_BODIES = (0x00, 0x01, 0x3F)


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
        fail("Say either --config FILE or --demo.", exits.USAGE)
    from app.server import CannotListen
    from gateway.config import ConfigError
    from gateway.config_file import ConfigFile
    from gateway.core.journal.disk import InUse
    from gateway.core.journal.schema import TooNew

    logging.basicConfig(level=logging.INFO, format="%(asctime)s %(levelname)s %(name)s: %(message)s")
    try:
        given = data or data_directory()
        serving = _serve_file(ConfigFile(config, port), given) if config else _serve_demo(port, data)
        with asyncio.Runner(loop_factory=uvloop.new_event_loop) as runner:
            runner.run(serving)
    except ConfigError as error:
        fail(str(error), exits.CONFIG)
    except CannotListen as error:
        fail(str(error), exits.NOT_SENT)
    except InUse as error:
        fail(f"The journal is in use: {error}. No line was opened.", exits.NOT_SENT)
    except TooNew as error:
        fail(f"The journal is of a later version: {error}. No line was opened.", exits.NOT_SENT)


async def _serve_file(file: "ConfigFile", data: Path) -> None:
    from app.server import serve as run_server

    await run_server(file.load(), data, file)


async def _serve_demo(port: int | None, data: Path | None) -> None:
    """Serve a simulated line and a simulated robot that run in this very process."""
    from app.server import serve as run_server
    from simulator.cli import start_demo_line, start_demo_robot

    with TemporaryDirectory(prefix="motion-gateway-") as folder:
        line_path, robot_path = Path(folder) / "line1", Path(folder) / "cell1"
        async with AsyncExitStack() as stack:
            stack.push_async_callback(start_demo_line(DEMO_BODIES, line_path).aclose)
            stack.push_async_callback(start_demo_robot(robot_path).aclose)
            await run_server(_demo_config(line_path, robot_path, port), data or Path(folder) / "data")


def _demo_config(line_path: Path, robot_path: Path, port: int | None) -> "Config":
    from gateway.config import Config

    bodies = [{"id": f"{body:02X}"} for body in DEMO_BODIES]
    line = {"id": "line1", "address": f"serial://{line_path}?baud=9600", "bodies": bodies}
    units = [
        {"number": 1, "axes": ["X", "Y", "Z"], "motor_axes": ["A", "B", "Z"]},
        {"number": 2, "axes": ["X", "Y", "Z"]},
    ]
    robot = {"id": "r1", "units": units}
    cell = {"id": "cell1", "protocol": "fics", "address": f"dpram://{robot_path}", "robot": robot}
    server = {} if port is None else {"port": port}
    return Config.model_validate({"server": server, "access": {"mode": "open"}, "lines": [line, cell]})
