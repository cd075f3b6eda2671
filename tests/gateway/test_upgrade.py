"""Journals that gateways of earlier versions have really written: the present one knows all that is in them.

A file of tests/recordings/journals holds rows of a journal as `motion-gateway journal export` writes them. A
record that gains a member without a default, or loses one, would have the whole journal set aside. One that
an earlier gateway could not read has to raise the version of the tables, so that the earlier one says so.
"""

import asyncio
import json
import logging
import sqlite3
from collections.abc import Iterator
from contextlib import closing
from hashlib import sha256
from pathlib import Path
from typing import Any

import pytest
from pydantic import BaseModel

from gateway.config import parse
from gateway.core.alarms import Alarm
from gateway.core.journal.opening import open_journal
from gateway.core.journal.schema import MIGRATIONS, VERSION
from gateway.core.works import DurableJobs
from gateway.families import registered
from gateway.memory import make_sense
from tests.tested_plant import TestedPlant

RECORDED = Path(__file__).parents[1] / "recordings" / "journals"
FIRST = 2
"""The first version of the tables with which a gateway ran."""
CONFIGURATION = """
[access]
mode = "open"

[[lines]]
id = "line1"
address = "tcp://127.0.0.1:1"
bodies = [{ id = "00" }, { id = "01" }, { id = "10" }, { id = "11" }, { id = "12" }, { id = "3F" }]
groups = [{ id = "80", members = ["00", "01"] }]

[[lines]]
id = "cell1"
protocol = "fics"
address = "tcp://127.0.0.1:2"

[lines.robot]
id = "r1"
units = [{ number = 1, axes = ["X", "Y", "Z"] }, { number = 2, axes = ["X", "Y", "Z"] }]

[[scaras]]
id = "wafer"
line = "line1"
group = "8A"
members = ["10", "11", "12"]
arm_um = 215000
finger_um = 330000
pulses_per_turn = [121791.045, 60000.0, 100000.0]
"""
WORDS = ("description", "examples", "title", "$defs", "$ref")
SHAPES = (8, "693378c440ca7bea")
"""The version of the tables, and what the records in them look like."""


def rows_of(version: int) -> list[dict[str, Any]]:
    text = (RECORDED / f"version-{version}.jsonl").read_text("utf-8")
    return [json.loads(line) for line in text.splitlines()]


def bring_back(version: int, directory: Path) -> list[dict[str, Any]]:
    """A journal as a gateway of that time has left it; gives its rows."""
    rows = rows_of(version)
    with closing(sqlite3.connect(directory / "journal.db", isolation_level=None)) as old:
        for script in MIGRATIONS[:version]:
            old.executescript(script)
        old.execute(f"PRAGMA user_version = {version}")
        for row in rows:
            table, *columns = row
            names, marks = ", ".join(columns), ", ".join("?" * len(columns))
            sql = f"INSERT INTO {row[table]} ({names}) VALUES ({marks})"  # noqa: S608  # our own names
            old.execute(sql, [row[name] for name in columns])
    return rows


@pytest.mark.parametrize("version", range(FIRST, VERSION + 1))
def test_all_that_an_earlier_gateway_has_written_is_taken_over(
    version: int, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    rows = bring_back(version, tmp_path)
    with caplog.at_level(logging.WARNING):
        asyncio.run(find_all_of(rows, tmp_path))
    assert "cannot be read" not in caplog.text


async def find_all_of(rows: list[dict[str, Any]], directory: Path) -> None:
    """Start the present gateway on a journal, and look for its rows."""
    opened = open_journal(directory, make_sense)
    assert opened.set_aside is None
    plant = TestedPlant(parse(CONFIGURATION, "test.toml"), journal=opened)
    await plant.start()
    try:
        logs = [log for it in plant.packages.registered for log in it.move_logs()]
        for row in rows:
            if row["table"] == "moves":
                assert any(it.id == row["id"] for log in logs for it in log.of(row["target"]))
            elif row["table"] == "alarms":
                assert plant.alarms.get(row["id"]).cause == row["cause"]
            elif row["table"] == "events":
                assert plant.events.event(row["number"]).json == row["text"]
    finally:
        await plant.close()


def test_a_record_that_has_changed_comes_with_another_version_of_the_tables() -> None:
    found = sha256(json.dumps(shapes(), sort_keys=True).encode()).hexdigest()[:16]
    assert (VERSION, found) == SHAPES, (
        "Records that the journal keeps have changed, and an earlier gateway would take them for damage. "
        "Record a journal of this version, add a step to MIGRATIONS, be it empty, and note the new pair."
    )


def shapes() -> list[Any]:
    """The members of all kinds of records that are kept."""
    kinds: set[type[BaseModel]] = {Alarm}
    kinds |= {kind for it in registered() for kind in it.move_records}
    works = [it for it in below(DurableJobs) if it.__module__.startswith("gateway.")]
    kinds |= {it.record_type for it in works if "record_type" in vars(it)}
    schemas = [kind.model_json_schema() for kind in sorted(kinds, key=lambda kind: kind.__name__)]
    return [without_words(schema, schema.get("$defs", {})) for schema in schemas]


def below(kind: type[Any]) -> Iterator[type[Any]]:
    for it in kind.__subclasses__():
        yield it
        yield from below(it)


def without_words(schema: Any, named: Any) -> Any:
    """The schema of a record without descriptions, marks and names of its parts, which may change."""
    if isinstance(schema, list):
        return [without_words(part, named) for part in schema]
    if not isinstance(schema, dict):
        return schema
    if "$ref" in schema:
        schema = {**named[schema["$ref"].rpartition("/")[2]], **schema}
    left = {name: part for name, part in schema.items() if name not in WORDS and not name.startswith("x-")}
    return {name: without_words(part, named) for name, part in left.items()}
