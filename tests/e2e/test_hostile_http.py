"""Requests that no honest client sends: all are refused, and not one byte of them reaches the line."""

import json
import os
import resource
import socket
import time
from collections.abc import Iterator
from contextlib import ExitStack, suppress
from pathlib import Path
from urllib.parse import urlsplit

import httpx
import pytest
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from tests.e2e.processes import PATIENCE_S, Gateway, SimulatedLine

HOUSEKEEPING = {"9CD", "6PD", "9VD", "9VS", "EAD"}
"""Commands that the gateway itself sends to its bodies from time to time."""
MOVE = '{"kind":"relative","direction":"cw","distance":{"value":VALUE,"unit":"pulse"}MORE}'


@pytest.fixture(autouse=True)
def nothing_reaches_the_line(line: SimulatedLine) -> Iterator[None]:
    yield
    assert {frame[3:6] for frame in line.requests()} <= HOUSEKEEPING


def say(gateway: Gateway, head: str, content: bytes = b"", host: str | None = None) -> tuple[int, str]:
    """Send a request as it stands, and give the status and the whole of the answer."""
    url = urlsplit(gateway.url)
    lines = [head, f"host: {url.netloc if host is None else host}", "connection: close"]
    if "\r\ncontent-length" not in head and "\r\ntransfer-encoding" not in head:
        lines.append(f"content-length: {len(content)}")
    with socket.create_connection((str(url.hostname), url.port or 0), PATIENCE_S) as connection:
        connection.sendall("\r\n".join([*lines, "", ""]).encode("latin-1") + content)
        answer = b""
        while part := connection.recv(65536):
            answer += part
    text = answer.decode("utf-8", "replace")
    return int(text.split(" ", 2)[1]), text


def post(gateway: Gateway, path: str, content: bytes) -> tuple[int, str]:
    return say(gateway, f"POST {path} HTTP/1.1\r\ncontent-type: application/json", content)


@pytest.mark.parametrize(
    "value", ["true", '"500"', "5.5", "5e-1", "NaN", "1e400", "-Infinity", "null", "[5]"]
)
def test_a_distance_that_is_no_whole_number(value: str, gateway: Gateway) -> None:
    status, text = post(
        gateway, "/bodies/3F/moves", MOVE.replace("VALUE", value).replace("MORE", "").encode()
    )
    assert status == 422, text
    assert "nothing was sent" in text


@pytest.mark.parametrize(
    "content",
    [
        pytest.param(MOVE.replace("VALUE", "500").replace("MORE", ',"kind":"relative"'), id="a key twice"),
        pytest.param(MOVE.replace("VALUE", "500").replace("MORE", ',"speeed":"low"'), id="an unknown key"),
        pytest.param(MOVE.replace("VALUE", "9" * 5000).replace("MORE", ""), id="5000 digits"),
        pytest.param(MOVE.replace("VALUE", "1000000000").replace("MORE", ""), id="a billion"),
        pytest.param("[" * 100_000, id="100,000 brackets"),
        pytest.param('{"kind":' * 5_000 + "1" + "}" * 5_000, id="5,000 objects"),
        pytest.param('{"kind":"\\ud800"}', id="half a surrogate pair"),
        pytest.param('{"kind":"relative\\r&3F1+M500\\r"}', id="a CR in a text"),
        pytest.param("", id="nothing"),
        pytest.param("\x00", id="a NUL"),
        pytest.param("500", id="a number"),
    ],
)
def test_a_move_that_is_none(content: str, gateway: Gateway) -> None:
    status, text = post(gateway, "/bodies/3F/moves", content.encode())
    assert 400 <= status < 500, text
    assert '"moved":"no"' in text


def test_too_many_bytes(gateway: Gateway) -> None:
    head = "POST /bodies/3F/moves HTTP/1.1\r\ncontent-type: application/json"
    # No more is sent than it takes: what a server has not read when it closes makes its answer get lost.
    chunk = b"10001\r\n" + b" " * 0x10001
    for framing, content in (("content-length: 10000000", b""), ("transfer-encoding: chunked", chunk)):
        status, text = say(gateway, f"{head}\r\n{framing}", content)
        assert status == 413, text
        assert "nothing was sent" in text


