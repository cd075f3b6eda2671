"""Running simulated controllers: from the command line, or inside another program as its demo."""

import asyncio
import gc
import re
import signal
import socket
from collections.abc import AsyncIterator, Callable, Iterator, Mapping, Sequence
from contextlib import AsyncExitStack, asynccontextmanager, contextmanager
from dataclasses import dataclass
from pathlib import Path
from time import monotonic
from typing import Annotated, TypeVar
from urllib.parse import urlsplit

import typer
import uvicorn
import uvloop
from fastapi import FastAPI

from protocols.fics.link import Terminator
from protocols.rorze.row import LAST_BODY
from simulator.demo import teach
from simulator.fics.control import create_control as create_fics_control
from simulator.fics.dpram_port import serve_dpram
from simulator.fics.layout import Layout
from simulator.fics.line import LineSettings, SimulatedFics
from simulator.fics.line import build_line as build_fics
from simulator.fics.macros import MACROS, read_macros
from simulator.fics.quirks import QUIRKS as FICS_QUIRKS
from simulator.likeness import read_likeness
from simulator.ports import Machine, Port, serve_pty, serve_tcp
from simulator.rorze.control import create_control
from simulator.rorze.line import Rc400Line, build_line
from simulator.rorze.quirks import QUIRKS as RC400_QUIRKS
from simulator.truth import TruthLog

KEPT_FACTS = 100_000
"""Facts of the truth log that stay in memory; a file keeps them all."""

SLOWEST, FASTEST = 300, 4_000_000

app = typer.Typer(help="Run simulated controllers.", no_args_is_help=True, add_completion=False)
"""Command line of the simulators; without a command, `--like` names the report of the line to simulate."""


@dataclass(frozen=True, slots=True)
class DpramFile:
    """The file of a dual-port RAM."""

    path: Path


Place = Path | tuple[str, int] | DpramFile
"""The link to a pseudo-terminal, the host and port of a TCP listener, or a dual-port RAM."""

PtyOption = Annotated[Path | None, typer.Option(help="Make a pseudo-terminal, and this symbolic link to it.")]
ListenOption = Annotated[str | None, typer.Option(help="Listen for one TCP client: tcp://HOST:PORT.")]
BaudOption = Annotated[
    int | None,
    typer.Option(min=SLOWEST, max=FASTEST, help="Let bytes take their time, 8N1; left out, they take none."),
]
TruthOption = Annotated[
    Path | None, typer.Option(help="Append what really happens to this file, as JSON lines.")
]
ControlOption = Annotated[str | None, typer.Option(help="Offer the HTTP control interface at HOST:PORT.")]
SeedOption = Annotated[int, typer.Option(help="Seed of the faults' dice.")]
QuirkOption = Annotated[
    list[str] | None,
    typer.Option(help="Be otherwise than the gateway assumes, by the name that `commission` gives it."),
]


@app.callback(invoke_without_command=True)
def simulate(
    context: typer.Context,
    like: Annotated[
        Path | None,
        typer.Option(help="Behave as the line in this report of `motion-gateway commission`."),
    ] = None,
    pty: PtyOption = None,
    listen: ListenOption = None,
    dpram: Annotated[Path | None, typer.Option(help="Make a dual-port RAM in this file.")] = None,
    baud: BaudOption = None,
    truth: TruthOption = None,
    control: ControlOption = None,
    seed: SeedOption = 0,
) -> None:
    """Run simulated controllers."""
    if context.invoked_subcommand is not None:
        return
    if like is None:
        raise typer.BadParameter("name a controller, rc400 or fics, or a report with --like")
    try:
        likeness = read_likeness(like)
        place = read_fics_place(pty, listen, dpram) if likeness.is_robot else read_place(pty, listen)
        service = read_service(place, baud, truth, control)
    except ValueError as error:
        raise typer.BadParameter(str(error)) from None
    if likeness.is_robot:
        _run(
            service,
            lambda log: likeness.turn_fics(build_fics(likeness.layout(), log, None, seed)),
            create_fics_control,
            likeness.title,
        )
    else:
        _run(
            service,
            lambda log: likeness.turn_rc400(build_line(likeness.bodies(), monotonic(), log, seed=seed)),
            create_control,
            likeness.title,
        )


@dataclass(frozen=True, slots=True)
class Service:
    """How to offer a machine; `baud` None paces nothing."""

    place: Place
    baud: int | None = None
    truth: Path | None = None
    control: tuple[str, int] | None = None


@app.command()
def rc400(
    bodies: Annotated[str, typer.Option(help="Body numbers, hexadecimal 00-77: 00,01,3F.")],
    pty: PtyOption = None,
    listen: ListenOption = None,
    baud: BaudOption = None,
    truth: TruthOption = None,
    control: ControlOption = None,
    seed: SeedOption = 0,
    quirk: QuirkOption = None,
) -> None:
    """Simulate an RC-400 link master with RC-420 controllers until interrupted."""
    try:
        numbers = read_bodies(bodies)
        service = read_service(read_place(pty, listen), baud, truth, control)
        turn = read_quirks(quirk or (), RC400_QUIRKS)
    except ValueError as error:
        raise typer.BadParameter(str(error)) from None
    _run(
        service,
        lambda log: turn(build_line(numbers, monotonic(), log, seed=seed)),
        create_control,
        f"RC-400 with bodies {', '.join(f'{body:02X}' for body in numbers)}",
    )


