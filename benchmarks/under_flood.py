"""What a gateway does while one client floods it: its loop, its stops and its jogs, bodies and a robot.

The yardstick of each flood is the same gateway alone, and a server beside it that only answers.
"""

import asyncio
import json
import os
import sys
from asyncio.subprocess import PIPE, Process
from collections.abc import AsyncIterator, Awaitable
from contextlib import AsyncExitStack, asynccontextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from time import monotonic
from typing import Any, Final

from benchmarks.figures import Figure, Target
from benchmarks.floods import FLOODS
from benchmarks.processes import cpu_s, free_port, module, resident_mib, waited_s
from benchmarks.stop_latency import SPEEDS, quantile_ms
from gateway.access.keys import KeyStore
from gateway.access.roles import Role
from simulator.fics.layout import Layout
from simulator.fics.line import build_line as build_robot
from simulator.ports import serve_tcp
from simulator.rorze.line import build_line
from simulator.truth import Fact, TruthLog

BODIES: Final = (0x00, 0x01, 0x3F)
BEAT_S: Final = 0.1
"""Between two heartbeats of a jog; the gateway wants one twice a second."""
HEARTBEAT_S: Final = 0.5
STOP_PAUSE_S: Final = 0.02
READY_S: Final = 60.0
SETTLE_S: Final = 0.05
"""A flood has begun by then."""
REST_S: Final = 10.0
"""Connections that a flood has left behind are gone by then."""
LOOK_S: Final = 0.5
QUIET_SHARE: Final = 0.1
LEAST_S: Final = 0.2
"""For which each kind is poured, at least."""
_ROBOT: Final = '{id = "r1", units = [{number = 1, axes = ["X", "Y", "Z"]}]}'
_JOGS: Final[dict[str, dict[str, Any]]] = {
    "/bodies/3F/jogs": {"at_most": {"value": 900_000, "unit": "pulse"}},
    "/robots/r1/jogs": {"unit": 1, "axis": "X"},
}
_DIRECTIONS: Final = ("+", "-")
"""In turn, so that nothing runs against its limit."""
_ENDS: Final = {"/bodies/3F/jogs": ("5SS", 0x3F), "/robots/r1/jogs": ("JOG X", None)}
"""The command by which a jog ends, and of which body."""
_KEYS: Final = tuple(Role(name) for name in ("viewer", "operator", "admin"))


@dataclass
class Measured:
    """One flood, or none."""

    stops_ms: list[float] = field(default_factory=list)
    """From the request of a stop to its answer, for a body that stands still.

    These and the next are without the time for which this process or the gateway waited for a processor.
    """
    beats_ms: list[float] = field(default_factory=list)
    """From a heartbeat to its answer."""
    echoes_ms: list[float] = field(default_factory=list)
    """The same for a server that does nothing else, at the same moments."""
    holds_ms: list[float] = field(default_factory=list)
    """Processor time that the gateway's loop took for one turn, where it was long."""
    silences_ms: list[float] = field(default_factory=list)
    """From the last heartbeat of a jog to the command that ends it."""
    told: dict[int, int] = field(default_factory=dict)
    """How often the flood was answered with each status; a WebSocket, with which code it was closed."""
    failures: list[str] = field(default_factory=list)
    """What was answered wrongly, or not at all."""


class Client:
    """A connection of an operator, kept alive."""

    def __init__(self, port: int, key: str) -> None:
        self._port, self._key = port, key
        self._turn = asyncio.Lock()

    async def open(self) -> "Client":
        """Connect."""
        self._reader, self._writer = await asyncio.open_connection("127.0.0.1", self._port)
        return self

    async def ask(self, method: str, path: str, content: object = None) -> tuple[int, Any]:
        """Ask, and give the status and what was answered."""
        body = b"" if content is None else json.dumps(content).encode()
        head = (
            f"{method} {path} HTTP/1.1\r\nHost: 127.0.0.1\r\nAuthorization: Bearer {self._key}\r\n"
            f"Content-Type: application/json\r\nContent-Length: {len(body)}\r\n\r\n"
        )
        async with self._turn:
            self._writer.write(head.encode() + body)
            told = (await self._reader.readuntil(b"\r\n\r\n")).lower()
            length = int(told.partition(b"content-length:")[2].partition(b"\r")[0])
            answer = await self._reader.readexactly(length)
        return int(told.split(b" ", 2)[1]), json.loads(answer or b"null")

    def close(self) -> None:
        """End it."""
        self._writer.close()


