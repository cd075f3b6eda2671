"""No package is a tower: a reader passes at most ten modules from one that imports to the ground.

The floors of a package are the modules of the longest chain of imports in it, its folders counted with it.
"""

import ast
from collections.abc import Iterator, Set
from graphlib import TopologicalSorter
from pathlib import Path
from typing import Final

import pytest

ROOT = Path(__file__).parent.parent
MOST: Final = 10
PACKAGES: Final = sorted(
    folder
    for parent in ("gateway", "api", "app", "protocols")
    for folder in (ROOT / parent).iterdir()
    if (folder / "__init__.py").exists()
)


def imports_within(package: Path) -> dict[str, set[str]]:
    """The modules of a package, each with those of the package that it imports."""
    modules = {_name_of(file): file for file in package.rglob("*.py")}
    return {name: set(_imported(file, modules.keys())) - {name} for name, file in modules.items()}


def _name_of(file: Path) -> str:
    return ".".join(file.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")


def _imported(file: Path, modules: Set[str]) -> Iterator[str]:
    for node in ast.walk(ast.parse(file.read_text("utf-8"))):
        if isinstance(node, ast.Import):
            yield from {alias.name for alias in node.names} & modules
        elif isinstance(node, ast.ImportFrom) and node.module is not None:
            for alias in node.names:
                whole = f"{node.module}.{alias.name}"
                yield from {whole if whole in modules else node.module} & modules


def floors(imports: dict[str, set[str]]) -> dict[str, int]:
    """The floor of each module: one that imports none of its package stands on the ground, 1."""
    found: dict[str, int] = {}
    for module in TopologicalSorter(imports).static_order():
        found[module] = 1 + max((found[below] for below in imports[module]), default=0)
    return found


@pytest.mark.parametrize("package", PACKAGES, ids=lambda folder: str(folder.relative_to(ROOT)))
def test_a_package_has_ten_floors_at_most(package: Path) -> None:
    found = floors(imports_within(package))
    highest = max(found, key=lambda module: found[module])
    assert found[highest] <= MOST, (highest, found[highest])


def test_the_floors_of_a_chain_are_its_modules() -> None:
    assert floors({"a": {"b", "c"}, "b": {"c"}, "c": set(), "d": set()}) == {"a": 3, "b": 2, "c": 1, "d": 1}
