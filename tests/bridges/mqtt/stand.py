"""A real broker, a gateway on a simulated line, and a bridge between them, each a process of its own."""

import json
import shutil
import signal
import socket
import subprocess
import threading
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, NamedTuple
from uuid import uuid4

import httpx
import paho.mqtt.client as paho
import pytest
from paho.mqtt.enums import CallbackAPIVersion
from paho.mqtt.packettypes import PacketTypes
from paho.mqtt.properties import Properties

from gateway.access.keys import KeyStore
from gateway.access.roles import Role
from tests.e2e.processes import PATIENCE_S, Program, SimulatedLine, data_directory, until

ROOT: Final = "motion/test"
BODIES: Final = "00,3F"
MES: Final = "mes"
PER_LISTENER: Final = ("per_listener_settings true", "user root", "max_queued_messages 100000")
"""Lines before the listeners; as root the broker would become a user who may not read a test's files."""


def mosquitto() -> str:
    """Give the broker's program."""
    program = shutil.which(
        "mosquitto", path="/usr/sbin:/usr/local/sbin:/usr/bin:/usr/local/bin:/opt/homebrew/sbin"
    )
    if program is None:
        pytest.skip("mosquitto is not installed: make peers installs it")
    return program


def free_port() -> int:
    """Find a port that is free now."""
    with closing(socket.socket()) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


class Broker:
    """A mosquitto, which keeps nothing over its restarts."""

    def __init__(self, folder: Path, *settings: str, port: int | None = None) -> None:
        self.port = port or free_port()
        self._config = folder / f"mosquitto-{self.port}.conf"
        self._log = folder / f"mosquitto-{self.port}.log"
        usual = [*PER_LISTENER, f"listener {self.port} 127.0.0.1", "allow_anonymous true"]
        nodelay = [] if any("nodelay" in it for it in settings) else ["set_tcp_nodelay true"]
        self._config.write_text("\n".join([*nodelay, *usual, *settings, ""]))
        self._program = mosquitto()
        self.start()

    def start(self) -> None:
        """Start it; it is waited for."""
        with self._log.open("ab") as log:
            command = [self._program, "-c", str(self._config)]
            self._process = subprocess.Popen(command, stdout=log, stderr=log)  # noqa: S603  # our own
        until(self._listens, "the broker listens")

    def _listens(self) -> bool:
        with closing(socket.socket()) as probe:
            return probe.connect_ex(("127.0.0.1", self.port)) == 0

    def kill(self) -> None:
        """End it at once."""
        self._process.kill()
        self._process.wait()

    def pause(self, *, goes_on: bool = False) -> None:
        """Suspend it, or let it go on."""
        self._process.send_signal(signal.SIGCONT if goes_on else signal.SIGSTOP)


class Heard(NamedTuple):
    """A message, as a client of the broker has it."""

    topic: str
    payload: bytes
    retain: bool
    properties: Any

    @property
    def json(self) -> Any:
        """The payload."""
        return json.loads(self.payload)


