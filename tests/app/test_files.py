"""Files that others could change: said by `check`, and links in the data directory refused."""

import os
from pathlib import Path

import pytest
from typer.testing import CliRunner

from app.cli import app
from app.data_directory import require_no_links
from gateway.access.keys import KeyFault, KeyStore
from gateway.access.roles import Role
from gateway.core.toml_files import ConfigError

CONFIG = """
[server]
tls_certificate = "{0}/tls.crt"
tls_key = "{0}/tls.key"
[[lines]]
id = "a"
address = "tcp://127.0.0.1:1"
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A configuration as it should lie there."""
    place = tmp_path / "etc"
    place.mkdir(mode=0o755)
    for name, mode in (("gateway.toml", 0o644), ("tls.crt", 0o644), ("tls.key", 0o640)):
        (place / name).write_text(CONFIG.format(place))
        (place / name).chmod(mode)
    return place


def warnings(folder: Path) -> str:
    said = CliRunner().invoke(app, ["check", str(folder / "gateway.toml")])
    assert said.exit_code == 0, said.stderr
    return said.stderr


def test_files_as_they_should_be_need_no_word(folder: Path) -> None:
    assert warnings(folder) == ""


@pytest.mark.parametrize(
    ("name", "mode", "said"),
    [
        ("gateway.toml", 0o646, "everybody on this machine may change {}/gateway.toml"),
        ("gateway.toml", 0o664, "may change {}/gateway.toml: chmod g-w it"),
        ("tls.crt", 0o646, "everybody on this machine may change {}/tls.crt"),
        ("tls.key", 0o644, "everybody on this machine may read the key {}/tls.key"),
        (".", 0o777, "everybody on this machine may change {}: chmod o-w it"),
    ],
)
def test_check_warns_of_modes(folder: Path, name: str, mode: int, said: str) -> None:
    (folder / name).chmod(mode)
    assert said.format(folder) in warnings(folder)


def test_check_warns_of_owners(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = folder / "gateway.toml"
    stranger = 4711
    if os.geteuid() == 0:
        os.chown(file, stranger, -1)
    else:
        stranger = os.geteuid()
        monkeypatch.setattr("app.data_directory.os.geteuid", lambda: 4712)
    assert f"{file} belongs to user {stranger}, who may change it: chown it to root" in warnings(folder)


@pytest.mark.parametrize("name", ["keys.json", "journal.db", "anything"])
def test_a_link_in_the_data_directory_is_refused(tmp_path: Path, name: str) -> None:
    data = tmp_path / "data"
    data.mkdir(mode=0o700)
    (tmp_path / "itself").symlink_to(data)
    require_no_links(tmp_path / "itself")
    require_no_links(tmp_path / "nowhere")
    (data / name).symlink_to(tmp_path / "elsewhere")
    with pytest.raises(ConfigError, match="is a symbolic link"):
        require_no_links(data)
    config = tmp_path / "open.toml"
    config.write_text("access = {mode = 'open'}\nlines = [{id = 'a', address = 'tcp://127.0.0.1:1'}]\n")
    said = CliRunner().invoke(app, ["serve", "--config", str(config), "--data", str(data), "--port", "0"])
    assert (said.exit_code, "is a symbolic link" in said.stderr) == (78, True)
    assert not (tmp_path / "elsewhere").exists()


def test_keys_are_not_read_through_a_link(tmp_path: Path) -> None:
    KeyStore(tmp_path / "real").create("mes", Role.ADMIN)
    data = tmp_path / "data"
    data.mkdir(mode=0o700)
    (data / "keys.json").symlink_to(tmp_path / "real" / "keys.json")
    with pytest.raises(KeyFault, match="symbolic link"):
        KeyStore(data).all()
