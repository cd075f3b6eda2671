"""Limits of what a reader has to know: api sees the door alone, and a small feature few files.

`python -m tests.test_imports MODULE...` tells with how many files each is read, and what each import adds.
"""

import sys
import tomllib
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path
from typing import Any, Final

import grimp
import pytest

PACKAGES: Final = ("api", "app", "gateway", "protocols", "simulator", "transports")
MOST: Final = 40
"""Files that a small feature is read with: itself, and what it imports, directly or not, even for types."""
FEATURES: Final = (
    "gateway.door.access_keys",
    "gateway.door.leases",
    "gateway.door.security_log",
    "gateway.fics.settings",
    "gateway.fics.signals",
    "gateway.rorze.captures",
    "gateway.rorze.curves",
    "gateway.rorze.encoders",
    "gateway.rorze.memories",
    "gateway.rorze.patterns",
    "gateway.rorze.positions",
    "gateway.rorze.settings",
    "gateway.rorze.signals",
    "gateway.rorze.speed_sets",
)
FLOORS: Final = {"gateway.fics": 10}
"""The longest chain of imports within a package, its subfolders with it; other packages are to follow."""
FILES: Final = {"gateway.fics": 46}
"""The most files of a package, its subfolders with it."""
CONTRACT: Final = "api has no rules: of the gateway it imports the door and nothing else"
ROOT: Final = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def graph() -> grimp.ImportGraph:
    return _graph()


def _graph() -> grimp.ImportGraph:
    return grimp.build_graph(*PACKAGES, cache_dir=None, exclude_type_checking_imports=False)


@pytest.mark.parametrize("feature", FEATURES)
def test_a_small_feature_is_read_with_few_files(graph: grimp.ImportGraph, feature: str) -> None:
    assert len(_read_with(graph, [feature])) <= MOST, "\n".join(_told(graph, feature))


def _read_with(graph: grimp.ImportGraph, modules: Iterable[str]) -> set[str]:
    """Name the files that modules are read with, themselves among them."""
    return {*modules}.union(*map(graph.find_upstream_modules, modules))


def _told(graph: grimp.ImportGraph, module: str) -> Iterator[str]:
    """Say with how many files a module is read, and how many an import of it brings that no other brings."""
    whole, imported = _read_with(graph, [module]), graph.find_modules_directly_imported_by(module)
    yield f"{len(whole):4} {module}"
    for one in sorted(imported, key=lambda name: -len(graph.find_upstream_modules(name))):
        alone = whole - {module} - _read_with(graph, imported - {one})
        yield f"{len(_read_with(graph, [one])):8} {one}, {len(alone)} by it alone"


def test_the_contract_of_api_names_all_of_the_gateway_but_its_door(graph: grimp.ImportGraph) -> None:
    settings: dict[str, Any] = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
    contracts = settings["tool"]["importlinter"]["contracts"]
    [contract] = [contract for contract in contracts if contract["name"] == CONTRACT]
    assert {*contract["forbidden_modules"], "gateway.door"} == graph.find_children("gateway")


@pytest.mark.parametrize("package", FLOORS)
def test_a_package_has_few_floors(graph: grimp.ImportGraph, package: str) -> None:
    modules = {package, *graph.find_descendants(package)}

    @cache
    def floor(module: str) -> int:
        below = modules & graph.find_modules_directly_imported_by(module)
        return 1 + max(map(floor, below), default=0)

    assert max(map(floor, modules)) == FLOORS[package]
    assert len(modules) <= FILES[package]


if __name__ == "__main__":
    built = _graph()
    for feature in sys.argv[1:] or sorted(built.modules):
        print(*_told(built, feature), sep="\n")
