"""The sources of the console: which file imports which."""

import re
from graphlib import CycleError, TopologicalSorter
from pathlib import Path
from typing import Final

from tests.console.console import CONSOLE

SOURCES: Final = CONSOLE / "src"
IMPORTS: Final = re.compile(r'(?:from|import) "(\.[^"]+\.(?:ts|svelte))"')


def imports_of(file: Path) -> set[Path]:
    return {(file.parent / name).resolve() for name in IMPORTS.findall(file.read_text("utf-8"))}


def test_no_source_imports_itself_by_way_of_others() -> None:
    files = [file for file in SOURCES.rglob("*") if file.suffix in (".ts", ".svelte")]
    sorter = TopologicalSorter({file: imports_of(file) for file in files})
    circle: list[str] = []
    try:
        sorter.prepare()
    except CycleError as error:
        circle = [file.name for file in error.args[1]]
    assert circle == []
