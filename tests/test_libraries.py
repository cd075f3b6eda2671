"""Libraries are used by what they offer: no private module, name or member of one is imported or touched."""

import ast
import importlib
import inspect
import re
import tomllib
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from types import CodeType, FunctionType, ModuleType
from typing import Any, Final

import pytest

ROOT = Path(__file__).parents[1]
OURS: Final = (
    "api",
    "app",
    "bridges",
    "commissioning",
    "gateway",
    "fleet",
    "protocols",
    "recordings",
    "simulator",
    "transports",
)
LIBRARIES: Final = frozenset(
    [
        *("anyio", "click", "fastapi", "fastapi_offline", "httptools", "httpx", "jwt", "prometheus_client"),
        *("pydantic", "pydantic_core", "rich", "serial", "serial_asyncio", "starlette", "typer", "uvicorn"),
        *("uvloop", "websockets", "yaml"),
    ]
)
UNDOCUMENTED: Final = (
    "fastapi.dependencies",
    "fastapi.middleware.asyncexitstack",
    "fastapi.utils",
    "pydantic.deprecated",
    "pydantic.v1",
    "starlette.concurrency",
    "uvicorn.lifespan",
    "uvicorn.loops",
    "uvicorn.protocols",
    "uvicorn.supervisors",
    "websockets.asyncio.connection",
    "websockets.legacy",
    "websockets.streams",
)
"""Modules whose names are not private, but which the documentation of their libraries does not offer."""
_PRIVATE: Final = re.compile(r"\bself\.(_[a-z]\w*)")


def files() -> Iterator[Path]:
    for package in OURS:
        yield from (ROOT / package).rglob("*.py")


def imported(tree: ast.AST) -> Iterator[str]:
    """All that a module imports, by its whole name."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (name.name for name in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            yield from (f"{node.module}.{name.name}" for name in node.names)


def is_private(name: str) -> bool:
    library, *parts = name.split(".")
    hidden = any(part.startswith("_") and not part.startswith("__") for part in parts)
    return library in LIBRARIES and (
        hidden or f"{name}.".startswith(tuple(f"{module}." for module in UNDOCUMENTED))
    )


@pytest.mark.parametrize(
    "name", ["fastapi._compat.shared", "starlette._utils.get_route_path", "uvicorn.protocols.utils.is_ssl"]
)
def test_a_private_name_is_known(name: str) -> None:
    assert is_private(name)


def test_no_private_name_of_a_library_is_imported() -> None:
    found = {
        path: name
        for path in files()
        for name in imported(ast.parse(path.read_text("utf-8")))
        if is_private(name)
    }
    assert found == {}


@cache
def members_of(kind: type) -> set[str]:
    """The private members of a class of a library, those that its methods give to its objects too."""
    try:
        source = inspect.getsource(kind)
    except (OSError, TypeError):
        source = ""
    declared = {*vars(kind), *vars(kind).get("__annotations__", {})}
    return {name for name in {*declared, *_PRIVATE.findall(source)} if is_hidden(name)}


def is_hidden(name: str) -> bool:
    return name.startswith("_") and not name.startswith(("__", "_abc_", "_is_protocol"))


def names_in(code: CodeType) -> Iterator[str]:
    """The attributes that a function uses, and functions inside it."""
    yield from code.co_names
    for inner in code.co_consts:
        if isinstance(inner, CodeType):
            yield from names_in(inner)


def functions_of(member: object) -> list[CodeType]:
    """The code of a member of a class, if it has any."""
    if isinstance(member, classmethod | staticmethod):
        member = member.__func__
    parts = (member.fget, member.fset) if isinstance(member, property) else (member,)
    return [part.__code__ for part in parts if isinstance(part, FunctionType)]


def classes_in(module: ModuleType) -> Iterator[type]:
    for kind in vars(module).values():
        if isinstance(kind, type) and kind.__module__ == module.__name__:
            yield kind


def is_of_a_library(kind: type) -> bool:
    return kind.__module__.partition(".")[0] in LIBRARIES


def touched(kind: type) -> set[str]:
    """The private members of libraries' classes that one of ours uses, or covers."""
    theirs: set[str] = set().union(*(members_of(base) for base in kind.__mro__ if is_of_a_library(base)))
    used = {
        name
        for member in vars(kind).values()
        for function in functions_of(member)
        for name in names_in(function)
    }
    return {name for name in used | set(vars(kind)) if is_hidden(name)} & theirs


def test_a_private_member_that_is_touched_is_found() -> None:
    from starlette.requests import Request

    class Prying(Request):
        async def pry(self) -> Any:
            return self._receive

    assert touched(Prying) == {"_receive"}


def test_no_class_of_ours_touches_private_members_of_a_class_of_a_library() -> None:
    found: dict[str, set[str]] = {}
    for path in files():
        if path.name == "__main__.py":
            continue
        name = ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")
        for kind in classes_in(importlib.import_module(name)):
            if any(map(is_of_a_library, kind.__mro__)) and (members := touched(kind)):
                found[f"{name}.{kind.__name__}"] = members
    assert found == {}


def test_every_dependency_has_an_upper_bound() -> None:
    """An installation of next year, by these bounds, still starts."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    asked = [
        *project["dependencies"],
        *(requirement for extra in project["optional-dependencies"].values() for requirement in extra),
    ]
    assert [
        requirement
        for requirement in asked
        if not re.fullmatch(r"[\w\[\]-]+>=[\d.]+,<[\d.]+(; .+)?", requirement)
    ] == []
