"""Conditions that the gateway checks before it serves callers."""

import asyncio
import logging
import sys
from pathlib import Path
from typing import Any

import pytest

from app.access import AccessControl
from gateway.access.keys import DAY_S, KeyPolicy, KeyStore
from gateway.access.roles import Role
from gateway.config import Config
from gateway.core.toml_files import ConfigError

LINE = {"id": "line1", "address": "tcp://127.0.0.1:1"}
NETWORK = {"server": {"host": "10.0.0.1", "trusted_proxies": ["10.0.0.2"]}}
OIDC = {"issuer": "https://id.plant", "audience": "motion", "roles": {"mover": "operator"}}


def config(**tables: Any) -> Config:
    return Config.model_validate({"lines": [LINE], **tables})


def test_without_a_key_only_this_machine_is_served(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.WARNING):
        assert AccessControl(config(), tmp_path).credentials is not None
    assert f"motion-gateway keys create NAME --role admin --data {tmp_path}" in caplog.text
    with pytest.raises(ConfigError, match="keys create NAME"):
        AccessControl(config(**NETWORK), tmp_path)
    KeyStore(tmp_path).create("boss", Role.ADMIN)
    AccessControl(config(**NETWORK), tmp_path)


def test_keys_that_cannot_be_read_are_told_before_a_line_is_opened(tmp_path: Path) -> None:
    (tmp_path / "keys.json").write_text("{")
    (tmp_path / "keys.json").chmod(0o600)
    with pytest.raises(ConfigError, match="no file of keys"):
        AccessControl(config(), tmp_path)
    assert AccessControl(config(access={"mode": "open"}), tmp_path).credentials is None


def test_tokens_need_their_library(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "jwt", None)
    monkeypatch.delitem(sys.modules, "gateway.access.oidc", raising=False)
    with pytest.raises(ConfigError, match=r"motion-gateway\[oidc\]"):
        AccessControl(config(access={"oidc": OIDC}), tmp_path)


def test_when_keys_were_used_is_written_down_at_the_end(tmp_path: Path) -> None:
    store = KeyStore(tmp_path)
    token = store.create("mes", Role.VIEWER)
    access = AccessControl(config(), tmp_path)
    assert access.credentials is not None
    assert access.credentials.verify(token) is not None

    async def life() -> None:
        access.start()
        await access.stop()

    asyncio.run(life())
    assert len(store.uses()) == 1


def test_the_end_of_a_key_is_told_once_before_it_and_once_when_it_comes(tmp_path: Path) -> None:
    access = AccessControl(config(access={"key_warning_d": 1}), tmp_path)
    now = [1_000_000.0]
    store = access._store = KeyStore(tmp_path, lambda: now[0])
    store.create("mes", Role.VIEWER, None, 2 * DAY_S)
    store.create("long-over", Role.VIEWER, None, 1.0)
    now[0] += 2
    told: list[tuple[str, str]] = []
    access.on_key = lambda what, key: told.append((what, key.name))
    for after_s, expected in (
        (0, []),
        (DAY_S, [("ends_soon", "mes")]),
        (DAY_S, [("expired", "mes")]),
        (1, []),
    ):
        now[0] += after_s
        for _ in range(3):
            access._tell_changes(store.infos())
        assert told == expected
        told.clear()


def test_what_the_configuration_says_of_keys_holds_for_the_command_line_too(tmp_path: Path) -> None:
    AccessControl(config(access={"key_lifetime_d": 90, "four_eyes": True}), tmp_path)
    assert KeyStore(tmp_path).policy() == KeyPolicy(lifetime_s=90 * DAY_S, four_eyes=True)
    AccessControl(config(access={"key_lifetime_d": 0}), tmp_path)
    assert KeyStore(tmp_path).policy() == KeyPolicy(lifetime_s=None)
