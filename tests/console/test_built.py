"""The pages in the package are those of the sources, and the sources are typed throughout."""

import gzip
import os
import subprocess
from pathlib import Path

import pytest

from tests.console.console import CONSOLE, ROOT, require_packages

pytestmark = pytest.mark.prove

BUILT = ROOT / "api" / "console" / "built"
MOST_BYTES = 250_000
"""Size of all files, compressed, in bytes."""


def run(script: str, *arguments: str) -> None:
    done = subprocess.run(  # noqa: S603
        [require_packages(), CONSOLE / "node_modules" / script, *arguments],
        cwd=CONSOLE,
        env={**os.environ, "NODE_ENV": "production"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr


def files_in(folder: Path) -> dict[str, bytes]:
    return {str(file.relative_to(folder)): file.read_bytes() for file in folder.rglob("*") if file.is_file()}


def test_the_pages_are_built_from_the_sources(tmp_path: Path) -> None:
    run("vite/bin/vite.js", "build", "--outDir", str(tmp_path), "--emptyOutDir")
    made, committed = files_in(tmp_path), files_in(BUILT)
    assert made.keys() == committed.keys(), "make console builds them anew"
    assert made == committed, "make console builds them anew"


def test_the_pages_are_light_enough_for_a_slow_network() -> None:
    assert sum(len(gzip.compress(content)) for content in files_in(BUILT).values()) < MOST_BYTES


def test_the_sources_are_typed_and_accessible() -> None:
    run("svelte-check/bin/svelte-check", "--fail-on-warnings")
