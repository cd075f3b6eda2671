"""The pages in the package are those of the sources, and the sources are typed throughout."""

import gzip
import os
import shutil
import subprocess
from pathlib import Path

import pytest

from tests.console.console import CONSOLE, ROOT, require_packages

pytestmark = pytest.mark.prove

BUILT = ROOT / "api" / "console" / "built"
CLIENT = ROOT / "clients" / "typescript" / "src"
MOST_BYTES = 250_000
"""Size of all files, compressed, in bytes."""


def run(script: str, *arguments: str, where: Path = CONSOLE) -> None:
    done = subprocess.run(  # noqa: S603
        [require_packages(), CONSOLE / "node_modules" / script, *arguments],
        cwd=where,
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


EXTENSIONS = sorted(folder.name for folder in (CONSOLE / "src" / "extensions").iterdir())


@pytest.mark.parametrize("extension", EXTENSIONS)
def test_without_the_folder_of_an_extension_there_is_a_console(tmp_path: Path, extension: str) -> None:
    copy = tmp_path / "console"
    shutil.copytree(CONSOLE, copy, ignore=shutil.ignore_patterns("node_modules", extension))
    (copy / "node_modules").symlink_to(CONSOLE / "node_modules")
    shutil.copytree(CLIENT, tmp_path / "clients" / "typescript" / "src")
    run("svelte-check/bin/svelte-check", "--fail-on-warnings", where=copy)
    run("vite/bin/vite.js", "build", "--outDir", str(tmp_path / "built"), "--emptyOutDir", where=copy)
    made = files_in(tmp_path / "built")
    assert "index.html" in made
    assert [name for name, content in made.items() if extension.encode() in content.lower()] == []
