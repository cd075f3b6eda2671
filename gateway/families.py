"""The registry of packages: the families of controllers, by the protocol of a line, and their extensions."""

from collections.abc import Iterator, Mapping, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any, Final, TypeVar

from gateway.core.family import Extension, Family, Registered, Site

F = TypeVar("F")

FAMILIES: Final[dict[str, type[Family]]] = {
    name: import_module(f"gateway.{name}.family").FAMILY for name in ("rorze", "fics")
}
"""A family of another maker is one more package; a line that names no protocol is of the first."""

EXTENSIONS: Final[Sequence[type[Extension]]] = [
    import_module(f"gateway.{file.parent.name}.extension").EXTENSION
    for file in sorted(Path(__file__).parent.glob("*/extension.py"))
]
"""Extensions in the packages beside the families; nothing else names them."""


def registered() -> Iterator[type[Registered]]:
    """All families, each with its extensions."""
    for family in FAMILIES.values():
        yield family
        yield from (extension for extension in EXTENSIONS if extension.of is family)


class Packages:
    """All families and extensions of a plant."""

    def __init__(self, site: Site) -> None:
        self.families: Mapping[str, Family] = {name: family(site) for name, family in FAMILIES.items()}
        """Families by the protocol of a line."""
        made: dict[type[Registered], Registered] = {type(family): family for family in self.families.values()}
        self.extensions = [
            extension(site, made[extension.of]) for extension in EXTENSIONS if extension.of in made
        ]
        made |= {type(extension): extension for extension in self.extensions}
        self.registered: Sequence[Registered] = [made[kind] for kind in registered()]
        """All families, each with its extensions."""
        self._found: dict[type[Any], Any] = {}

    def of(self, kind: type[F]) -> F:
        """The package of a kind, a class or a base; each is looked for once."""
        if kind not in self._found:
            self._found[kind] = next(package for package in self.registered if isinstance(package, kind))
        found: F = self._found[kind]
        return found
