"""Roles, and the rights each has."""

from collections.abc import Mapping
from enum import StrEnum
from typing import Final

from gateway.core.rights import Right


class Role(StrEnum):
    """A caller's role at the plant; each role has the rights of those before it."""

    VIEWER = "viewer"
    OPERATOR = "operator"
    SETUP = "setup"
    ADMIN = "admin"


_VIEWER: Final = frozenset({Right.OPEN, Right.VIEW, Right.STOP})
_OPERATOR: Final = _VIEWER | {Right.OPERATE}
_SETUP: Final = _OPERATOR | {Right.SETUP}

RIGHTS_OF: Final[Mapping[Role, frozenset[Right]]] = {
    Role.VIEWER: _VIEWER,
    Role.OPERATOR: _OPERATOR,
    Role.SETUP: _SETUP,
    Role.ADMIN: _SETUP | {Right.ADMIN},
}
"""Every role may stop."""
