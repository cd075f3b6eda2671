"""Starting the gateway from the command line."""

import gc
import re
import sqlite3
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest
from typer.testing import CliRunner

from app.cli import app
from app.demo import welcome
from gateway.core.journal.disk import FILE, SqliteDisk
from gateway.core.journal.schema import VERSION

DOCS = Path(__file__).parents[3] / "docs"


@pytest.fixture(autouse=True)
def garbage() -> Iterator[None]:
    """A server that starts collects none until it runs."""
    yield
    gc.enable()


def test_the_demo_says_in_five_lines_what_to_do_next() -> None:
    url = "http://127.0.0.1:8420"
    lines = welcome(url, "motion-gateway").strip().splitlines()
    assert [line.split()[0] for line in lines] == ["1", "2", "3", "4", "5"]
    pages = [page for line in lines for page in re.findall(rf"{url}/manual/(\w+)\.html", line)]
    assert pages
    assert all((DOCS / f"{page}.md").is_file() for page in pages)
    assert "--url" not in lines[1]
    assert lines[1] + " --url http://127.0.0.1:9" in welcome("http://127.0.0.1:9", "motion-gateway")


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