class Client:
    """An MQTT client of its own, which keeps what it hears."""

    def __init__(self, port: int, *filters: str, v5: bool = True, root: str = ROOT) -> None:
        self.heard: list[Heard] = []
        self.on_heard: Callable[[Heard], object] = lambda _: None
        self.root = root
        self._ready = threading.Event()
        self.answers = f"answers/{uuid4().hex}"
        protocol = paho.MQTTv5 if v5 else paho.MQTTv311
        self._client = paho.Client(CallbackAPIVersion.VERSION2, uuid4().hex, protocol=protocol)
        self._filters = (*filters, self.answers)
        self._client.on_connect = self._subscribe
        self._client.on_subscribe = lambda *_: self._ready.set()
        self._client.on_message = self._hear
        self._client.reconnect_delay_set(1, 1)
        self._client.connect("127.0.0.1", port, keepalive=30)
        self._client.loop_start()
        assert self._ready.wait(PATIENCE_S)

    def _subscribe(self, *_: Any) -> None:
        self._client.subscribe([(it, 1) for it in self._filters])

    def _hear(self, _client: Any, _data: Any, message: paho.MQTTMessage) -> None:
        properties = getattr(message, "properties", None)
        heard = Heard(message.topic, bytes(message.payload), message.retain, properties)
        self.heard.append(heard)
        self.on_heard(heard)

    def close(self) -> None:
        """Leave the broker."""
        self._client.disconnect()
        self._client.loop_stop()

    def of(self, topic: str) -> list[Heard]:
        """Messages that were heard at a topic."""
        return [it for it in list(self.heard) if it.topic == f"{self.root}/{topic}"]

    def last(self, topic: str, which: Callable[[Any], bool] = lambda _content: True) -> Any:
        """Wait until the newest message at a topic is one of these, and give its content."""

        def look() -> Any:
            heard = self.of(topic)
            return heard[-1].json if heard and heard[-1].payload and which(heard[-1].json) else None

        return until(look, f"a message at {topic}")

    def events(self) -> list[Any]:
        """All events that were heard, those that came twice too."""
        return [it.json for it in list(self.heard) if it.topic.startswith(f"{self.root}/events/")]

    def last_event(self, type_: str, correlation: str | None = None) -> Any:
        """Wait for an event of a type, about a move if one is named."""

        def look() -> Any:
            heard = [it for it in self.events() if it["type"] == type_]
            return next((it for it in heard if correlation in (None, it.get("correlationid"))), None)

        return until(look, f"the event {type_}")

    def publish(
        self,
        topic: str,
        content: object = None,
        *,
        retain: bool = False,
        wait: bool = True,
        **told: Any,
    ) -> None:
        """Publish JSON; `told` are properties by their names in MQTT 5."""
        payload = (
            content
            if isinstance(content, bytes)
            else b""
            if content is None
            else json.dumps(content).encode()
        )
        properties = None
        if told:
            properties = Properties(PacketTypes.PUBLISH)  # type: ignore[no-untyped-call]
            for name, value in told.items():
                setattr(properties, name, value)
        sent = self._client.publish(f"{self.root}/{topic}", payload, 1, retain, properties)
        if wait:
            sent.wait_for_publish(PATIENCE_S)

    def command(self, path: str, content: object = None, who: str = MES, **told: Any) -> Any:
        """Give a command, and wait for its answer; a correlation and an expiry stand if nothing is said."""
        correlation = told.setdefault("CorrelationData", uuid4().hex.encode())
        told.setdefault("MessageExpiryInterval", 30)
        before = len(self.heard)
        given = {name: value for name, value in told.items() if value is not None}
        self.publish(f"cmd/{who}{path}", content, ResponseTopic=self.answers, **given)
        return until(lambda: self._answer(correlation, before), f"an answer to {path}")

    def _answer(self, correlation: bytes | None, after: int) -> Any:
        for it in self.heard[after:]:
            its = getattr(it.properties, "CorrelationData", None)
            if it.topic == self.answers and its == correlation:
                return it.json
        return None


def relative(pulses: int = 100) -> dict[str, Any]:
    """A move clockwise."""
    return {"kind": "relative", "direction": "cw", "distance": {"value": pulses, "unit": "pulse"}}


