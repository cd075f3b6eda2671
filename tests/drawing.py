"""Seeds that change with each commit: `make test` runs a few of many, `make prove` all of them."""

import re
import subprocess
from collections.abc import Iterable
from functools import cache
from pathlib import Path
from random import Random
from typing import Any

import pytest

ROOT = Path(__file__).parents[1]


@cache
def commit() -> str:
    """The commit that is checked out; empty in a tree without a repository."""
    asked = ["git", "-C", str(ROOT), "rev-parse", "HEAD"]
    try:
        return subprocess.run(asked, capture_output=True, text=True, check=False).stdout.strip()  # noqa: S603
    except FileNotFoundError:
        return ""


def drawn(cases: Iterable[Any], most: int, of: str) -> list[Any]:
    """All cases; those that the commit does not draw are marked to run in `make prove` alone.

    `of` tells draws apart: equal ranges are not drawn alike.
    """
    every = list(cases)
    chosen = set(Random(f"{commit()} {of}").sample(range(len(every)), min(most, len(every))))
    return [
        case if at in chosen else pytest.param(case, marks=pytest.mark.prove) for at, case in enumerate(every)
    ]


def fresh(count: int, of: str) -> list[int]:
    """Draw `count` seeds of 10,000, others with each commit: together the commits try all."""
    return sorted(Random(f"{commit()} {of}").sample(range(10_000), count))


def runs_of(source: str) -> set[str]:
    """The targets of the Makefile that run tests, by the marks that stand in their text."""
    if re.search(r"^pytestmark = .*\bprove\b", source, re.MULTILINE):
        return {"prove"}
    return {"test", "prove"} if re.search(r"\bmark\.prove\b|\bdrawn\(", source) else {"test"}


def may_choose(marks: str, file: Path) -> bool:
    """Say whether `pytest -m` with such an expression may choose a test of a file."""
    run = {"prove": "prove", "not prove": "test"}.get(marks)
    return run is None or run in runs_of(file.read_text("utf-8"))
