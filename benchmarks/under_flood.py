"""The gateway's loop, stops and jogs, of bodies and a robot, while one client floods it.

`python -m benchmarks.under_flood SECONDS KIND...` pours each kind, and prints what it found as JSON. The
gateway, its simulated lines and the operator share one event loop in one process, whose waiting for a
processor is known exactly: so a busy machine is told from a gateway that is held. The flooder is a process of
its own. The yardstick is the same run without a flood.
"""

import asyncio
import gc
import json
import os
import signal
import sys
from asyncio.subprocess import PIPE, Process
from collections.abc import AsyncIterator, Sequence
from contextlib import AsyncExitStack, asynccontextmanager, suppress
from dataclasses import asdict, dataclass, field
from math import ceil
from pathlib import Path
from tempfile import TemporaryDirectory
from time import monotonic, process_time
from typing import Any, Final

import uvloop

from app.server import serve
from benchmarks.figures import Figure, Target
from benchmarks.floods import FLOODS
from benchmarks.processes import free_port, resident_mib
from benchmarks.stop_latency import SPEEDS, quantile_ms
from benchmarks.unhindered import Span
from gateway.access.keys import KeyStore
from gateway.access.roles import Role
from gateway.config import load
from simulator.fics.layout import Layout
from simulator.fics.line import build_line as build_robot
from simulator.ports import serve_tcp
from simulator.rorze.line import build_line
from simulator.truth import Fact, TruthLog

BODIES: Final = (0x00, 0x01, 0x3F)
BEAT_S: Final = 0.1
"""Seconds between two heartbeats of a jog; the gateway wants one twice a second."""
HEARTBEAT_S: Final = 0.5
STOP_PAUSE_S: Final = 0.02
TURN_S: Final = 0.002
"""Seconds between looks at whether the loop turns."""
LONG_MS: Final = 5.0
"""Shorter turns are not noted."""
READY_S: Final = 60.0
SETTLE_S: Final = 0.05
"""A flood has begun by then."""
REST_S: Final = 10.0
"""Connections that a flood has left behind are gone by then."""
LOOK_S: Final = 0.5
LOOKS: Final = 6
QUIET_TIMES: Final = 3
LEAST_S: Final = 0.2
"""Seconds for which each kind is poured, at least."""
TRIES: Final = 4
"""A kind that failed is poured again: what a flood does it does each time, what the machine did was once."""
_ROBOT: Final = '{id = "r1", units = [{number = 1, axes = ["X", "Y", "Z"]}]}'
_JOGS: Final[dict[str, dict[str, Any]]] = {
    "/bodies/3F/jogs": {"at_most": {"value": 900_000, "unit": "pulse"}},
    "/robots/r1/jogs": {"unit": 1, "axis": "X"},
}
_DIRECTIONS: Final = ("+", "-")
"""Directions in turn, so that nothing runs against its limit."""
_ENDS: Final = {"/bodies/3F/jogs": ("5SS", 0x3F), "/robots/r1/jogs": ("JOG X", None)}
"""The command by which a jog ends, and of which body."""
_KEYS: Final = tuple(Role(name) for name in ("viewer", "operator", "admin"))

LONGEST_MS: Final = 20.0
"""The loop is held by one turn no longer."""
STOP_MS: Final = 20.0
"""Milliseconds by which a stop may take longer than without a flood."""
BEAT_MS: Final = 50.0
"""Milliseconds within which a heartbeat is answered, and by which the dead man's switch may be late."""


@dataclass
class Measured:
    """One flood, or none; times are without those for which this process waited for a processor."""

    stops_ms: list[float] = field(default_factory=list)
    """Times from the request of a stop to its answer, for a body that stands still."""
    beats_ms: list[float] = field(default_factory=list)
    """Times from a heartbeat to its answer."""
    holds_ms: list[float] = field(default_factory=list)
    """Milliseconds for which one turn held the loop, where that was long."""
    silences_ms: list[float] = field(default_factory=list)
    """Times from the last heartbeat of a jog to the command that ends it."""
    told: dict[int, int] = field(default_factory=dict)
    """Number of answers to the flood by status; of a WebSocket, by the code that closed it."""
    failures: list[str] = field(default_factory=list)
    """Wrong answers and missing ones, in words."""
    stretch: float = 1.0
    """Ratio of real time to the time the process could run: the flooder goes on while the gateway waits."""

    def faults(self, alone: "Measured") -> list[str]:
        """All that the flood has brought about, in words; `alone` is the same without one."""
        faults, beat_ms = list(self.failures), BEAT_MS * self.stretch
        if (longest := max(self.holds_ms, default=0.0)) > LONGEST_MS:
            faults.append(f"the loop was held for {longest:.0f} ms")
        if not self.stops_ms:
            faults.append("no stop was answered")
        elif (slow := p99(self.stops_ms)) > p99(alone.stops_ms) + STOP_MS * self.stretch:
            faults.append(f"a stop took {slow:.0f} ms")
        if (beat := max(self.beats_ms, default=0.0)) > beat_ms:
            faults.append(f"a heartbeat was answered after {beat:.0f} ms")
        faults += [
            f"the dead man's switch stopped after {silence:.0f} ms"
            for silence in self.silences_ms
            if silence > 1000 * HEARTBEAT_S + beat_ms
        ]
        return faults if len(self.silences_ms) == len(_JOGS) else [*faults, "a jog was not ended"]


