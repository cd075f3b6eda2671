"""The families of controllers, by the protocol that a line of the configuration names."""

from typing import Final

from gateway.core.family import Family
from gateway.fics.family import Fics
from gateway.rorze.family import Rorze

FAMILIES: Final[dict[str, type[Family]]] = {"rorze": Rorze, "fics": Fics}
"""A family of another maker is one more entry; a line that names no protocol is of the first."""
