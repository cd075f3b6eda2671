"""The server's process: what is told before a start that takes long."""

import asyncio
import logging
from pathlib import Path

import pytest

from app import server
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
    config = Config.model_validate(
        {"server": {"port": 0}, "access": {"mode": "open"}, "lines": [{"id": "a", "address": "tcp://h:1"}]}
    )
    with caplog.at_level(logging.INFO), pytest.raises(InterruptedError):
        asyncio.run(server.serve(config, tmp_path))
    assert bool(told) == is_slow
    assert ("no line is opened before" in caplog.text) == is_slow
