"""The server's process: what is told before a start that takes long."""

import asyncio
import logging
import socket
from pathlib import Path

import pytest

from app import server
from app.server import CannotListen
from gateway.config import Config
from gateway.core.journal import opening
from gateway.core.journal.disk import SqliteDisk


@pytest.mark.parametrize("is_slow", [False, True])
def test_a_journal_that_takes_long_is_told_before_it_is_looked_over(
    is_slow: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    SqliteDisk(tmp_path).close()
    told: list[float] = []

    def opened(*_: object) -> None:
        raise InterruptedError

    monkeypatch.setattr(server, "open_journal", opened)
    monkeypatch.setattr(server, "expect_long_start", lambda longest_s, _why: told.append(longest_s))
    if is_slow:
        monkeypatch.setattr(opening, "SLOW_BYTES_PER_S", 100.0)
    with caplog.at_level(logging.INFO), pytest.raises(InterruptedError):
        asyncio.run(server.serve(config_at(0), tmp_path))
    assert bool(told) == is_slow
    assert ("no line is opened before" in caplog.text) == is_slow


@pytest.mark.parametrize("host", ["127.0.0.1", "::1"])
def test_nobody_waits_unheard_while_the_journal_is_looked_over(
    host: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with socket.socket(socket.AF_INET6 if ":" in host else socket.AF_INET) as free:
        free.bind((host, 0))
        port = free.getsockname()[1]

    def opened(*_: object) -> None:
        with pytest.raises(ConnectionRefusedError):
            socket.create_connection((host, port))
        raise InterruptedError

    monkeypatch.setattr(server, "open_journal", opened)
    with pytest.raises(InterruptedError):
        asyncio.run(server.serve(config_at(port, host), tmp_path))


def test_a_port_that_another_takes_before_it_is_listened_on_is_told() -> None:
    with server.bound(config_at(0).server) as listener, socket.socket() as other:
        other.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        other.bind(listener.getsockname())
        other.listen()
        with pytest.raises(CannotListen, match=r"Address already in use. No line was opened\."):
            server.listen(listener, config_at(0).server)


def config_at(port: int, host: str = "127.0.0.1") -> Config:
    return Config.model_validate(
        {
            "server": {"host": host, "port": port},
            "access": {"mode": "open"},
            "lines": [{"id": "a", "address": "tcp://h:1"}],
        }
    )
