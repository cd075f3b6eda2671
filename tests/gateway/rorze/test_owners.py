"""Only the module that owns a fact of a body assigns it; others tell what has happened, and ask."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

GATEWAY = Path(__file__).parents[3] / "gateway"
OWNERS = {"bodies.py", "knowledge.py", "power.py"}
BODY = re.compile(r"(\w+\.)*(_?body|who(?!\.scara)|member)\.")
WIRING = ("on_news", "on_memory")
"""Callbacks, which the family sets where it builds a body."""


def assignments(tree: ast.AST) -> Iterator[str]:
    """The attributes that a module assigns, with what they are of."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Store):
            yield ast.unparse(node)


def test_nobody_else_assigns_a_fact_of_a_body() -> None:
    files = [file for family in ("rorze", "rorze_scara") for file in (GATEWAY / family).rglob("*.py")]
    told = {
        f"{file.name}: {target}"
        for file in files
        if file.name not in OWNERS
        for target in assignments(ast.parse(file.read_text("utf-8")))
        if BODY.match(target) and not target.endswith(WIRING)
    }
    assert told == set()


def test_an_assignment_to_a_body_is_seen() -> None:
    source = "proof.body.told.rest = None\nself._body.moving, x = True, 1\nself.body = body\nbody.line.f += 1"
    found = [target for target in assignments(ast.parse(source)) if BODY.match(target)]
    assert sorted(found) == ["body.line.f", "proof.body.told.rest", "self._body.moving"]
