"""Running simulated controllers: from the command line, or inside another program as its demo."""

import asyncio
import re
import signal
import socket
from collections.abc import AsyncIterator, Iterable, Iterator
from contextlib import AsyncExitStack, asynccontextmanager, contextmanager
from dataclasses import dataclass
from pathlib import Path
from time import monotonic
from typing import Annotated
from urllib.parse import urlsplit

import typer
import uvicorn
import uvloop

from protocols.rorze.row import LAST_BODY
from simulator.ports import Port, PtyPort, serve_pty, serve_tcp
from simulator.rorze.control import create_control
from simulator.rorze.line import Rc400Line, build_line
from simulator.rorze.truth import TruthLog

KEPT_FACTS = 100_000
"""Facts of the truth log that stay in memory; a file keeps them all."""

DEMO_SETTINGS = (
    *("OLSS[12],5000", "OHSS[12],50000", "OSSS[12],70000", "OASS[12],30", "OBSS[12],30"),
    *("OLSS[0],50", "OHSS[0],50000", "OSSS[0],95000", "OASS[0],50", "OBSS[0],20"),
    *("SPSA[12],A:S[12],D:S[0]", "FIS"),
)
"""What a demo's controllers are taught: the speeds of RC-420 manual 13.3.4 as pattern 12, kept in flash."""

SLOWEST, FASTEST = 300, 4_000_000

app = typer.Typer(help="Run simulated controllers.", no_args_is_help=True)


Place = Path | tuple[str, int]
"""The link to a pseudo-terminal, or the host and port of a TCP listener."""


@app.callback()
def simulate() -> None:
    """Run simulated controllers."""


@dataclass(frozen=True, slots=True)
class Rc400Options:
    """How to run an RC-400 line; `baud` None paces nothing."""

    bodies: tuple[int, ...]
    place: Place
    baud: int | None = None
    truth: Path | None = None
    control: tuple[str, int] | None = None
    seed: int = 0


@app.command()
def rc400(
    bodies: Annotated[str, typer.Option(help="Body numbers, hexadecimal 00-77: 00,01,3F.")],
    pty: Annotated[
        Path | None, typer.Option(help="Make a pseudo-terminal, and this symbolic link to it.")
    ] = None,
    listen: Annotated[str | None, typer.Option(help="Listen for one TCP client: tcp://HOST:PORT.")] = None,
    baud: Annotated[
        int | None,
        typer.Option(
            min=SLOWEST, max=FASTEST, help="Let bytes take their time, 8N1; left out, they take none."
        ),
    ] = None,
    truth: Annotated[
        Path | None, typer.Option(help="Append what really happens to this file, as JSON lines.")
    ] = None,
    control: Annotated[
        str | None, typer.Option(help="Offer the HTTP control interface at HOST:PORT.")
    ] = None,
    seed: Annotated[int, typer.Option(help="Seed of the faults' dice.")] = 0,
) -> None:
    """Simulate an RC-400 link master with RC-420 controllers until interrupted."""
    try:
        options = Rc400Options(
            bodies=read_bodies(bodies),
            place=read_place(pty, listen),
            baud=baud,
            truth=truth,
            control=None if control is None else read_endpoint(control),
            seed=seed,
        )
    except ValueError as error:
        raise typer.BadParameter(str(error)) from None
    try:
        with asyncio.Runner(loop_factory=uvloop.new_event_loop) as runner:
            runner.run(run_rc400(options))
    except OSError as error:
        typer.echo(f"The simulated line did not start: {error}.", err=True)
        raise typer.Exit(1) from None


def read_bodies(text: str) -> tuple[int, ...]:
    """Read body numbers joined by commas.

    :raises ValueError: one is no body number, or comes twice.
    """
    names = [name.strip() for name in text.split(",")]
    for name in names:
        if not re.fullmatch("[0-9A-Fa-f]{2}", name) or int(name, 16) > LAST_BODY:
            raise ValueError(f"{name!r} is no body number; they are two hexadecimal digits from 00 to 77")
    bodies = tuple(int(name, 16) for name in names)
    if len(set(bodies)) < len(bodies):
        raise ValueError(f"a body is listed twice in {text!r}")
    return bodies


def read_place(pty: Path | None, listen: str | None) -> Place:
    """Take one of the two places where a machine can be.

    :raises ValueError: none is given, or both, or no TCP address.
    """
    if pty is not None and listen is None:
        return pty
    if listen is not None and pty is None and listen.startswith("tcp://"):
        return read_endpoint(listen.removeprefix("tcp://"))
    raise ValueError("give either --pty PATH or --listen tcp://HOST:PORT")


def read_endpoint(text: str) -> tuple[str, int]:
    """Read `HOST:PORT`; an IPv6 host stands in brackets.

    :raises ValueError: it is something else.
    """
    try:
        url = urlsplit(f"//{text}")
        host, port = url.hostname, url.port
    except ValueError:
        host, port = None, None
    if host is None or port is None or url.netloc != text or "@" in text:
        raise ValueError(f"{text!r} is not HOST:PORT")
    return host, port


async def run_rc400(options: Rc400Options) -> None:
    """Run a line until SIGINT or SIGTERM.

    :raises OSError: a port or a file could not be opened.
    """
    stopped = asyncio.Event()
    loop = asyncio.get_running_loop()
    for number in (signal.SIGINT, signal.SIGTERM):
        loop.add_signal_handler(number, stopped.set)
    async with AsyncExitStack() as stack:
        # Opened once, before anything runs.
        sink = None if options.truth is None else stack.enter_context(options.truth.open("a", buffering=1))
        line = build_line(options.bodies, monotonic(), TruthLog(KEPT_FACTS, sink), seed=options.seed)
        port = await _serve(line, options)
        stack.push_async_callback(port.aclose)
        if options.control is not None:
            await stack.enter_async_context(_control(line, port, *options.control))
        typer.echo(
            f"RC-400 with bodies {', '.join(f'{body:02X}' for body in options.bodies)} at {port.address}"
        )
        await stopped.wait()


async def _serve(line: Rc400Line, options: Rc400Options) -> Port:
    if isinstance(options.place, Path):
        return serve_pty(line, options.place, options.baud)
    host, port = options.place
    return await serve_tcp(line, host, port, options.baud)


class _Server(uvicorn.Server):
    @contextmanager
    def capture_signals(self) -> Iterator[None]:
        """Leave the signals to the program."""
        yield


@asynccontextmanager
async def _control(line: Rc400Line, port: Port, host: str, number: int) -> AsyncIterator[None]:
    """Serve the control interface in this event loop, where the line runs too."""
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    listener = socket.create_server((host, number), family=family)
    config = uvicorn.Config(
        create_control(line, port), lifespan="off", log_config=None, timeout_graceful_shutdown=1
    )
    server = _Server(config)
    serving = asyncio.create_task(server.serve([listener]))
    typer.echo(f"control interface at http://{host}:{listener.getsockname()[1]}")
    try:
        yield
    finally:
        server.should_exit = True
        await serving


def start_demo_line(bodies: Iterable[int], path: Path) -> PtyPort:
    """Run an RC-400 line in this event loop, unpaced, behind a pseudo-terminal that `path` will link to.

    :raises OSError: the pseudo-terminal or the link cannot be made.
    """
    now = monotonic()
    line = build_line(bodies, now, TruthLog(KEPT_FACTS))
    for axis in line.axes.values():
        for setting in DEMO_SETTINGS:
            axis.execute(setting, now)
    return serve_pty(line, path)
