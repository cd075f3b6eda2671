"""Entity tags: a change of what somebody has read is refused where it is otherwise now (RFC 9110 13.1.1)."""

import re
from collections.abc import Callable
from typing import Any, Final

from fastapi import Request, Response
from pydantic import BaseModel

from api.common.requests import json_response
from gateway.core.errors import Outdated
from gateway.core.operation import Expectation
from gateway.core.records import SentBack
from gateway.door.documents import expectation, tag_of

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
    """What refuses a document of another tag than `If-Match` names; None where any will do.

    A weak tag names none.
    """
    wanted = ",".join(request.headers.getlist(HEADER)).strip()
    if wanted in ("", "*"):
        return None

    def require(tag: str) -> None:
        if f'"{tag}"' not in _TAG.findall(wanted):
            raise Outdated

    return require


def expected_by(
    request: Request,
    change: SentBack | None = None,
    document: Callable[[Any], BaseModel] = lambda read: read,
) -> Expectation | None:
    """What refuses a present state that `If-Match` does not name, or that what is sent back contradicts.

    None where any will do. `document` makes of what is read what clients have read.
    """
    expects = expectation(change, matching(request))
    return None if expects is None else lambda read: expects(document(read))


def etag_of(document: BaseModel) -> str:
    """The strong tag of what a document says."""
    return f'"{tag_of(document)}"'


def header_of(document: BaseModel) -> dict[str, str]:
    """The header with the tag of a document."""
    return {"ETag": etag_of(document)}


def tagged(document: BaseModel) -> Response:
    """Answer with a document and its tag."""
    return json_response(document, headers=header_of(document))
