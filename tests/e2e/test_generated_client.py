"""A stranger's client, generated from the OpenAPI file with nothing added, drives the running gateway."""

import os
import subprocess
import sys
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest

from tests.e2e.processes import PATIENCE_S, Gateway

pytestmark = pytest.mark.prove

OPENAPI = Path(__file__).parents[2] / "openapi" / "openapi.json"


@pytest.fixture(scope="module")
def package(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """Generate the client, and make it importable."""
    folder = tmp_path_factory.mktemp("generated")
    generator = Path(sys.executable).with_name("openapi-python-client")
    # It tidies its output with ruff, which it looks for in PATH.
    path = os.pathsep.join([str(generator.parent), os.environ["PATH"]])
    said = subprocess.run(  # noqa: S603
        [
            generator,
            "generate",
            "--path",
            OPENAPI,
            "--output-path",
            folder / "motion_client",
            "--meta",
            "none",
        ],
        env={**os.environ, "PATH": path},
        capture_output=True,
        text=True,
        check=True,
        timeout=100,
    )
    assert "warning" not in (said.stdout + said.stderr).lower(), said.stdout + said.stderr
    sys.path.insert(0, str(folder))
    yield "motion_client"
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
        direction=models.RelativeMoveRequestDirection.CCW,
        distance=models.Length(value=700, unit=models.LengthUnit.PULSE),
    )

    started = start_move.sync("3F", client=client, body=request)
    assert isinstance(started, models.Move)
    ended = get_move.sync("3F", started.id, client=client, wait=10)
    assert ended.status is models.MoveStatus.SUCCEEDED
    assert ended.position == started.start_position - 700
    assert get_position.sync("3F", client=client).pulses == ended.position


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
    assert answer.parsed.moved is models.ProblemMoved.NO
    assert "55" in answer.parsed.detail
