"""kill -9 at any moment: nothing without an intent, nothing twice, nothing lost that was acknowledged."""

import sqlite3
import subprocess
import sys
from collections import Counter
from pathlib import Path

import pytest

from gateway.core.journal import files
from tests.e2e.processes import simulated_line
from tests.open_access import OPEN

LIVES = 500
BODIES = "00,01,3F"


@pytest.mark.timeout(1_800)
def test_an_engine_that_is_killed_500_times_does_nothing_twice_and_forgets_nothing(tmp_path: Path) -> None:
    data = tmp_path / "data"
    with simulated_line(tmp_path, BODIES, "--listen", "tcp://127.0.0.1:0") as line:
        tables = ", ".join(f'{{id = "{body}"}}' for body in BODIES.split(","))
        config = tmp_path / "gateway.toml"
        config.write_text(
            f'[[lines]]\nid = "line1"\naddress = "{line.address(0)}"\nbodies = [{tables}]\n'
            f"late_reply_s = 0.02\nreply_timeout_s = 0.1\n{OPEN}",
            "utf-8",
        )
        program = [sys.executable, "-m", "tests.e2e.killed_engine", str(config), str(data), str(LIVES), "1"]
        said = subprocess.run(program, check=True, capture_output=True, text=True, timeout=1_500)  # noqa: S603
        executed = [it.facts["text"] for it in (*line.executed("1+M"), *line.executed("3PS"))]
    assert said.stdout == ""
    assert files.verify(data) == []
    with sqlite3.connect(data / "journal.db") as journal:
        intents = journal.execute("SELECT frame, request_id FROM intents WHERE effect != 'stop'").fetchall()
        moves = dict(journal.execute("SELECT id, final FROM moves").fetchall())
    answered = [words.split(" ") for words in (data / "answered").read_text("utf-8").splitlines()]
    assert len(executed) > LIVES
    assert [text for text, times in Counter(executed).items() if times > 1] == []
    frames = [frame[3:].rstrip("\r") for frame, _ in intents]
    assert set(executed) - set(frames) == set()
    assert [frame for frame, times in Counter(frames).items() if times > 1] == []
    known = {request_id for _, request_id in intents}
    assert [unique for unique, *_ in answered if f"k{unique}" not in known] == []
    begun = {move for _, *ids in answered for move in ids if move}
    assert begun - moves.keys() == set()
    assert [move for move, final in moves.items() if not final] == []
