"""Entity tags: a document that is otherwise now than its sender has read is not changed (RFC 9110 13.1.1)."""

import re
from collections.abc import Callable
from typing import Any, Final

from pydantic import BaseModel
from starlette.requests import Request

from gateway.door.documents import tag_of
from gateway.door.problems import Outdated

HEADER: Final = "If-Match"

_PARAMETER: Final = {
    "name": HEADER,
    "in": "header",
    "required": False,
    "schema": {"type": "string"},
    "description": "The ETag of what was read: where it is otherwise now, nothing is changed (412).",
}
IF_MATCH: Final[dict[str, Any]] = {"parameters": [_PARAMETER]}
"""Declares that a route heeds the header."""

_TAG = re.compile(r'(?:W/)?"[^"]*"')


def matching(request: Request) -> Callable[[str], None] | None:
    """A check that refuses a document of another tag than `If-Match` names; None where any will do.

    A weak tag names none.
    """
    wanted = ",".join(request.headers.getlist(HEADER)).strip()
    if wanted in ("", "*"):
        return None

    def require(tag: str) -> None:
        if f'"{tag}"' not in _TAG.findall(wanted):
            raise Outdated

    return require


def etag_of(document: BaseModel) -> str:
    """The strong tag of what a document says."""
    return f'"{tag_of(document)}"'


def header_of(document: BaseModel) -> dict[str, str]:
    """The header with the tag of a document."""
    return {"ETag": etag_of(document)}
