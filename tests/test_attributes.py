"""Classes have few attributes: a reader can say in a sentence what a class is.

An attribute is one that the class assigns on `self`, or a field of a dataclass that is not frozen.
"""

import ast
from collections.abc import Iterator
from pathlib import Path
from typing import Final

ROOT = Path(__file__).parent.parent
PACKAGES: Final = ("gateway", "api", "app", "protocols")
MOST: Final = 15


def attributes(node: ast.ClassDef) -> set[str]:
    """The attributes of a class."""
    fields = {
        field.target.id
        for field in node.body
        if isinstance(field, ast.AnnAssign) and isinstance(field.target, ast.Name) and _is_stored(field)
    }
    assigned = {
        name.attr
        for name in ast.walk(node)
        if isinstance(name, ast.Attribute)
        and isinstance(name.ctx, ast.Store)
        and isinstance(name.value, ast.Name)
        and name.value.id == "self"
    }
    return assigned | (fields if _is_mutable_dataclass(node) else set())


def _is_stored(field: ast.AnnAssign) -> bool:
    return not ast.unparse(field.annotation).startswith("ClassVar")


def _is_mutable_dataclass(node: ast.ClassDef) -> bool:
    made = [
        ast.unparse(decorator)
        for decorator in node.decorator_list
        if ast.unparse(decorator).startswith("dataclass")
    ]
    return any("frozen=True" not in decorator for decorator in made)


def classes() -> Iterator[tuple[str, int]]:
    """All classes, with the number of their attributes."""
    for package in PACKAGES:
        for file in (ROOT / package).rglob("*.py"):
            for node in ast.walk(ast.parse(file.read_text("utf-8"))):
                if isinstance(node, ast.ClassDef):
                    yield node.name, len(attributes(node))


def test_no_class_has_more_attributes_than_can_be_told() -> None:
    above = {name: count for name, count in classes() if count > MOST}
    assert not above


def test_attributes_are_fields_of_dataclasses_and_names_assigned_on_self() -> None:
    source = """
@dataclass(eq=False)
class Some:
    kind: ClassVar = 1
    one: int
    def two(self): self.second, other.third = 1, 2; self.fourth += 1
@dataclass(frozen=True)
class Frozen:
    one: int
class Plain:
    one: int
    def __init__(self): self.two = 1
"""
    found = {made.name: attributes(made) for made in ast.parse(source).body if isinstance(made, ast.ClassDef)}
    assert found == {"Some": {"one", "second", "fourth"}, "Frozen": set(), "Plain": {"two"}}
