"""Names mean one thing, so that a reader who has met a class knows it everywhere."""

import ast
from collections import defaultdict
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGES = ("gateway", "api", "app", "protocols")
UNWANTED = ("Manager", "Helper", "Util", "Utils")
"""Ends of names that tell nothing."""


def classes() -> dict[str, list[str]]:
    """All classes at the top of a module that others may import, with where they are."""
    found = defaultdict(list)
    for file in (file for package in PACKAGES for file in sorted((ROOT / package).rglob("*.py"))):
        for node in ast.parse(file.read_text("utf-8")).body:
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                found[node.name].append(f"{file.relative_to(ROOT)}:{node.lineno}")
    return found


def test_no_two_classes_have_one_name() -> None:
    assert {name: places for name, places in classes().items() if len(places) > 1} == {}


@pytest.mark.parametrize("end", UNWANTED)
def test_a_name_says_what_a_class_is(end: str) -> None:
    assert [name for name in classes() if name.endswith(end)] == []