@app.command()
def fics(
    units: Annotated[int, typer.Option(help="How many units, 1 to 9.")] = 1,
    axes: Annotated[
        str, typer.Option(help="Every unit's axes, of X Y Z @ W; with XY first, unit 1 is a miniSCARA.")
    ] = "XYZ",
    pty: PtyOption = None,
    listen: ListenOption = None,
    dpram: Annotated[Path | None, typer.Option(help="Make a dual-port RAM in this file.")] = None,
    macros: Annotated[
        Path | None, typer.Option(help="Macros of this TOML file, in place of those built in.")
    ] = None,
    terminator: Annotated[
        Terminator, typer.Option(help="What ends the lines to the host; from the host either does.")
    ] = "cr",
    baud: BaudOption = None,
    truth: TruthOption = None,
    control: ControlOption = None,
    seed: SeedOption = 0,
    quirk: QuirkOption = None,
) -> None:
    """Simulate a Fics robot system with C-HOST until interrupted."""
    try:
        programs = MACROS if macros is None else read_macros(macros)
        layout = Layout(units=units, axes=axes, macros=programs)
        service = read_service(read_fics_place(pty, listen, dpram), baud, truth, control)
        turn = read_quirks(quirk or (), FICS_QUIRKS)
    except ValueError as error:
        raise typer.BadParameter(str(error)) from None
    settings = LineSettings(terminator=terminator)
    _run(
        service,
        lambda log: turn(build_fics(layout, log, settings, seed)),
        create_fics_control,
        f"Fics with {units} unit{'s' if units > 1 else ''} of axes {axes}",
    )


M = TypeVar("M", bound=Machine)


def _run(
    service: Service, build: Callable[[TruthLog], M], control: Callable[[M, Port], FastAPI], title: str
) -> None:
    """Run a machine until interrupted; a port or file that cannot be opened ends the program."""
    try:
        with asyncio.Runner(loop_factory=uvloop.new_event_loop) as runner:
            runner.run(_serve_until_stopped(service, build, control, title))
    except OSError as error:
        typer.echo(f"The simulated line did not start: {error}.", err=True)
        raise typer.Exit(1) from None


def read_quirks(names: Sequence[str], known: Mapping[str, Callable[[M], None]]) -> Callable[[M], M]:
    """Read the names of quirks, and give what gives them to a machine.

    :raises ValueError: there is no quirk of this name.
    """
    for name in names:
        if name not in known:
            raise ValueError(f"{name!r} is no quirk here; they are {', '.join(known)}")

    def turn(machine: M) -> M:
        for name in names:
            known[name](machine)
        return machine

    return turn


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


def read_fics_place(pty: Path | None, listen: str | None, dpram: Path | None) -> Place:
    """Take one of the three places where a Fics can be.

    :raises ValueError: not exactly one is given, or no TCP address.
    """
    if [pty, listen, dpram].count(None) != 2:
        raise ValueError("give one of --pty PATH, --listen tcp://HOST:PORT and --dpram FILE")
    return read_place(pty, listen) if dpram is None else DpramFile(dpram)


def read_service(place: Place, baud: int | None, truth: Path | None, control: str | None) -> Service:
    """Put the options together.

    :raises ValueError: the control interface has no HOST:PORT, or a dual-port RAM a speed.
    """
    if baud is not None and isinstance(place, DpramFile):
        raise ValueError("--baud is the speed of a serial line; leave it out with --dpram")
    return Service(place, baud, truth, None if control is None else read_endpoint(control))


async def _serve_until_stopped(
    service: Service, build: Callable[[TruthLog], M], control: Callable[[M, Port], FastAPI], title: str
) -> None:
    """Run a machine until SIGINT or SIGTERM."""
    stopped = asyncio.Event()
    loop = asyncio.get_running_loop()
    for number in (signal.SIGINT, signal.SIGTERM):
        loop.add_signal_handler(number, stopped.set)
    async with AsyncExitStack() as stack:
        # Opened once, before anything runs.
        sink = None if service.truth is None else stack.enter_context(service.truth.open("a", buffering=1))
        machine = build(TruthLog(KEPT_FACTS, sink))
        port = await _serve(machine, service)
        stack.push_async_callback(port.aclose)
        if service.control is not None:
            await stack.enter_async_context(_control(control(machine, port), *service.control))
        # What has been made by now stays: looking it through again would hold up the machine for 50 ms.
        gc.collect()
        gc.freeze()
        typer.echo(f"{title} at {port.address}")
        await stopped.wait()


async def _serve(machine: Machine, service: Service) -> Port:
    match service.place:
        case DpramFile(path):
            return serve_dpram(machine, path)
        case Path() as link:
            return serve_pty(machine, link, service.baud)
        case host, port:
            return await serve_tcp(machine, host, port, service.baud)


class _Server(uvicorn.Server):
    @contextmanager
    def capture_signals(self) -> Iterator[None]:
        """Leave the signals to the program."""
        yield


@asynccontextmanager
async def _control(control: FastAPI, host: str, number: int) -> AsyncIterator[None]:
    """Serve the control interface in this event loop, where the machine runs too."""
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    listener = socket.create_server((host, number), family=family)
    config = uvicorn.Config(control, lifespan="off", log_config=None, timeout_graceful_shutdown=1)
    server = _Server(config)
    serving = asyncio.create_task(server.serve([listener]))
    typer.echo(f"control interface at http://{host}:{listener.getsockname()[1]}")
    try:
        yield
    finally:
        server.should_exit = True
        await serving


def demo_line(bodies: Sequence[int]) -> Rc400Line:
    """Build an RC-400 line that has learnt what the demo shows."""
    now = monotonic()
    line = build_line(bodies, now, TruthLog(KEPT_FACTS))
    teach(line, now)
    return line


def demo_robot() -> SimulatedFics:
    """Build a Fics of two units."""
    return build_fics(Layout(units=2), TruthLog(KEPT_FACTS))
