"""Servers and streams that must not be used, as `check` and both starts refuse them."""

import asyncio
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner, Result

from app.cli import app
from fleet.engine import Unfit, fault_of_stream, stream_settings
from fleet.fitness import faults_of
from gateway.membership import Engine as EngineTable
from tests.fleet.plants import Engine, needs_engine

GATEWAY = """
[plant]
name = "stocker1"
servers = ["{url}"]
monitor = ["{monitor}"]
[[lines]]
id = "line1"
address = "serial:///dev/ttyUSB0"
bodies = [{{ id = "3F" }}]
"""
PLANT = '[plant]\nservers = ["{url}"]\nmonitor = ["{monitor}"]\n'


def checked(folder: Path, text: str, engine: Engine, *words: str) -> Result:
    file = folder / "x.toml"
    file.write_text(text.format(url=engine.url, monitor=engine.monitor))
    return CliRunner().invoke(app, [*(words or ("check",)), str(file)])


@pytest.fixture
def unsynced(tmp_path: Path) -> Iterator[Engine]:
    engine = Engine(tmp_path / "engine", sync='"2m"')
    yield engine
    engine.kill()


@pytest.fixture
def synced(tmp_path: Path) -> Iterator[Engine]:
    engine = Engine(tmp_path / "engine")
    yield engine
    engine.kill()


@needs_engine
@pytest.mark.parametrize("text", [GATEWAY, PLANT])
def test_a_server_that_does_not_sync_each_message_is_refused(
    tmp_path: Path, unsynced: Engine, text: str
) -> None:
    said = checked(tmp_path, text, unsynced)
    assert said.exit_code == 78
    assert "sync_interval is 120 s, not always" in said.output
    assert "http" not in said.output.replace(unsynced.monitor, "")


@needs_engine
def test_the_plant_process_does_not_start_on_it(tmp_path: Path, unsynced: Engine) -> None:
    said = checked(tmp_path, f"[server]\nport = 0\n{PLANT}", unsynced, "plant", "--config")
    assert (said.exit_code, "sync_interval" in said.output) == (78, True)


@needs_engine
@pytest.mark.parametrize("text", [GATEWAY, PLANT])
def test_a_server_that_does_is_taken(tmp_path: Path, synced: Engine, text: str) -> None:
    said = checked(tmp_path, text, synced)
    assert said.exit_code == 0, said.output
    assert "sync_interval" not in said.output


@needs_engine
def test_a_server_that_tells_nothing_is_warned_of(tmp_path: Path, synced: Engine) -> None:
    said = checked(tmp_path, PLANT.replace("{monitor}", "http://127.0.0.1:1"), synced)
    assert said.exit_code == 0
    assert "nobody can see at http://127.0.0.1:1 whether sync_interval is always" in said.output


@pytest.mark.parametrize(
    ("other", "said"),
    [
        ({"num_replicas": 2}, "two replicas"),
        ({"allow_atomic": False}, "allow_atomic"),
        ({"num_replicas": 3}, None),
    ],
)
def test_a_stream_with_two_replicas_or_of_somebody_else_is_refused(other: Any, said: str | None) -> None:
    fault = fault_of_stream({**stream_settings(1), **other})
    assert fault is None if said is None else said in (fault or "")


def test_servers_that_are_away_have_no_faults() -> None:
    assert (
        list(faults_of(EngineTable(servers=("nats://127.0.0.1:1",), monitor=("http://127.0.0.1:1",)))) == []
    )


@needs_engine
def test_a_stream_that_was_made_by_somebody_else_is_refused_before_it_is_used(
    tmp_path: Path, synced: Engine
) -> None:
    import nats

    async def make() -> None:
        client = await nats.connect(synced.url)
        await client.jetstream().add_stream(name="PLANT", subjects=["mg.*.ev"])
        await client.close()

    asyncio.run(make())
    said = checked(tmp_path, PLANT, synced)
    assert (said.exit_code, "allow_atomic" in said.output) == (78, True)
    assert issubclass(Unfit, Exception)
