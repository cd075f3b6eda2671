"""A guarded gateway as it is run: keys made beside it, TLS, a renewed certificate, and what it refuses."""

import os
import socket
import ssl
import subprocess
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import httpx
import pytest
from websockets.exceptions import ConnectionClosedError
from websockets.sync.client import connect

from tests.certificates import write_certificate
from tests.e2e.processes import (
    MOTION_GATEWAY,
    PATIENCE_S,
    Program,
    SimulatedLine,
    simulated_line,
    until,
    write_config,
)
from tests.open_access import OPEN

pytestmark = pytest.mark.prove


def run(*words: str | Path, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(  # noqa: S603
        [MOTION_GATEWAY, *words],
        env={**os.environ, "NO_COLOR": "1", "COLUMNS": "200", **environment},
        capture_output=True,
        text=True,
        check=False,
        timeout=PATIENCE_S,
    )


@dataclass
class Guarded:
    url: str
    data: Path
    folder: Path

    def key(self, name: str, role: str, *words: str) -> str:
        made = run("keys", "create", name, "--role", role, *words, "--data", self.data)
        assert made.returncode == 0, made.stderr
        return made.stdout.strip()

    def trusting(self) -> ssl.SSLContext:
        return ssl.create_default_context(cafile=self.folder / "tls.crt")

    def client(self, key: str = "") -> httpx.Client:
        headers = {"authorization": f"Bearer {key}"} if key else {}
        return httpx.Client(base_url=self.url, headers=headers, verify=self.trusting(), timeout=PATIENCE_S)


@pytest.fixture(scope="module")
def line(tmp_path_factory: pytest.TempPathFactory) -> Iterator[SimulatedLine]:
    with simulated_line(tmp_path_factory.mktemp("guarded-line")) as line:
        yield line


@pytest.fixture(scope="module")
def guarded(line: SimulatedLine, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Guarded]:
    folder = tmp_path_factory.mktemp("guarded")
    certificate, key = write_certificate(folder, "first")
    config = write_config(line, "guarded")
    (folder / "ca").mkdir()
    authority, _ = write_certificate(folder / "ca", "authority")
    tls = f'[server]\ntls_certificate = "{certificate}"\ntls_key = "{key}"\ntls_client_ca = "{authority}"'
    config.write_text(config.read_text().replace(OPEN, "").replace("[server]", tls))
    log = folder / "gateway.log"
    program = Program(log, "serve", "--config", str(config), "--data", str(folder / "data"))
    url = program.said(r"running on (https://[0-9.]+:\d+)")[1]
    assert "There is no key yet" in program.words()
    yield Guarded(url, folder / "data", folder)
    assert program.end() == 0
    assert "Traceback" not in program.words()


def test_a_key_made_beside_the_gateway_is_good_at_once_until_it_is_revoked(guarded: Guarded) -> None:
    with guarded.client() as nobody:
        until(lambda: nobody.get("/readyz").is_success, "the gateway is ready")
        assert nobody.get("/bodies").status_code == 401
        assert nobody.post("/stop").status_code == 401
    with guarded.client(guarded.key("mes", "viewer")) as viewer:
        assert viewer.get("/bodies").status_code == 200
        assert viewer.post("/bodies/3F/moves", content=b"{").status_code == 403
        assert viewer.post("/stop").json()["confirmed"]
        assert run("keys", "revoke", "mes", "--data", guarded.data).returncode == 0
        assert viewer.get("/bodies").status_code == 401


def test_a_motor_moves_and_its_events_come_over_tls(guarded: Guarded) -> None:
    key = guarded.key("cell", "operator", "--scope", "line1", "--expires", "1h")
    headers = {"Authorization": f"Bearer {key}"}
    events = guarded.url.replace("https", "wss") + "/events?bodies=3F"
    with (
        guarded.client(key) as client,
        connect(events, additional_headers=headers, ssl=guarded.trusting()) as stream,
    ):
        move = {"kind": "relative", "direction": "cw", "distance": {"value": 50, "unit": "pulse"}}
        answer = client.post("/bodies/3F/moves?wait=10", json=move)
        assert answer.json()["status"] == "succeeded", answer.text
        assert "body.move" in str(stream.recv(PATIENCE_S))
    read = run(
        *("send", "3F", "6PD", "--url", guarded.url),
        MOTION_GATEWAY_KEY=key,
        SSL_CERT_FILE=str(guarded.folder / "tls.crt"),
    )
    assert (read.returncode, "pulses" in read.stdout) == (0, True), read.stderr


def certified(guarded: Guarded, name: str, ca: Path) -> ssl.SSLContext:
    """Show a certificate that an authority has signed."""
    context = guarded.trusting()
    context.load_cert_chain(*write_certificate(guarded.folder, name, (ca / "tls.crt", ca / "tls.key"), name))
    return context


def test_a_certificate_acts_with_the_key_that_it_names_until_that_ends(guarded: Guarded) -> None:
    guarded.key("robotics", "operator", "--scope", "line1")
    viewer = guarded.key("panel", "viewer")
    context = certified(guarded, "robotics", guarded.folder / "ca")
    with httpx.Client(base_url=guarded.url, verify=context, timeout=PATIENCE_S) as client:
        identity = client.get("/system/identity").json()
        assert (identity["name"], identity["role"], identity["scope"]) == ("robotics", "operator", ["line1"])
        move = {"kind": "relative", "direction": "cw", "distance": {"value": 5, "unit": "pulse"}}
        assert client.post("/bodies/3F/moves?wait=10", json=move).json()["status"] == "succeeded"
        other_page = {"origin": "https://elsewhere.example", "sec-fetch-site": "cross-site"}
        assert client.post("/bodies/3F/moves", json=move, headers=other_page).status_code == 403
        panel = {"authorization": f"Bearer {viewer}"}
        assert client.get("/system/identity", headers=panel).json()["name"] == "panel"
        with connect(guarded.url.replace("https", "wss") + "/events?bodies=3F", ssl=context) as stream:
            assert client.post("/stop").json()["confirmed"]
            assert "stop" in str(stream.recv(PATIENCE_S))
            assert run("keys", "revoke", "robotics", "--data", guarded.data).returncode == 0
            assert client.get("/bodies").status_code == 401
            with pytest.raises(ConnectionClosedError, match="the key or the session has ended"):
                list(stream)


def test_a_certificate_that_names_no_key_or_is_signed_by_others_opens_nothing(guarded: Guarded) -> None:
    stranger = certified(guarded, "stranger", guarded.folder / "ca")
    with httpx.Client(base_url=guarded.url, verify=stranger, timeout=PATIENCE_S) as client:
        assert client.get("/bodies").status_code == 401
        assert client.post("/stop").status_code == 401
    (guarded.folder / "others").mkdir()
    write_certificate(guarded.folder / "others", "others")
    forged = certified(guarded, "cell", guarded.folder / "others")
    with (
        httpx.Client(base_url=guarded.url, verify=forged, timeout=PATIENCE_S) as client,
        pytest.raises(httpx.TransportError),
    ):
        client.get("/bodies")


def test_a_request_that_ends_its_connection_is_answered_over_tls(guarded: Guarded) -> None:
    with guarded.client() as client:
        assert client.get("/bodies", headers={"x": "y" * 20_000}).status_code == 431
        assert client.get("/livez").status_code == 200


def test_a_handshake_that_does_not_come_loses_its_place(guarded: Guarded) -> None:
    host, port = guarded.url.removeprefix("https://").split(":")
    with socket.create_connection((host, int(port)), PATIENCE_S) as silent:
        with guarded.client() as client:
            assert client.get("/livez").status_code == 200
        assert silent.recv(1) == b""


def test_a_renewed_certificate_is_shown_without_a_restart(guarded: Guarded) -> None:
    old = guarded.trusting()
    write_certificate(guarded.folder, "second")

    def renewed() -> bool:
        try:
            with guarded.client() as client:
                return client.get("/livez").status_code == 200
        except httpx.ConnectError:
            return False

    until(renewed, "the new certificate is shown")
    with pytest.raises(httpx.ConnectError):
        httpx.get(f"{guarded.url}/livez", verify=old)


@pytest.mark.parametrize(
    ("server", "access", "sentence"),
    [
        ('host = "0.0.0.0"', "keys", "set tls_certificate and tls_key, or trusted_proxies"),
        ('host = "0.0.0.0"\ntrusted_proxies = ["10.0.0.2"]', "keys", "keys create NAME --role admin --data"),
        ('host = "0.0.0.0"\ntrusted_proxies = ["10.0.0.2"]', "open", "access.mode: open is only for"),
        ('tls_certificate = "/nowhere"\ntls_key = "/nowhere"', "keys", "cannot be used: No such file"),
        ('tls_client_ca = "/nowhere"', "keys", "server.tls_client_ca: takes tls_certificate and tls_key"),
        ("tls_client_required = true", "keys", "server.tls_client_required: takes tls_client_ca"),
        ('tls_key = "/nowhere"', "keys", "server.tls_certificate: is required with tls_key"),
    ],
)
def test_a_gateway_that_anybody_could_use_does_not_start(
    server: str, access: str, sentence: str, line: SimulatedLine, tmp_path: Path
) -> None:
    config = write_config(line, "refused")
    text = config.read_text().replace("[server]", f"[server]\n{server}").replace('"open"', f'"{access}"')
    config.write_text(text)
    said = run("serve", "--config", config, "--data", tmp_path / "data")
    assert said.returncode == 78
    assert sentence in said.stderr