@dataclass
class Found:
    """All floods, one after the other, and what they have left behind."""

    alone: Measured
    floods: dict[str, Measured]
    faults: dict[str, list[str]]
    """Faults by kind of flood, of the kinds that failed each time."""
    times: int
    """Floods poured in all."""
    sockets: tuple[int, int]
    """Open before and after them."""
    resident_mib: tuple[float, float]
    idle: float
    """The part of a processor that is used afterwards."""


def p99(values: Sequence[float]) -> float:
    """The least that 99 of 100 do not exceed."""
    return sorted(values)[ceil(0.99 * len(values)) - 1]


async def poured(seconds: float, kinds: Sequence[str]) -> Found:
    """Pour each kind for `seconds` in a process of its own, and give what it found.

    :raises RuntimeError: it ended without an answer; its error stands above.
    """
    program = [sys.executable, "-m", "benchmarks.under_flood", str(seconds), *kinds]
    process = await asyncio.create_subprocess_exec(*program, stdout=PIPE)
    try:
        said, _ = await process.communicate()
    finally:
        if process.returncode is None:
            process.kill()
    if process.returncode:
        raise RuntimeError(f"floods ended with {process.returncode}; the error stands above.")
    told = json.loads(said)
    told["alone"], told["floods"] = (
        _measured(told["alone"]),
        {name: _measured(flood) for name, flood in told["floods"].items()},
    )
    return Found(**told)


def _measured(told: dict[str, Any]) -> Measured:
    return Measured(**(told | {"told": {int(status): times for status, times in told["told"].items()}}))


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
    """A gateway with keys on simulated lines, all of this process, and a client that floods."""

    port: int
    flooder: Process
    keys: dict[str, str]
    truth: dict[str, TruthLog]
    holds_ms: list[float] = field(default_factory=list)
    """Long turns of the loop since the last measurement."""
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
        self.holds_ms.clear()
        poured = Span()
        try:
            async with asyncio.timeout(READY_S):
                await asyncio.sleep(SETTLE_S)
                poured = Span()
                await asyncio.gather(
                    self._stop(clients[0], poured, seconds, found),
                    *(
                        self._jog(client, path, poured, seconds, found)
                        for client, path in zip(clients[1:], _JOGS, strict=True)
                    ),
                )
        except (OSError, EOFError, TimeoutError) as error:
            found.failures.append(f"{name}: {error!r}")
        found.holds_ms, found.stretch = list(self.holds_ms), poured.stretch()
        found.told = await self.flood("")
        for client in clients:
            client.close()
        return found

    async def rest(self, sockets: int) -> tuple[float, float]:
        """Measure after the floods: the share of a processor that is still used, and the memory in MiB.

        Waits first until no more than `sockets` are open.
        """
        until = monotonic() + REST_S
        while open_sockets() > sockets and monotonic() < until:  # noqa: ASYNC110  # nobody tells of it
            await asyncio.sleep(0.05)
        # What winds down ends within seconds; a connection that is read for ever never does.
        shares = [await self._share_used() for _ in range(LOOKS)]
        return min(shares), resident_mib(os.getpid())

    async def _share_used(self) -> float:
        before, begun_at = process_time(), monotonic()
        await asyncio.sleep(LOOK_S)
        return (process_time() - before) / (monotonic() - begun_at)

    async def watch(self) -> None:
        """Note each turn of the loop that was long."""
        while True:
            turn = Span()
            await asyncio.sleep(TURN_S)
            if (held_ms := turn.worked_ms()) > LONG_MS:
                self.holds_ms.append(held_ms)

    async def _stop(self, client: Client, poured: Span, seconds: float, found: Measured) -> None:
        while poured.ms() < 1000 * seconds:
            span = Span()
            status, _ = await client.ask("POST", "/bodies/00/stop", {"mode": "immediate"})
            found.stops_ms.append(span.ms())
            if status != 200:
                found.failures.append(f"a stop was answered {status}")
            await asyncio.sleep(STOP_PAUSE_S)

    async def _jog(self, client: Client, path: str, poured: Span, seconds: float, found: Measured) -> None:
        """Jog, and then be silent, until the dead man's switch has ended it."""
        wanted = _JOGS[path] | {"direction": _DIRECTIONS[self.measured % 2]}
        status, jog = await client.ask("POST", path, wanted)
        while status == 409 and poured.ms() < 1000 * seconds:  # the jog before it is not over yet
            await asyncio.sleep(STOP_PAUSE_S)
            status, jog = await client.ask("POST", path, wanted)
        if status != 201:
            found.failures.append(f"{path} was answered {status}: {jog}")
            return
        place = f"{path}/{jog['id']}/heartbeat"
        beat, last_at = Span(), monotonic()
        while poured.ms() < 1000 * seconds:
            await asyncio.sleep(BEAT_S)
            now, at = Span(), monotonic()
            status, _ = await client.ask("POST", place)
            found.beats_ms.append(now.ms())
            if status == 409 and at - last_at > HEARTBEAT_S:  # the machine has kept this process from it
                break
            beat, last_at = now, at
            if status != 200:
                found.failures.append(f"a heartbeat of {path} was answered {status}")
                return
        text, body = _ENDS[path]
        while not self._ended(path, text, body, last_at):  # noqa: ASYNC110  # the line tells nobody
            await asyncio.sleep(TURN_S)
        found.silences_ms.append(beat.ms())

    def _ended(self, path: str, text: str, body: int | None, after: float) -> list[Fact]:
        told = self.truth[path].of("command", body)
        return [fact for fact in told if fact.at > after and str(fact.facts["text"]).startswith(text)]


