"""kill -9 at any moment: nothing without an intent, nothing twice, nothing lost that was acknowledged."""

import json
import sqlite3
import subprocess
import sys
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

from gateway.core.journal import files
from tests.e2e.processes import SimulatedLine, SimulatedRobot, simulated_line, simulated_robot
from tests.fics_plants import SCARA
from tests.open_access import OPEN

pytestmark = pytest.mark.prove

LIVES = 500
CHAINS = 2
"""Chains of lives, each with a plant of its own, side by side: most of a life is waiting."""
BODIES = "00,01,3F"
IN_MOTION = LIVES // 15
"""Kills that came while a body moved, at the least, and as many while the robot did."""
TIMES = "late_reply_s = 0.02\nreply_timeout_s = 0.1\npoll_interval_s = 0.05"


@pytest.mark.long
@pytest.mark.timeout(1_800)
def test_an_engine_that_is_killed_500_times_does_nothing_twice_and_forgets_nothing(tmp_path: Path) -> None:
    with ThreadPoolExecutor(CHAINS) as threads:
        chains = [threads.submit(_live_and_die, tmp_path / str(seed), seed) for seed in range(CHAINS)]
    adopted = [move for chain in chains for move in chain.result() if _is_adopted(move)]
    families = Counter("robot" if move["body_id"].startswith("r1") else "body" for move in adopted)
    assert min(families["body"], families["robot"]) > IN_MOTION, families


def _live_and_die(folder: Path, seed: int) -> list[Any]:
    """One chain of lives; gives the records of its moves."""
    folder.mkdir()
    data, lives = folder / "data", LIVES // CHAINS
    with (
        simulated_line(folder, BODIES, "--listen", "tcp://127.0.0.1:0") as line,
        simulated_robot(folder) as robot,
    ):
        config = _write_config(folder, line, robot)
        arguments = [str(config), str(data), str(lives), str(seed)]
        program = [sys.executable, "-m", "tests.e2e.killed_engine", *arguments]
        said = subprocess.run(program, check=True, capture_output=True, text=True, timeout=1_500)  # noqa: S603
        of_bodies = [fact.facts["text"] for fact in (*line.executed("1+M"), *line.executed("3PS"))]
        of_robot = [*robot.heard("LMA"), *(text for text in robot.heard("VAR") if "=" in text)]
    assert said.stdout == f"{lives} killed\n", said.stderr
    assert files.verify(data) == []
    assert min(len(of_bodies), len(of_robot)) > lives // 2
    assert _twice([*of_bodies, *of_robot]) == []
    return _check_journal(data, {*of_bodies, *of_robot})


def _check_journal(data: Path, executed: set[str]) -> list[Any]:
    with closing(sqlite3.connect(data / "journal.db")) as journal:
        intents = journal.execute("SELECT frame, request_id, outcome FROM intents").fetchall()
        moves = {move: json.loads(record) for move, record in journal.execute("SELECT id, record FROM moves")}
    answered = [words.split(" ") for words in (data / "answered").read_text("utf-8").splitlines()]
    wanted = [
        (frame[3 if frame.startswith("&") else 0 :].rstrip("\r"), outcome)
        for frame, request_id, outcome in intents
        if (request_id or "").startswith("k") and not frame.startswith("UNT")
    ]
    assert executed - {text for text, _ in wanted} == set()
    assert _twice([text for text, outcome in wanted if outcome != "not_sent"]) == []
    known = {request_id for _, request_id, _ in intents}
    assert [unique for unique, *_ in answered if f"k{unique}" not in known] == []
    begun = {move for _, *ids in answered for move in ids if move}
    assert begun - moves.keys() == set()
    assert [move for move, record in moves.items() if record["ended_at"] is None] == []
    return list(moves.values())


def _write_config(folder: Path, line: SimulatedLine, robot: SimulatedRobot) -> Path:
    config = folder / "gateway.toml"
    tables = ", ".join(f'{{id = "{body}"}}' for body in BODIES.split(","))
    config.write_text(
        f'[[lines]]\nid = "line1"\naddress = "{line.address(0)}"\nbodies = [{tables}]\n{TIMES}\n'
        f'[[lines]]\nid = "cell"\naddress = "{robot.address}"\nprotocol = "fics"\nmode = 3\n{TIMES}\n'
        f'robot = {{id = "r1", units = [{SCARA}]}}\n{OPEN}',
        "utf-8",
    )
    return config


def _twice(texts: list[str]) -> list[str]:
    return [text for text, times in Counter(texts).items() if times > 1]


def _is_adopted(move: Any) -> bool:
    """Say whether the gateway was killed while the move was under way."""
    return any("restarted" in sentence for sentence in move["evidence"])
