"""The parts that all families share name none of them: no import, no word of a text, no row of data."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Final

import pytest

ROOT: Final = Path(__file__).parents[1]
SHARED: Final = ("api", "gateway/core", "gateway/door")
NAMES: Final = re.compile(r"rorze|fics|\bRC-?4|scara|dynax|C-?HOST", re.IGNORECASE)
"""Names of families, of their extensions, of makers and of their products."""
KINDS: Final = (".py", ".toml", ".json", ".html")


def texts(folder: str) -> Iterator[Path]:
    """All but the pages of the console, which are built of other sources."""
    for file in sorted((ROOT / folder).rglob("*")):
        if file.suffix in KINDS and "built" not in file.parts:
            yield file


def named(text: str) -> list[str]:
    return [line.strip() for line in text.splitlines() if NAMES.search(line)]


@pytest.mark.parametrize("folder", SHARED)
def test_no_family_is_named(folder: str) -> None:
    files = list(texts(folder))
    assert len(files) > 30
    assert {str(file): found for file in files if (found := named(file.read_text("utf-8")))} == {}


@pytest.mark.parametrize(
    "line", ["plant.family(Rorze)", "the RC-420 manual", "/scaras", "speaks C-HOST", "a Fics"]
)
def test_a_name_is_seen(line: str) -> None:
    assert named(f"first\n{line}\nlast") == [line]
