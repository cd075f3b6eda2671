"""The command line: start the gateway or a simulator, and talk to a running gateway from scripts."""

import asyncio
import gc
import json
import logging
import signal
import sys
from collections.abc import Iterator
from contextlib import AsyncExitStack, contextmanager
from importlib.metadata import version as distribution_version
from pathlib import Path
from typing import Annotated, Any, NoReturn

import httpx
import typer
import uvicorn
import uvloop

from gateway.config import Config, ConfigError, load
from gateway.events import EventHub
from gateway.plant import Plant
from protocols.rorze.commands import COMMANDS
from protocols.table import WireFault

EXIT_REFUSED = 1
"""The controller refused, or the move failed: the gateway's answer says why."""
EXIT_USAGE = 2
EXIT_NOT_SENT = 3
"""The gateway could not be reached, or sent nothing."""
EXIT_UNKNOWN = 4
"""It was sent, and nobody knows what became of it."""
EXIT_CONFIG = 78

DEMO_BODIES = (0x00, 0x01, 0x3F)
DEMO_PORT_PATH = Path("/tmp/motion-gateway-demo")  # noqa: S108  # a symlink that is replaced, never followed blindly
SHUTDOWN_S = 3
"""How long open requests and streams may take to end."""

app = typer.Typer(
    help="A network gateway for RORZE RC-420 motion controllers. It is not a safety function.",
    no_args_is_help=True,
    add_completion=False,
)
simulate = typer.Typer(help="Run fake controllers to develop and test against.", no_args_is_help=True)
app.add_typer(simulate, name="simulate")

Url = Annotated[str, typer.Option(help="Where the gateway listens.", envvar="MOTION_GATEWAY_URL")]


@app.command()
def version() -> None:
    """Print the version."""
    typer.echo(distribution_version("motion-gateway"))


@app.command()
def serve(
    config: Annotated[Path | None, typer.Option(help="The configuration file (TOML).")] = None,
    demo: Annotated[bool, typer.Option(help="Serve a built-in simulated line instead.")] = False,
    port: Annotated[int | None, typer.Option(min=0, max=65535, help="Listen on this port instead.")] = None,
) -> None:
    """Start the gateway and keep it running until it is told to end (SIGINT or SIGTERM)."""
    if (config is None) == (not demo):
        _fail("Say either --config FILE or --demo.", EXIT_USAGE)
    try:
        settings = load(config) if config else _demo_config()
    except ConfigError as error:
        _fail(str(error), EXIT_CONFIG)
    if port is not None:
        server = settings.server.model_copy(update={"port": port})
        settings = settings.model_copy(update={"server": server})
    logging.basicConfig(level=logging.INFO, format="%(asctime)s %(levelname)s %(name)s: %(message)s")
    with asyncio.Runner(loop_factory=uvloop.new_event_loop) as runner:
        clean = runner.run(_serve(settings, demo=demo))
    raise typer.Exit(0 if clean else EXIT_NOT_SENT)


def _demo_config() -> Config:
    bodies = [{"id": f"{body:02X}"} for body in DEMO_BODIES]
    line = {"id": "line1", "address": f"serial://{DEMO_PORT_PATH}?baud=9600", "bodies": bodies}
    return Config.model_validate({"lines": [line]})


async def _serve(config: Config, *, demo: bool) -> bool:
    """Run plant and server in one loop: this process owns the ports."""
    from api.app import create_app

    async with AsyncExitStack() as stack:
        if demo:
            from simulator.cli import start_demo_line

            stack.push_async_callback(start_demo_line(DEMO_BODIES, DEMO_PORT_PATH).aclose)
        plant = Plant(config)
        await plant.start()
        stack.push_async_callback(plant.close)
        server = _Server(_uvicorn_config(config, create_app(plant)), plant.events)
        for number in (signal.SIGINT, signal.SIGTERM):
            asyncio.get_running_loop().add_signal_handler(number, server.end, number)
        # What has been made by now stays: looking it through again would hold up every line for 50 ms.
        gc.collect()
        gc.freeze()
        await server.serve()
        return server.started


class _Server(uvicorn.Server):
    """A server whose signals are ours, and that ends the event streams before it waits for its clients."""

    def __init__(self, config: uvicorn.Config, events: EventHub) -> None:
        super().__init__(config)
        self._events = events

    def end(self, number: int) -> None:
        """Shut down because of a signal; a second one does not wait for anybody."""
        self._events.close()
        self.handle_exit(number, None)

    @contextmanager
    def capture_signals(self) -> Iterator[None]:
        """Leave the signals to us: after the server the plant has to be closed too."""
        yield


