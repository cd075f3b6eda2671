"""What has to be there before the gateway lets anybody in."""

import asyncio
import logging
import sys
from pathlib import Path
from typing import Any

import pytest

from app.access import AccessControl
from gateway.access.keys import KeyStore
from gateway.access.roles import Role
from gateway.config import Config, ConfigError

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
