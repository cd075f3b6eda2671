"""The command line: start the gateway or a simulator, and talk to a running gateway from scripts."""

import asyncio
import json
import logging
import sys
from contextlib import AsyncExitStack
from importlib.metadata import version as distribution_version
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated, Any, NoReturn
from uuid import uuid4

import httpx
import typer
import uvloop

from app.journal import default_directory, journal
from app.server import CannotListen
from app.server import serve as run_server
from gateway.config import Config, ConfigError, load
from gateway.core.errors import Ambiguous, GarbledReply, NoReply
from gateway.core.journal.disk import InUse
from gateway.core.journal.schema import TooNew
from gateway.core.move_record import MoveStatus
from protocols.rorze.commands import COMMANDS
from protocols.rorze.row import RorzeCommand
from protocols.table import SyntaxFault, WireFault

EXIT_DONE = 0
EXIT_REFUSED = 1
"""It was refused, or did not succeed: the gateway's answer says why."""
EXIT_USAGE = 2
EXIT_NOT_SENT = 3
"""The gateway could not be reached or could not start, or it sent nothing."""
EXIT_UNKNOWN = 4
"""It was sent, and nobody knows what became of it."""
EXIT_UNDER_WAY = 5
"""It is still going on, though its end was waited for."""
EXIT_CONFIG = 78

DEMO_BODIES = (0x00, 0x01, 0x3F)
app = typer.Typer(
    help="A network gateway for RORZE and DYNAX motion controllers. It is not a safety function.",
    epilog="Exit codes: 0 done; 1 refused, or not succeeded; 2 wrong arguments; 3 nothing was sent; 4 sent, "
    "and nobody knows what became of it, or a stop is not confirmed; 5 still under way when the time of "
    "--wait was over; 78 wrong configuration.",
    no_args_is_help=True,
    add_completion=False,
)
simulate = typer.Typer(help="Run fake controllers to develop and test against.", no_args_is_help=True)
app.add_typer(simulate, name="simulate")
app.add_typer(journal, name="journal")

Url = Annotated[str, typer.Option(help="Where the gateway listens.", envvar="MOTION_GATEWAY_URL")]


@app.command()
def version() -> None:
    """Print the version."""
    typer.echo(distribution_version("motion-gateway"))


@app.command()
def serve(
    config: Annotated[Path | None, typer.Option(help="The configuration file (TOML).")] = None,
    demo: Annotated[bool, typer.Option(help="Serve a built-in simulated line and robot.")] = False,
    port: Annotated[int | None, typer.Option(min=0, max=65535, help="Listen on this port instead.")] = None,
    data: Annotated[Path | None, typer.Option(help="Keep the journal in this directory.")] = None,
) -> None:
    """Start the gateway and keep it running until it is told to end (SIGINT or SIGTERM)."""
    if (config is None) == (not demo):
        _fail("Say either --config FILE or --demo.", EXIT_USAGE)
    logging.basicConfig(level=logging.INFO, format="%(asctime)s %(levelname)s %(name)s: %(message)s")
    try:
        serving = (
            run_server(_on_port(load(config), port), data or default_directory())
            if config
            else _serve_demo(port, data)
        )
        with asyncio.Runner(loop_factory=uvloop.new_event_loop) as runner:
            runner.run(serving)
    except ConfigError as error:
        _fail(str(error), EXIT_CONFIG)
    except CannotListen as error:
        _fail(str(error), EXIT_NOT_SENT)
    except InUse as error:
        _fail(f"The journal is in use: {error}. No line was opened.", EXIT_NOT_SENT)
    except TooNew as error:
        _fail(f"The journal is of a later version: {error}. No line was opened.", EXIT_NOT_SENT)


async def _serve_demo(port: int | None, data: Path | None) -> None:
    """Serve a simulated line and a simulated robot that run in this very process."""
    from simulator.cli import start_demo_line, start_demo_robot

    with TemporaryDirectory(prefix="motion-gateway-") as folder:
        line_path, robot_path = Path(folder) / "line1", Path(folder) / "cell1"
        async with AsyncExitStack() as stack:
            stack.push_async_callback(start_demo_line(DEMO_BODIES, line_path).aclose)
            stack.push_async_callback(start_demo_robot(robot_path).aclose)
            config = _on_port(_demo_config(line_path, robot_path), port)
            await run_server(config, data or Path(folder) / "data")


def _demo_config(line_path: Path, robot_path: Path) -> Config:
    bodies = [{"id": f"{body:02X}"} for body in DEMO_BODIES]
    line = {"id": "line1", "address": f"serial://{line_path}?baud=9600", "bodies": bodies}
    units = [
        {"number": 1, "axes": ["X", "Y", "Z"], "motor_axes": ["A", "B", "Z"]},
        {"number": 2, "axes": ["X", "Y", "Z"]},
    ]
    robot = {"id": "r1", "units": units}
    cell = {"id": "cell1", "protocol": "fics", "address": f"dpram://{robot_path}", "robot": robot}
    return Config.model_validate({"lines": [line, cell]})


