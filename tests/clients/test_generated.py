"""The generated parts of both clients are what their generators write; strict TypeScript finds no fault."""

import json
from pathlib import Path
from shutil import copy

import pytest

from clients.python import generate
from tests.clients.node import TYPESCRIPT, run_node

pytestmark = pytest.mark.prove


def test_the_python_client_is_what_its_generator_writes() -> None:
    for name, text in generate.files(json.loads(generate.DOCUMENT.read_text("utf-8"))).items():
        kept = generate.PACKAGE / "generated" / name
        assert kept.read_text("utf-8") == text, "write it anew: make clients"


def test_the_typescript_client_is_what_its_generator_writes(tmp_path: Path) -> None:
    written = tmp_path / "schema.ts"
    run_node("node_modules/openapi-typescript/bin/cli.js", str(generate.DOCUMENT), "--output", str(written))
    kept = TYPESCRIPT / "src" / "generated" / "schema.ts"
    assert kept.read_text("utf-8") == written.read_text("utf-8"), "write it anew: make clients"


def test_strict_typescript_finds_no_fault_in_the_client_its_tests_and_the_example() -> None:
    run_node("node_modules/typescript/bin/tsc", "--noEmit")


def test_strict_typescript_takes_what_another_generator_makes_of_the_whole_document(tmp_path: Path) -> None:
    whole = generate.DOCUMENT.with_name("openapi.json")
    stranger = Path(copy(TYPESCRIPT / "test" / "stranger.ts", tmp_path))
    run_node("node_modules/@hey-api/openapi-ts/bin/run.js", "-i", str(whole), "-o", str(tmp_path / "made"))
    options = "--strict --noEmit --target es2022 --module esnext --moduleResolution bundler --skipLibCheck"
    run_node("node_modules/typescript/bin/tsc", *options.split(), str(stranger))


def test_the_typescript_client_moves_a_motor_loses_its_stream_and_misses_nothing(demo: str) -> None:
    run_node("--test", "--test-reporter=tap", "test/live.test.ts", MOTION_GATEWAY_URL=demo)