@dataclass
class Stand:
    """A gateway with keys on simulated lines of this process, its loop watched, and a client that floods."""

    port: int
    gateway: Process
    flooder: Process
    keys: dict[str, str]
    truth: dict[str, TruthLog]
    holds: list[tuple[float, float]] = field(default_factory=list)
    """When a turn of the gateway's loop ended that was long, and its milliseconds of processor time."""
    echo: Client | None = None
    measured: int = 0

    async def flood(self, name: str) -> dict[int, int]:
        """Begin a flood, or end it with an empty name; give how the one before was answered."""
        assert self.flooder.stdin is not None
        assert self.flooder.stdout is not None
        self.flooder.stdin.write(name.encode() + b"\n")
        told = json.loads(await self.flooder.stdout.readline())
        return {int(status): times for status, times in told.items()}

    async def client(self, role: str = "operator") -> Client:
        """Connect with the key of a role."""
        return await Client(self.port, self.keys[role]).open()

    async def measure(self, name: str, seconds: float) -> Measured:
        """Stop and jog for some seconds, among a flood."""
        found = Measured()
        self.measured += 1
        clients = [await self.client() for _ in range(1 + len(_JOGS))]
        await self.flood(name)
        begun_at = monotonic()
        try:
            async with asyncio.timeout(READY_S):
                await asyncio.sleep(SETTLE_S)
                ends_at = monotonic() + seconds
                await asyncio.gather(
                    self._stop(clients[0], ends_at, found),
                    *(
                        self._jog(client, path, ends_at, found)
                        for client, path in zip(clients[1:], _JOGS, strict=True)
                    ),
                )
        except (OSError, EOFError, TimeoutError) as error:
            found.failures.append(f"{name}: {error!r}")
        found.told = await self.flood("")
        ended_at = monotonic()
        for client in clients:
            client.close()
        found.holds_ms = [ms for at, ms in self.holds if begun_at <= at <= ended_at]
        return found

    async def rest(self, sockets: int) -> tuple[float, float]:
        """What floods have left behind: the share of a processor that the gateway takes, and its MiB.

        So many sockets may be open before it is looked at.
        """
        until = monotonic() + REST_S
        while self.sockets() > sockets and monotonic() < until:  # noqa: ASYNC110  # another process
            await asyncio.sleep(0.05)
        before, begun_at = cpu_s(self.gateway), monotonic()
        await asyncio.sleep(LOOK_S)
        return (cpu_s(self.gateway) - before) / (monotonic() - begun_at), resident_mib(self.gateway)

    def sockets(self) -> int:
        """How many sockets the gateway has open."""
        open_now = 0
        for place in Path(f"/proc/{self.gateway.pid}/fd").iterdir():
            with suppress(FileNotFoundError):  # closed since
                open_now += str(place.readlink()).startswith("socket:")
        return open_now

    async def _stop(self, client: Client, ends_at: float, found: Measured) -> None:
        while monotonic() < ends_at:
            took_ms, status = await self._timed(client.ask("POST", "/bodies/00/stop", {"mode": "immediate"}))
            found.stops_ms.append(took_ms)
            if status != 200:
                found.failures.append(f"a stop was answered {status}")
            await asyncio.sleep(STOP_PAUSE_S)

    async def _jog(self, client: Client, path: str, ends_at: float, found: Measured) -> None:
        """Jog, and then be silent, until the dead man's switch has ended it."""
        wanted = _JOGS[path] | {"direction": _DIRECTIONS[self.measured % 2]}
        status, jog = await client.ask("POST", path, wanted)
        while status == 409 and monotonic() < ends_at:  # the jog before it is not over yet
            await asyncio.sleep(STOP_PAUSE_S)
            status, jog = await client.ask("POST", path, wanted)
        if status != 201:
            found.failures.append(f"{path} was answered {status}: {jog}")
            return
        assert self.echo is not None
        place = f"{path}/{jog['id']}/heartbeat"
        last_at, before_s = monotonic(), self._waited_s()
        while monotonic() < ends_at:
            await asyncio.sleep(BEAT_S)
            found.echoes_ms.append((await self._timed(self.echo.ask("GET", "/")))[0])
            last_at, before_s = monotonic(), self._waited_s()
            took_ms, status = await self._timed(client.ask("POST", place))
            found.beats_ms.append(took_ms)
            if status != 200:
                found.failures.append(f"a heartbeat of {path} was answered {status}")
                return
        text, body = _ENDS[path]
        while not (ended := self._ended(path, text, body, last_at)):  # noqa: ASYNC110  # the line tells nobody
            await asyncio.sleep(0.01)
        found.silences_ms.append(1000 * (ended[0].at - last_at - self._waited_s() + before_s))

    async def _timed(self, asking: Awaitable[tuple[int, Any]]) -> tuple[float, int]:
        begun_at, before_s = monotonic(), self._waited_s()
        status, _ = await asking
        took_s = monotonic() - begun_at - self._waited_s() + before_s
        return 1000 * max(0.0, took_s), status

    def _waited_s(self) -> float:
        return waited_s(self.gateway.pid) + waited_s(os.getpid())

    def _ended(self, path: str, text: str, body: int | None, after: float) -> list[Fact]:
        told = self.truth[path].of("command", body)
        return [it for it in told if it.at > after and str(it.facts["text"]).startswith(text)]


