"""The copy of the security log: every entry over TLS, in order, and none waited for."""

import socket
import ssl
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from queue import Empty, Queue

import pytest

from gateway.security import syslog as syslog_module
from gateway.security.chain import Chain, draft
from gateway.security.syslog import SyslogSender
from tests.certificates import write_certificate


class Server:
    """A syslog server on a port of its own, which takes one connection after the other."""

    def __init__(self, folder: Path) -> None:
        self.certificate, key = write_certificate(folder, "logs")
        self._context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
        self._context.load_cert_chain(self.certificate, key)
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.address = f"127.0.0.1:{self.listener.getsockname()[1]}"
        self.messages: Queue[str] = Queue()
        self.hang_up_after = 1000
        self._thread = threading.Thread(target=self._serve)
        self._thread.start()

    def close(self) -> None:
        self.listener.shutdown(socket.SHUT_RDWR)
        self.listener.close()
        self._thread.join()

    def _serve(self) -> None:
        while True:
            try:
                connection, _ = self.listener.accept()
            except OSError:
                return
            with connection:
                try:
                    with self._context.wrap_socket(connection, server_side=True) as tls:
                        self._read(tls)
                except OSError:
                    continue

    def _read(self, tls: ssl.SSLSocket) -> None:
        with tls.makefile("rb") as file:
            for _ in range(self.hang_up_after):
                length = b""
                while (char := file.read(1)) not in (b" ", b""):
                    length += char
                if not length:
                    return
                self.messages.put(file.read(int(length)).decode())


@contextmanager
def sending(server: Server, ca: Path | None = None) -> Iterator[SyslogSender]:
    it = SyslogSender(server.address, ca=ca or server.certificate)
    it.start()
    try:
        yield it
    finally:
        it.close()


@pytest.fixture
def server(tmp_path: Path) -> Iterator[Server]:
    it = Server(tmp_path)
    yield it
    it.close()


def lines(folder: Path, count: int) -> list[str]:
    return Chain(folder).append([draft("key.made", f"key{number}") for number in range(count)])


def test_each_entry_is_a_message_as_it_stands_in_the_file(server: Server, tmp_path: Path) -> None:
    with sending(server) as it:
        given = lines(tmp_path, 3)
        it.send(given)
        got = [server.messages.get(timeout=10) for _ in given]
    for line, message in zip(given, got, strict=True):
        head, _, entry = message.partition(" - ")
        priority, _at, _host, name, _process, type_ = head.split(" ")
        assert (priority, name, type_, entry) == ("<109>1", "motion-gateway", "key.made", line.rstrip())


def test_a_server_that_hangs_up_is_called_again(
    server: Server, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(syslog_module, "AGAIN_S", (0.01, 0.02))
    server.hang_up_after = 1
    given = lines(tmp_path, 300)
    seen: list[str] = []
    with sending(server) as it:
        for line in given:
            it.send([line])
            with suppress(Empty):  # it went to the connection that was just hung up
                seen.append(server.messages.get(timeout=0.2).partition(" - ")[2])
            if len(seen) == 3:
                break
    assert len(seen) == 3
    assert set(seen) <= {line.rstrip() for line in given}


def test_what_is_too_much_is_lost_and_counted_and_nothing_waits(
    server: Server, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(syslog_module, "MOST_WAITING", 10)
    it = SyslogSender(server.address, ca=server.certificate)
    lost: Queue[int] = Queue()
    it.on_lost = lost.put
    it.send(lines(tmp_path, 25))
    it.start()
    assert lost.get(timeout=10) == 15
    assert "key15" in server.messages.get(timeout=10)
    it.close()


def test_a_server_with_another_certificate_gets_nothing(server: Server, tmp_path: Path) -> None:
    (tmp_path / "other").mkdir()
    other, _ = write_certificate(tmp_path / "other", "other")
    with sending(server, ca=other) as it:
        it.send(lines(tmp_path, 1))
    assert server.messages.empty()
