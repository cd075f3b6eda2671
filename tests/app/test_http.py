"""Requests and streams over real sockets: what was never sent, and what may have been."""

import re
import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import pytest

from app import http

SLOW_S = 0.2
PATIENCE_S = 20.0
ASK: dict[str, Any] = {"headers": {"X-Request-Id": "1"}, "timeout": PATIENCE_S, "trust_env": False}


@contextmanager
def serving(*pieces: bytes, hear: Callable[[bytes], object] = lambda _heard: None) -> Iterator[str]:
    """A server that hears one request, says these pieces and hangs up."""

    def serve() -> None:
        client, _ = listener.accept()
        with client, client.makefile("rb") as reading:
            heard = b"".join(iter(reading.readline, b"\r\n"))
            length = re.search(rb"Content-Length: (\d+)", heard)
            hear(heard + reading.read(int(length[1]) if length else 0))
            for piece in pieces:
                client.sendall(piece)

    with socket.create_server(("127.0.0.1", 0)) as listener:
        thread = threading.Thread(target=serve, daemon=True)
        thread.start()
        yield f"http://127.0.0.1:{listener.getsockname()[1]}"
        thread.join(PATIENCE_S)


def head(length: int, status: str = "200 OK") -> bytes:
    return f"HTTP/1.1 {status}\r\nContent-Length: {length}\r\n\r\n".encode()


def test_an_answer_has_its_status_and_its_content() -> None:
    heard: list[bytes] = []
    with serving(head(10, "202 Accepted") + '{"a":"é"}'.encode(), hear=heard.append) as url:
        answer = http.request("POST", f"{url}/groups/a b?wait=1", json={"b": 1}, **ASK)
    assert (answer.status_code, answer.is_success, answer.json()) == (202, True, {"a": "é"})
    assert heard[0].startswith(b"POST /groups/a%20b?wait=1 HTTP/1.1\r\n")
    assert b"Content-Type: application/json" in heard[0]
    assert heard[0].endswith(b'{"b": 1}')


def test_what_nobody_hears_was_never_sent() -> None:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        port = listener.getsockname()[1]
    with pytest.raises(http.NotReached, match="refused"):
        http.request("POST", f"http://127.0.0.1:{port}/stop", json=None, **ASK)


@pytest.mark.parametrize("url", ["ftp://127.0.0.1", "http://", "127.0.0.1:8420", "http://[::1", "http://h:x"])
def test_what_is_no_address_is_not_reached(url: str) -> None:
    with pytest.raises(http.NotReached):
        http.request("GET", url, json=None, **ASK)


@pytest.mark.parametrize("said", [b"", head(99) + b"cut off", b"what is this\r\n\r\n"])
def test_an_answer_that_does_not_come_whole_is_lost(said: bytes) -> None:
    with serving(said) as url, pytest.raises(http.AnswerLost):
        http.request("POST", f"{url}/stop", json=None, **ASK)


def test_an_answer_that_does_not_come_in_time_is_lost() -> None:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        url = f"http://127.0.0.1:{listener.getsockname()[1]}"
        with pytest.raises(http.AnswerLost):
            http.request("POST", url, json=None, **{**ASK, "timeout": SLOW_S})


def test_a_stream_is_read_as_it_comes_and_its_end_is_no_fault() -> None:
    begin = b"HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n"
    chunks = [b"2\r\n\xc3\xa9\r\n", b"1\r\n\xe3\r\n", b"2\r\n\x81\x82\r\n", b"0\r\n\r\n"]
    with (
        serving(begin, *chunks) as url,
        http.stream("GET", f"{url}/events", params={"types": "body.*"}, **ASK) as answer,
    ):
        assert "".join(answer.iter_text()) == "éあ"


def test_a_stream_that_falls_silent_is_lost() -> None:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        url = f"http://127.0.0.1:{listener.getsockname()[1]}"
        client: list[socket.socket] = []

        def serve() -> None:
            accepted, _ = listener.accept()
            client.append(accepted)
            accepted.sendall(b"HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n2\r\nab\r\n")

        thread = threading.Thread(target=serve, daemon=True)
        thread.start()
        with http.stream("GET", url, silence=SLOW_S, **ASK) as answer:
            texts = answer.iter_text()
            assert next(texts) == "ab"
            with pytest.raises(http.AnswerLost):
                next(texts)
        thread.join(PATIENCE_S)
        client[0].close()


def test_what_leaves_by_a_proxy_is_tunnelled(monkeypatch: pytest.MonkeyPatch) -> None:
    heard: list[bytes] = []
    with serving(b"HTTP/1.1 403 No\r\n\r\n", hear=heard.append) as url:
        monkeypatch.setenv("https_proxy", url.replace("//", "//me:secret@"))
        for name in ("no_proxy", "NO_PROXY"):
            monkeypatch.delenv(name, raising=False)
        with pytest.raises(http.NotReached, match="403"):
            http.request("GET", "https://gateway.example/stop", json=None, **{**ASK, "trust_env": True})
    assert heard[0].startswith(b"CONNECT gateway.example:443 HTTP/1.")
    assert b"Proxy-Authorization: Basic bWU6c2VjcmV0" in heard[0]