async def run(seconds: float) -> list[Figure]:
    """Pour each kind of flood for its part of the time; the yardstick is the same gateway alone."""
    async with stand() as standing:
        await standing.measure("", LEAST_S)
        alone = await standing.measure("", max(LEAST_S, QUIET_SHARE * seconds))
        each_s = max(LEAST_S, (1 - QUIET_SHARE) * seconds / len(FLOODS))
        floods = [await standing.measure(name, each_s) for name in FLOODS]
    stops_ms = [ms for flood in floods for ms in flood.stops_ms]
    beats_ms = [ms for flood in floods for ms in flood.beats_ms]
    silences_ms = [ms for flood in floods for ms in flood.silences_ms]
    failures = sum(len(flood.failures) for flood in floods)
    worst = max((max(flood.holds_ms, default=0.0) for flood in floods), default=0.0)
    name = f"among {len(FLOODS)} kinds of floods"
    return [
        quantile_ms(f"stop {name}: p50", 0.5, stops_ms, alone.stops_ms, 20.0),
        quantile_ms(f"stop {name}: p99", 0.99, stops_ms, alone.stops_ms, 20.0),
        quantile_ms(f"heartbeat {name}: longest", 1.0, beats_ms, alone.beats_ms, 50.0),
        quantile_ms(f"dead man's switch {name}: longest", 1.0, silences_ms, alone.silences_ms, 550.0),
        quantile_ms(
            f"turn of the loop {name}: longest", 1.0, [worst], [max(alone.holds_ms, default=0.0)], 20.0
        ),
        Figure(f"wrong answers {name}", "", [failures], [len(alone.failures)], Target("figure", "<=", 0.0)),
    ]


@asynccontextmanager
async def stand() -> AsyncIterator[Stand]:
    """Run all of it; the jogs have been tried once when it is given."""
    bodies, robot = TruthLog(100_000), TruthLog(100_000)
    web = free_port()
    async with AsyncExitStack() as stack:
        line = await serve_tcp(build_line(BODIES, monotonic(), bodies), "127.0.0.1", 0)
        stack.push_async_callback(line.aclose)
        cell = await serve_tcp(build_robot(Layout(units=1), robot), "127.0.0.1", 0)
        stack.push_async_callback(cell.aclose)
        folder = Path(stack.enter_context(TemporaryDirectory()))
        config = _write_config(folder, web, line.address, cell.address)
        keys = KeyStore(config.with_suffix(".data"))
        ours, floods = ({str(role): keys.create(f"{role}{it}", role) for role in _KEYS} for it in (1, 2))
        process = await stack.enter_async_context(module("benchmarks.watched_gateway", web, str(config)))
        flooder = await stack.enter_async_context(_flooder(web, floods))
        found = Stand(web, process, flooder, ours, {"/bodies/3F/jogs": bodies, "/robots/r1/jogs": robot})
        watching = asyncio.create_task(_watch(process, found.holds))
        stack.callback(watching.cancel)
        answering = await asyncio.start_server(_answer, "127.0.0.1", 0)
        stack.callback(answering.close)
        found.echo = await Client(answering.sockets[0].getsockname()[1], "").open()
        stack.callback(found.echo.close)
        await _teach(found)
        yield found


def _write_config(folder: Path, web: int, line: str, cell: str) -> Path:
    path = folder / "gateway.toml"
    data = path.with_suffix(".data")
    data.mkdir(mode=0o700)
    tables = ", ".join(f'{{id = "{body:02X}"}}' for body in BODIES)
    path.write_text(
        f"[server]\nport = {web}\n"
        f'[[lines]]\nid = "line1"\naddress = "{line}"\nreply_timeout_s = 3.0\nbodies = [{tables}]\n'
        f'[[lines]]\nid = "cell"\nprotocol = "fics"\nmode = 3\naddress = "{cell}"\nrobot = {_ROBOT}\n'
    )
    return path


@asynccontextmanager
async def _flooder(port: int, keys: dict[str, str]) -> AsyncIterator[Process]:
    process = await asyncio.create_subprocess_exec(
        sys.executable, "-m", "benchmarks.floods", str(port), json.dumps(keys), stdin=PIPE, stdout=PIPE
    )
    try:
        yield process
    finally:
        process.kill()
        await process.wait()


async def _watch(process: Process, holds: list[tuple[float, float]]) -> None:
    assert process.stdout is not None
    async for line in process.stdout:
        at, ms = line.split()
        holds.append((float(at), float(ms)))


async def _answer(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    """Answer each request with nothing, as fast as this machine lets a server do that."""
    while await reader.readline():
        while (await reader.readline()).strip():
            pass
        writer.write(b"HTTP/1.1 200 OK\r\nContent-Length: 0\r\n\r\n")
    writer.close()


async def _teach(stand: Stand) -> None:
    """Wait until the lines are there; let the body that jogs know how fast it moves, and home the robot."""
    client = await stand.client("admin")
    async with asyncio.timeout(READY_S):
        while (await client.ask("GET", "/readyz"))[0] != 200:  # noqa: ASYNC110  # another process
            await asyncio.sleep(0.1)
    for name, value in SPEEDS.items():
        await client.ask("POST", f"/bodies/3F/commands/{name}", value)
    await client.ask("POST", "/robots/r1/units/1/moves?wait=60", {"kind": "home"})
    client.close()