@dataclass
class Plant:
    """A gateway that wants keys, on a simulated line; it keeps its port over restarts."""

    folder: Path
    line: SimulatedLine
    bodies: str = BODIES

    def __post_init__(self) -> None:
        self.data = data_directory(self.folder)
        self.port = free_port()
        self.url = f"http://127.0.0.1:{self.port}"
        self.config = self.folder / "gateway.toml"
        bodies = ", ".join(f'{{ id = "{body}" }}' for body in self.bodies.split(","))
        self.config.write_text(
            f"[server]\nport = {self.port}\n\n[[lines]]\nid = 'line1'\n"
            f"address = '{self.line.address(115_200)}'\nbodies = [{bodies}]\n"
            "reply_timeout_s = 3.0\nlate_reply_s = 0.3\npoll_interval_s = 0.1\n"
        )
        self._keys = KeyStore(self.data)
        self._starts = 0
        self.key_files = {name: self._key(name, role) for name, role in _ROLES.items()}
        self.http = httpx.Client(
            base_url=self.url,
            timeout=PATIENCE_S,
            headers={"Authorization": f"Bearer {self.key_files['admin'].read_text().strip()}"},
        )
        self.start()

    def _key(self, name: str, role: Role) -> Path:
        file = self.folder / f"{name}.key"
        file.write_text(self._keys.create(name, role, None, None) + "\n")
        file.chmod(0o600)
        return file

    def start(self) -> None:
        """Start it, and wait until its line is set up."""
        self._starts += 1
        log = self.folder / f"gateway-{self._starts}.log"
        self.program = Program(log, "serve", "--config", str(self.config), "--data", str(self.data))
        self.program.said("running on")
        until(self._is_ready, "the gateway is ready")

    def _is_ready(self) -> bool:
        return self.http.get("/readyz").is_success

    def end(self) -> None:
        """End it."""
        self.http.close()
        self.program.end()

    def get(self, path: str) -> Any:
        """Read something."""
        return self.http.get(path).raise_for_status().json()

    def moves(self) -> list[Any]:
        """Every time that a motor has really begun to run."""
        return self.line.truth("pulses_start")


_ROLES: Final = {"bridge": Role.VIEWER, MES: Role.OPERATOR, "watcher": Role.VIEWER, "admin": Role.ADMIN}


@dataclass
class Bridge:
    """A bridge in a process of its own; what it keeps stays in its folder."""

    folder: Path
    config: Path
    starts: int = 0

    def start(self) -> "Bridge":
        """Start it, and wait until its metrics are served."""
        self.starts += 1
        data = self.folder / "bridge-data"
        log = self.folder / f"bridge-{self.starts}.log"
        self.program = Program(log, "bridge", "mqtt", "--config", str(self.config), "--data", str(data))
        self.listens_at = self.program.said(r"metrics at (http://\S+)/metrics")[1]
        return self

    def wait_until_online(self) -> "Bridge":
        """Wait until both its sides are connected."""
        until(lambda: httpx.get(f"{self.listens_at}/status").is_success, "the bridge is online")
        return self

    def counted(self, outcome: str) -> float:
        """Number of commands with this outcome."""
        return self.figure(f'commands_total{{outcome="{outcome}"}}')

    def figure(self, name: str) -> float:
        """Read a figure."""
        text = httpx.get(f"{self.listens_at}/metrics").text
        line = next(it for it in text.splitlines() if it.startswith(f"motion_gateway_bridge_{name} "))
        return float(line.split()[-1])


def write_config(folder: Path, plant: Plant, broker: Broker, *more: str, commands: bool = True) -> Path:
    """Write a bridge's file; `more` are further keys of its table for MQTT."""
    config = folder / "bridge.toml"
    callers = "\n".join(
        f"[callers.{name}]\nkey_file = '{plant.key_files[name]}'\n" for name in (MES, "watcher", "admin")
    )
    said = [*more, *(["commands = true"] if commands else [])]
    if not any(it.startswith("url") for it in more):
        said.insert(0, f"url = 'mqtt://127.0.0.1:{broker.port}'")
    keys = "\n".join(said)
    config.write_text(
        f"[gateway]\nurl = '{plant.url}'\nname = 'test'\nkey_file = '{plant.key_files['bridge']}'\n\n"
        f"[bridge]\nlisten = '127.0.0.1:0'\n\n{callers}\n"
        f"[mqtt]\n{keys}\n"
    )
    return config


@contextmanager
def bridging(
    folder: Path, plant: Plant, broker: Broker, *more: str, commands: bool = True
) -> Iterator[Bridge]:
    """Run a bridge, and end it with the block."""
    bridge = Bridge(folder, write_config(folder, plant, broker, *more, commands=commands)).start()
    try:
        yield bridge
    finally:
        bridge.program.end()


@contextmanager
def at(broker: Broker, *filters: str, v5: bool = True) -> Iterator[Client]:
    """Have a client at a broker, which hears everything below the root if no filters are given."""
    client = Client(broker.port, *(filters or (f"{ROOT}/#",)), v5=v5)
    try:
        yield client
    finally:
        client.close()
