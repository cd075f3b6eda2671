"""The sources of the console: which file imports which, and which knows of an extension."""

import re
from graphlib import CycleError, TopologicalSorter
from pathlib import Path
from typing import Final

import pytest

from tests.console.console import CONSOLE

SOURCES: Final = CONSOLE / "src"
EXTENSIONS: Final = SOURCES / "extensions"
IMPORTS: Final = re.compile(r'(?:from|import) "(\.[^"]+\.(?:ts|svelte))"')


def imports_of(file: Path) -> set[Path]:
    return {(file.parent / name).resolve() for name in IMPORTS.findall(file.read_text("utf-8"))}


def sources() -> list[Path]:
    return [file for file in SOURCES.rglob("*") if file.suffix in (".ts", ".svelte", ".css")]


def test_no_source_imports_itself_by_way_of_others() -> None:
    sorter = TopologicalSorter({file: imports_of(file) for file in sources()})
    circle: list[str] = []
    try:
        sorter.prepare()
    except CycleError as error:
        circle = [file.name for file in error.args[1]]
    assert circle == []


@pytest.mark.parametrize("extension", sorted(EXTENSIONS.iterdir()), ids=lambda folder: folder.name)
def test_nothing_outside_its_folder_knows_an_extension(extension: Path) -> None:
    """`test_built` takes the folder away."""
    others = [file for file in sources() if extension not in file.parents]
    assert len(others) > 100
    named = [file.name for file in others if extension.name in file.read_text("utf-8").lower()]
    assert named == []