def _on_port(config: Config, port: int | None) -> Config:
    if port is None:
        return config
    return config.model_copy(update={"server": config.server.model_copy(update={"port": port})})


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
    parameters = _read(command)
    path = f"/bodies/{body}/commands/{parameters.name()}"
    answer = _ask("POST", url + path, wait, parameters.model_dump(mode="json", exclude_none=True))
    typer.echo(json.dumps(answer, ensure_ascii=False, indent=2))
    if parameters.starts_motion():
        raise typer.Exit(_exit_of_move(answer, awaited=wait > 0))
    if "confirmed" in answer:
        raise typer.Exit(_exit_of_stop(answer))


def _read(text: str) -> RorzeCommand[Any]:
    """Read a command of the table; case and blanks matter only where a parameter is a text."""
    code, parameters = text.strip()[:3].upper(), text.strip()[3:]
    row = COMMANDS.get(code)
    if row is None:
        _fail(
            f"There is no command {code!r} of RC-420 bodies, which alone `send` is for; "
            "`GET /commands?family=rorze` lists theirs. Robots have routes of their own: see /docs.",
            EXIT_USAGE,
        )
    try:
        try:
            return row.read(parameters)
        except SyntaxFault:
            return row.read(parameters.replace(" ", "").upper())
    except WireFault as error:
        _fail(f"{code}: {error}", EXIT_USAGE)


def _exit_of_move(move: dict[str, Any], *, awaited: bool) -> int:
    status = MoveStatus(move["status"])
    if not status.final:
        return EXIT_UNDER_WAY if awaited else EXIT_DONE
    if status is MoveStatus.SUCCEEDED:
        return EXIT_DONE
    moved = (move["error"] or {}).get("moved")
    return EXIT_UNKNOWN if MoveStatus.UNKNOWN in (status, moved) else EXIT_REFUSED


def _exit_of_stop(stop: dict[str, Any]) -> int:
    if stop["confirmed"]:
        return EXIT_DONE
    unsent = all(body["state"] == "not_sent" for body in stop["bodies"])
    return EXIT_NOT_SENT if unsent else EXIT_UNKNOWN


@app.command()
def scan(
    line: Annotated[str, typer.Argument(help="The line to scan, as the configuration names it.")],
    url: Url = "http://127.0.0.1:8420",
) -> None:
    """Ask all 120 body numbers of a line who is there, and print the addresses that answer."""
    found = _ask("POST", f"{url}/lines/{line}/scans", 60, None)
    if found["status"] == "running":
        _fail(f"The scan of {line} is still running.", EXIT_UNDER_WAY)
    if found["status"] == "failed":
        _fail(f"The scan of {line} has failed: {found['error']}", EXIT_REFUSED)
    for body in found["found"]:
        typer.echo(f"{body['body_id']}{'' if body['configured'] else '  (not in the configuration)'}")


def _ask(method: str, url: str, wait_s: float, content: object) -> dict[str, Any]:
    """Ask the gateway, and turn a problem into its sentence, the request's id and an exit code."""
    request_id = uuid4().hex
    headers = {"X-Request-Id": request_id, **({"Prefer": f"wait={wait_s:g}"} if wait_s else {})}
    try:
        answer = httpx.request(method, url, json=content, headers=headers, timeout=wait_s + 10)
        data = dict(answer.json())
    except (httpx.ConnectError, httpx.ConnectTimeout, httpx.UnsupportedProtocol, httpx.InvalidURL) as error:
        _fail(f"No gateway answers at {url}: {error}. Nothing was sent.", EXIT_NOT_SENT)
    except (httpx.HTTPError, TypeError, ValueError) as error:
        _fail(
            f"The gateway at {url} was asked, and its answer was lost: {str(error).rstrip('.')}. The command "
            "may have been carried out: read status and position before anything else. The line's trace has "
            f"what was sent, as request {request_id}.",
            EXIT_UNKNOWN,
        )
    if not answer.is_success:
        sentence = f"{data.get('detail', answer.text)} {data.get('remedy', '')}".strip()
        _fail(f"{sentence} (request {request_id})", _exit_code(answer.status_code, data))
    return data


def _exit_code(status: int, problem: dict[str, Any]) -> int:
    kind = str(problem.get("type", "")).rpartition(":")[2]
    if problem.get("moved") == "unknown" or kind in (NoReply.kind, GarbledReply.kind):
        return EXIT_UNKNOWN
    if kind == Ambiguous.kind:
        return EXIT_USAGE
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
