"""A stranger's client, generated from an OpenAPI file with nothing added, drives the running gateway."""

import os
import subprocess
import sys
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import Any, Final

import pytest

from tests.e2e.processes import PATIENCE_S, Gateway

pytestmark = pytest.mark.prove

OPENAPI: Final = Path(__file__).parents[2] / "openapi"
MOST_FILES: Final = 150
MOST_CPU_S: Final = 5.0
"""Processor time of the generator for the core, and of the formatter that it calls."""


def generate(document: str, into: Path) -> float:
    """Generate a client from a document, and give the seconds of processor time that it took."""
    generator = Path(sys.executable).with_name("openapi-python-client")
    # It tidies its output with ruff, which it looks for in PATH.
    path = os.pathsep.join([str(generator.parent), os.environ["PATH"]])
    command = ["generate", "--path", str(OPENAPI / document), "--output-path", str(into), "--meta", "none"]
    before = os.times()
    said = subprocess.run(  # noqa: S603
        [generator, *command],
        env={**os.environ, "PATH": path},
        capture_output=True,
        text=True,
        check=True,
        timeout=100,
    )
    after = os.times()
    assert "warning" not in (said.stdout + said.stderr).lower(), said.stdout + said.stderr
    used = after.children_user + after.children_system
    return used - before.children_user - before.children_system


@pytest.fixture(scope="module", params=["openapi", "core"])
def package(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """Generate the client, and make it importable."""
    folder, name = tmp_path_factory.mktemp("generated"), f"{request.param}_client"
    generate(f"{request.param}.json", folder / name)
    sys.path.insert(0, str(folder))
    yield name
    sys.path.remove(str(folder))


@pytest.fixture
def client(package: str, gateway: Gateway) -> Iterator[Any]:
    timeout = import_module("httpx").Timeout(PATIENCE_S)
    with import_module(package).Client(base_url=gateway.url, timeout=timeout) as client:
        yield client


def test_it_moves_a_motor_waits_for_the_end_and_reads_where_it_stands(package: str, client: Any) -> None:
    models = import_module(f"{package}.models")
    start_move = import_module(f"{package}.api.moves.start_move")
    get_move = import_module(f"{package}.api.moves.get_move")
    get_position = import_module(f"{package}.api.bodies.get_position")
    request = models.RelativeMoveRequest(
        kind="relative",
        direction=models.Direction.CCW,
        distance=models.Length(value=700, unit=models.LengthUnit.PULSE),
    )

    started = start_move.sync("3F", client=client, body=request)
    assert isinstance(started, models.Move)
    ended = get_move.sync("3F", started.id, client=client, wait=10)
    assert ended.status is models.MoveStatus.SUCCEEDED
    assert ended.position == started.start_position - 700
    assert get_position.sync("3F", client=client).pulses == ended.position


@pytest.mark.parametrize("package", ["openapi"], indirect=True)
def test_it_calls_commands_of_the_table_and_gets_typed_answers(package: str, client: Any) -> None:
    models = import_module(f"{package}.models")
    set_entry = import_module(f"{package}.api.commands.send_set_position_entry")
    get_entry = import_module(f"{package}.api.commands.send_get_position_entry")
    entry = models.PositionReference(position=25)

    done = set_entry.sync("00", client=client, body=models.SetPositionEntry(entry=entry, pulses=-1234))
    assert isinstance(done, models.Ack)
    answer = get_entry.sync("00", client=client, body=models.GetPositionEntry(entry=entry))
    assert answer.pulses == -1234


def test_it_gets_a_typed_problem_for_a_body_that_is_not_there(package: str, client: Any) -> None:
    models = import_module(f"{package}.models")
    get_position = import_module(f"{package}.api.bodies.get_position")
    answer = get_position.sync_detailed("55", client=client)
    assert answer.status_code == 404
    assert isinstance(answer.parsed, models.Problem)
    assert answer.parsed.moved is models.Moved.NO
    assert "55" in answer.parsed.detail


def test_a_client_of_the_core_is_light_and_passes_the_strictest_checks(tmp_path: Path) -> None:
    used_s = generate("core.json", tmp_path / "light_client")
    files = [file for file in (tmp_path / "light_client").rglob("*") if file.is_file()]
    assert len(files) <= MOST_FILES
    assert not [file.name for file in files if "type_" in file.name]
    assert used_s < MOST_CPU_S
    mypy = [sys.executable, "-m", "mypy", "--strict", "--config-file", os.devnull, "light_client"]
    checked = subprocess.run(mypy, cwd=tmp_path, capture_output=True, text=True, check=False)  # noqa: S603
    wrong = [line for line in checked.stdout.splitlines() if ": error:" in line]
    # The generator's own client.py, the same for every document, types what __exit__ takes as objects.
    assert [line for line in wrong if not line.startswith(f"light_client{os.sep}client.py:")] == []
    assert f"checked {len(list((tmp_path / 'light_client').rglob('*.py')))} source files" in checked.stdout
