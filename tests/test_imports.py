"""Limits of what a reader has to know: api sees the door alone, and a small feature few files."""

import tomllib
from functools import cache
from pathlib import Path
from typing import Any, Final

import grimp
import pytest

PACKAGES: Final = ("api", "app", "gateway", "protocols", "simulator", "transports")
MOST: Final = 40
"""Files that a small feature is read with: itself, and what it imports, directly or not."""
FLOORS: Final = {"gateway.fics": 10}
"""The longest chain of imports within a package, its subfolders with it; other packages are to follow."""
FILES: Final = {"gateway.fics": 46}
"""The most files of a package, its subfolders with it."""
CONTRACT: Final = "api has no rules: of the gateway it imports the door and nothing else"
ROOT: Final = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def graph() -> grimp.ImportGraph:
    return grimp.build_graph(*PACKAGES, cache_dir=None, exclude_type_checking_imports=False)


@pytest.mark.parametrize("feature", ["gateway.rorze.captures", "gateway.rorze.settings"])
def test_a_small_feature_is_read_with_few_files(graph: grimp.ImportGraph, feature: str) -> None:
    files = {feature, *graph.find_upstream_modules(feature)}
    assert len(files) <= MOST, sorted(files)


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