def test_a_client_that_leaves_in_the_middle(gateway: Gateway) -> None:
    url = urlsplit(gateway.url)
    with socket.create_connection((str(url.hostname), url.port or 0), PATIENCE_S) as connection:
        head = "POST /bodies/3F/moves HTTP/1.1\r\ncontent-type: application/json\r\ncontent-length: 90"
        connection.sendall(f'{head}\r\nhost: {url.netloc}\r\n\r\n{{"kind":'.encode())
        connection.shutdown(socket.SHUT_WR)
        assert connection.recv(65536) == b""


def test_bytes_that_are_no_text(gateway: Gateway) -> None:
    status, _ = post(gateway, "/bodies/3F/moves", b'{"kind":"\xff\xfe"}')
    assert status == 400


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("set-user-comment", {"comment_number": 1, "text": "a\r&3F1+M500"}),
        ("set-user-comment", {"comment_number": 1, "text": "a&3F1+M500"}),
        ("set-user-comment", {"comment_number": 1, "text": "漢字"}),
        ("move-clockwise", {"distance": "500\r"}),
        ("move-clockwise", {"distance": True}),
        ("move-to", {"position": 5.5}),
        ("set-position-entry", {"entry": {"position": "0025"}, "pulses": 1}),
        ("add-program-instruction", {"instruction": "END\r"}),
    ],
)
def test_commands_that_would_become_other_frames(
    name: str, content: dict[str, object], gateway: Gateway
) -> None:
    status, text = post(gateway, f"/bodies/3F/commands/{name}", json.dumps(content).encode())
    assert status == 422, text


@pytest.mark.parametrize(
    "path",
    [
        *("/bodies/3F%0D5IS/moves", "/bodies/3F%0D/stop", "/bodies/7F/moves", "/bodies/80/stop"),
        *("/bodies/+3/moves", "/bodies/%00/moves", "/bodies/３Ｆ/moves", "/bodies/../bodies/3G/moves"),
        *("/bodies/line1.3F.3F/moves", "/bodies/3F/commands/1+M", "/groups/3F/moves"),
        "/bodies/" + "3F" * 5000 + "/moves",
    ],
)
def test_addresses_of_nobody(path: str, gateway: Gateway) -> None:
    content = MOVE.replace("VALUE", "500").replace("MORE", "").encode()
    if path.endswith("stop"):
        content = b""
    status, text = post(gateway, path.encode().decode("latin-1"), content)
    assert 400 <= status < 500, text


def test_an_address_in_percent_signs_is_the_same_address(gateway: Gateway) -> None:
    status, text = say(gateway, "GET /bodies/%33f HTTP/1.1")
    assert status == 200
    assert '"body_id":"line1.3F"' in text


@pytest.mark.parametrize("content_type", ["text/plain", "application/x-www-form-urlencoded", ""])
def test_a_form_of_a_web_page(content_type: str, gateway: Gateway) -> None:
    content = MOVE.replace("VALUE", "500").replace("MORE", "").encode()
    head = "POST /bodies/3F/moves HTTP/1.1" + (f"\r\ncontent-type: {content_type}" if content_type else "")
    status, _ = say(gateway, head, content)
    assert status == 415


def test_plain_text_commands_are_off(gateway: Gateway) -> None:
    status, text = post(gateway, "/bodies/3F/raw", b'{"text":"1+M500"}')
    assert status == 403
    assert "nothing was sent" in text


def test_moves_without_an_end_are_off(gateway: Gateway) -> None:
    status, _ = post(gateway, "/bodies/3F/moves", b'{"kind":"continuous","direction":"cw"}')
    assert status == 403
    status, _ = post(gateway, "/bodies/3F/commands/move-clockwise", b'{"distance":"endless"}')
    assert status == 403