def _uvicorn_config(config: Config, asgi: Any) -> uvicorn.Config:
    return uvicorn.Config(
        asgi,
        host=config.server.host,
        port=config.server.port,
        http="httptools",
        ws="websockets-sansio",
        ws_per_message_deflate=False,
        ws_max_size=65536,
        workers=1,
        access_log=False,
        log_config=None,
        server_header=False,
        proxy_headers=False,
        lifespan="off",
        timeout_graceful_shutdown=SHUTDOWN_S,
    )


@app.command()
def send(
    body: Annotated[str, typer.Argument(help="Address of a body: 3F, or LINE.3F.")],
    command: Annotated[
        str, typer.Argument(help="Code and parameters as in the manual: 6PD, 1+MA[12],50000.")
    ],
    url: Url = "http://127.0.0.1:8420",
    wait: Annotated[float, typer.Option(min=0, max=60, help="Seconds to wait for the end of a move.")] = 0,
) -> None:
    """Send one command to a body through a running gateway, and print the answer as JSON."""
    text = command.replace(" ", "").upper() if "," not in command else command
    row = COMMANDS.get(text[:3])
    if row is None:
        _fail(f"There is no command {text[:3]!r}; `GET /commands` lists them all.", EXIT_USAGE)
    try:
        parameters = row.read(text[3:])
    except WireFault as error:
        _fail(f"{row.code}: {error}", EXIT_USAGE)
    path = f"/bodies/{body}/commands/{row.name()}"
    answer = _ask("POST", url + path, wait, parameters.model_dump(mode="json", exclude_none=True))
    typer.echo(json.dumps(answer, ensure_ascii=False, indent=2))
    if answer.get("status") in ("failed", "rejected", "stopped", "lost"):
        raise typer.Exit(EXIT_REFUSED)
    if answer.get("status") == "unknown":
        raise typer.Exit(EXIT_UNKNOWN)


@app.command()
def scan(
    line: Annotated[str, typer.Argument(help="The line to scan, as the configuration names it.")],
    url: Url = "http://127.0.0.1:8420",
) -> None:
    """Ask all 120 body numbers of a line who is there, and print the addresses that answer."""
    found = _ask("POST", f"{url}/lines/{line}/scans", 60, None)
    if found["status"] != "finished":
        _fail(
            f"The scan of {line} has not finished: {found.get('error') or 'it is still running'}",
            EXIT_NOT_SENT,
        )
    for body in found["found"]:
        typer.echo(f"{body['body_id']}{'' if body['configured'] else '  (not in the configuration)'}")


def _ask(method: str, url: str, wait_s: float, content: object) -> dict[str, Any]:
    """Ask the gateway, and turn a problem into its sentence and an exit code."""
    try:
        headers = {"Prefer": f"wait={wait_s:g}"} if wait_s else {}
        answer = httpx.request(method, url, json=content, headers=headers, timeout=wait_s + 10)
        data = answer.json()
    except (httpx.HTTPError, ValueError) as error:
        _fail(f"No gateway answers at {url}: {error}. Nothing was sent.", EXIT_NOT_SENT)
    if not answer.is_success:
        sentence = f"{data.get('detail', answer.text)} {data.get('remedy', '')}".strip()
        _fail(sentence, _exit_code(answer.status_code, data))
    return dict(data)


def _exit_code(status: int, problem: dict[str, Any]) -> int:
    if problem.get("moved") == "unknown":
        return EXIT_UNKNOWN
    if status == httpx.codes.SERVICE_UNAVAILABLE:
        return EXIT_NOT_SENT
    return EXIT_REFUSED if status == httpx.codes.CONFLICT or problem.get("code") else EXIT_USAGE


def _fail(sentence: str, code: int) -> NoReturn:
    typer.echo(sentence, err=True)
    raise typer.Exit(code)


def main() -> None:
    """Run the command line; `simulate` loads the simulator only when it is asked for."""
    if sys.argv[1:2] == ["simulate"]:
        from simulator.cli import app as simulator_app

        simulator_app(sys.argv[2:], prog_name="motion-gateway simulate")
    else:
        app()
