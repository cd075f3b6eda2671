"""Access for tests that are not about who may do what: everybody gets in."""

from typing import Final

from api.common.access import Access
from gateway.door.admission import AuthorizedRequest

OPEN: Final = '\n[access]\nmode = "open"\n'
"""The end of a configuration file."""
OPEN_TABLE: Final = {"mode": "open"}


class AnyAccess(Access):
    """The hook of an application that has no plant."""

    is_open = True

    def __init__(self) -> None:
        """There is nothing to ask."""

    def require(self, *_: object, **__: object) -> AuthorizedRequest:
        """Let everything pass."""
        return AuthorizedRequest()
