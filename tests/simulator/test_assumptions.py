"""Every assumption of the simulators stands in docs/simulator.md, by the name it has in the code."""

import ast
import re
from collections.abc import Iterator, Sequence
from dataclasses import fields, is_dataclass
from importlib import import_module
from pathlib import Path
from pkgutil import walk_packages

import pytest

import simulator

ROOT = Path(simulator.__path__[0])
SOURCES = sorted([*ROOT.rglob("*.py"), *(ROOT.parent / "protocols" / "fics").glob("*.py")])
"""A simulated Fics takes what the rows of C-HOST take: what they assume, it assumes."""
DOCUMENT = (ROOT.parent / "docs" / "simulator.md").read_text(encoding="utf-8")
NAMED = set(re.findall(r"`[\w./]*?(\w+)`", DOCUMENT))
ASSUMES = re.compile("assum", re.IGNORECASE)


def switches() -> Iterator[str]:
    """The fields of the classes whose every value is an assumption."""
    for module in walk_packages(simulator.__path__, "simulator."):
        for item in vars(import_module(module.name)).values():
            if (
                isinstance(item, type)
                and is_dataclass(item)
                and "each value is an assumption" in (item.__doc__ or "")
            ):
                yield from (f"{item.__name__}.{field.name}" for field in fields(item))


def assumed(body: Sequence[ast.stmt], owner: str) -> Iterator[str]:
    """The names of what a text in the code calls an assumption; `owner` has the docstring of this body."""
    names = [owner]
    for statement in body:
        if isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant):
            if ASSUMES.search(str(statement.value.value)):
                yield from names
        elif isinstance(statement, ast.Assign | ast.AnnAssign):
            targets = statement.targets if isinstance(statement, ast.Assign) else [statement.target]
            names = [
                node.attr if isinstance(node, ast.Attribute) else node.id
                for target in targets
                for node in ast.walk(target)
                if isinstance(node, ast.Name | ast.Attribute) and isinstance(node.ctx, ast.Store)
            ]
        elif isinstance(statement, ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            yield from assumed(statement.body, statement.name)


@pytest.mark.parametrize("switch", sorted(set(switches())))
def test_every_switch_is_documented(switch: str) -> None:
    assert switch.rpartition(".")[2] in NAMED, f"{switch} is missing in docs/simulator.md"


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: str(path.relative_to(ROOT.parent)))
def test_what_the_code_calls_an_assumption_is_documented(path: Path) -> None:
    module = ast.parse(path.read_text(encoding="utf-8"))
    missing = set(assumed(module.body, path.stem)) - NAMED
    assert not missing, f"assumptions missing in docs/simulator.md: {', '.join(sorted(missing))}"


def test_the_walk_finds_switches_constants_and_deeds() -> None:
    assert {"LinkSettings.reply_delay_s", "LineSettings.terminator", "RobotSettings.status_bits"} <= set(
        switches()
    )
    source = '"""Assumed."""\nA, B = 1, 2\n"""An assumption."""\nclass C:\n  def d(self):\n    """Assumes."""'
    assert list(assumed(ast.parse(source).body, "module")) == ["module", "A", "B", "d"]