@pytest.mark.parametrize("host", ["evil.example", "127.0.0.1.evil.example", "evil.example:8420", "[::2]", ""])
def test_a_host_that_is_not_this_one(host: str, gateway: Gateway) -> None:
    status, _ = say(gateway, "POST /stop HTTP/1.1", host=host)
    assert 400 <= status < 500


def test_a_page_of_another_origin(gateway: Gateway) -> None:
    for header in ("origin: http://evil.example", "origin: null", "sec-fetch-site: cross-site"):
        status, text = say(gateway, f"POST /stop HTTP/1.1\r\n{header}")
        assert status == 403, text


@pytest.mark.parametrize("origin", ["http://evil.example", "http://127.0.0.1:1", "null", "file://"])
def test_a_websocket_of_another_origin(origin: str, gateway: Gateway) -> None:
    with (
        pytest.raises(InvalidStatus) as refused,
        connect(gateway.websocket, additional_headers={"Origin": origin}),
    ):
        raise AssertionError("It was let in.")
    assert refused.value.response.status_code == 403


def test_a_head_that_grows_without_end(gateway: Gateway) -> None:
    url = urlsplit(gateway.url)
    with socket.create_connection((str(url.hostname), url.port or 0), PATIENCE_S) as connection:
        connection.sendall(b"GET /livez HTTP/1.1\r\nhost: evil.example\r\nx: ")
        sent = 0
        with suppress(ConnectionError):
            while sent < 20_000_000:
                sent += connection.send(b"y" * 65_536)
        assert sent < 20_000_000
        assert gateway.http.get("/livez").elapsed.total_seconds() < 10


@pytest.mark.parametrize(
    "head",
    [
        "POST http://127.0.0.1/stop HTTP/1.1",
        "POST /stop HTTP/1.1\r\nhost: 127.0.0.1",
        "POST /stop HTTP/1.1\r\nx: " + "y" * 16_384,
    ],
)
def test_a_head_that_is_none(head: str, gateway: Gateway) -> None:
    status, text = say(gateway, head)
    assert status in (400, 431)
    assert "Nothing was sent." in text
    assert "x-content-type-options: nosniff" in text


def test_a_gateway_without_file_descriptors_goes_on(gateway: Gateway) -> None:
    """New connections end at once, those that are open are served, and it does not spin."""
    pid = gateway.program.pid
    soft, hard = resource.prlimit(pid, resource.RLIMIT_NOFILE)
    gateway.http.get("/livez")
    url = urlsplit(gateway.url)
    address = (str(url.hostname), url.port or 0)
    in_use = len(list(Path(f"/proc/{pid}/fd").iterdir()))
    try:
        resource.prlimit(pid, resource.RLIMIT_NOFILE, (in_use, hard))
        with ExitStack() as stack:
            for _ in range(20):
                stack.enter_context(socket.create_connection(address, PATIENCE_S))
            worked_s, begun_at = cpu_s(pid), time.monotonic()
            for _ in range(10):
                assert gateway.http.get("/bodies/3F/position").status_code == 200
                time.sleep(0.05)
            assert cpu_s(pid) - worked_s < (time.monotonic() - begun_at) / 2
    finally:
        resource.prlimit(pid, resource.RLIMIT_NOFILE, (soft, hard))
    assert httpx.get(f"{gateway.url}/readyz").status_code == 200


def cpu_s(pid: int) -> float:
    """Processor time a program has used."""
    user, system = Path(f"/proc/{pid}/stat").read_text("utf-8").rpartition(")")[2].split()[11:13]
    return (int(user) + int(system)) / os.sysconf("SC_CLK_TCK")


def test_no_answer_was_a_fault_of_the_gateway(gateway: Gateway) -> None:
    """After all other tests of the file the gateway lives and is ready, and its log has no traceback."""
    assert gateway.http.get("/readyz").status_code == 200
    assert "Traceback" not in gateway.program.words()