def open_sockets() -> int:
    """Number of sockets that this process has open."""
    open_now = 0
    for place in Path("/proc/self/fd").iterdir():
        with suppress(FileNotFoundError):  # closed since
            open_now += str(place.readlink()).startswith("socket:")
    return open_now


async def run(seconds: float) -> list[Figure]:
    """Pour each kind of flood for its part of the time; the yardstick is the same gateway alone."""
    found = await poured(max(LEAST_S, seconds / len(FLOODS)), list(FLOODS))
    alone, floods = found.alone, found.floods.values()
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


async def main(seconds: float, kinds: Sequence[str]) -> Found:
    """Pour each kind, and those that failed again after the others."""
    async with stand() as standing:
        sockets = open_sockets()
        await standing.measure("", LEAST_S)
        alone = await standing.measure("", QUIET_TIMES * seconds)
        _, before_mib = await standing.rest(sockets)
        floods: dict[str, Measured] = {}
        failed, poured = list(kinds), 0
        for _ in range(TRIES):
            for name in failed:
                floods[name] = await standing.measure(name, seconds)
            poured += len(failed)
            failed = [name for name in failed if floods[name].faults(alone)]
        idle, after_mib = await standing.rest(sockets)
        faults = {name: floods[name].faults(alone) for name in failed}
        return Found(alone, floods, faults, poured, (sockets, open_sockets()), (before_mib, after_mib), idle)


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
        ours, floods = (
            {str(role): keys.create(f"{role}{number}", role) for role in _KEYS} for number in (1, 2)
        )
        await stack.enter_async_context(_gateway(config))
        flooder = await stack.enter_async_context(_flooder(web, floods))
        found = Stand(web, flooder, ours, {"/bodies/3F/jogs": bodies, "/robots/r1/jogs": robot})
        watching = asyncio.create_task(found.watch())
        stack.callback(watching.cancel)
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


@asynccontextmanager
async def _gateway(config: Path) -> AsyncIterator[None]:
    serving = asyncio.create_task(serve(load(config), config.with_suffix(".data")))
    try:
        yield
    finally:
        signal.raise_signal(signal.SIGTERM)
        await serving


async def _teach(stand: Stand) -> None:
    """Wait until the lines are there; let the body that jogs know how fast it moves, and home the robot."""
    async with asyncio.timeout(READY_S):
        client = await _admitted(stand)
        while (await client.ask("GET", "/readyz"))[0] != 200:  # noqa: ASYNC110  # another process
            await asyncio.sleep(0.1)
    for name, value in SPEEDS.items():
        await client.ask("POST", f"/bodies/3F/commands/{name}", value)
    await client.ask("POST", "/robots/r1/units/1/moves?wait=60", {"kind": "home"})
    client.close()


async def _admitted(stand: Stand) -> Client:
    while True:
        with suppress(OSError):  # it does not listen yet
            return await stand.client("admin")
        await asyncio.sleep(TURN_S)


if __name__ == "__main__":
    gc.disable()  # as the command line does
    print(json.dumps(asdict(uvloop.run(main(float(sys.argv[1]), sys.argv[2:])))))
