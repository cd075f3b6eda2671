"""Starting the gateway from the command line."""

import gc
import sqlite3
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest
from typer.testing import CliRunner

from app.cli import app
from gateway.core.journal.disk import FILE, SqliteDisk
from gateway.core.journal.schema import VERSION


@pytest.fixture(autouse=True)
def garbage() -> Iterator[None]:
    """A server that starts collects none until it runs."""
    yield
    gc.enable()


def test_on_the_data_of_a_later_version_it_changes_nothing_and_says_what_to_do(tmp_path: Path) -> None:
    SqliteDisk(tmp_path).close()
    with closing(sqlite3.connect(tmp_path / FILE)) as later:
        later.execute(f"PRAGMA user_version = {VERSION + 1}")
    before = (tmp_path / FILE).read_bytes()
    config = tmp_path / "gateway.toml"
    config.write_text(
        "server = {port = 0}\naccess = {mode = 'open'}\nlines = [{id = 'a', address = 'tcp://127.0.0.1:1'}]\n"
    )
    said = CliRunner().invoke(app, ["serve", "--config", str(config), "--data", str(tmp_path)])
    assert said.exit_code == 3
    assert "of a later version" in said.stderr
    assert "nothing was changed. Start the later version, or bring back the copy" in said.stderr
    assert (tmp_path / FILE).read_bytes() == before
