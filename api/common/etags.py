"""Entity tags: a change of what somebody has read is refused where it is otherwise now (RFC 9110 13.1.1)."""

import re
from collections.abc import Callable
from hashlib import sha256
from typing import Any, Final

from fastapi import Request, Response
from pydantic import BaseModel

from api.common.requests import json_response
from gateway.core.errors import Outdated
from gateway.core.records import SentBack

HEADER: Final = "If-Match"

_PARAMETER: Final = {
    "name": HEADER,
    "in": "header",
    "required": False,
    "schema": {"type": "string"},
    "description": "The ETag of what was read: where it is otherwise now, nothing is changed (412).",
}
IF_MATCH: Final[dict[str, Any]] = {"openapi_extra": {"parameters": [_PARAMETER]}}
"""Declares that a route heeds the header."""

_TAG = re.compile(r'(?:W/)?"[^"]*"')


NOT_TAGGED: Final = {"steps", "flash", "last"}
"""What a change took, what flash memory is known to hold, what was done last: no change expects that."""


def etag_of(document: BaseModel) -> str:
    """The strong tag of what a document says."""
    return f'"{sha256(document.model_dump_json(exclude=NOT_TAGGED).encode()).hexdigest()[:32]}"'


def require_match(request: Request, etag: str) -> None:
    """Refuse a change of something else than was read; without the header nothing was asked for.

    :raises Outdated: `If-Match` does not name the present state; a weak tag names none.
    """
    wanted = ",".join(request.headers.getlist(HEADER)).strip()
    if wanted and wanted != "*" and etag not in _TAG.findall(wanted):
        raise Outdated


def expected_by(
    request: Request,
    change: SentBack | None = None,
    document: Callable[[Any], BaseModel] = lambda read: read,
) -> Callable[[Any], None] | None:
    """What refuses a present state that `If-Match` does not name, or that what is sent back contradicts.

    None where any will do. `document` makes of what is read what clients have read.
    """
    told = change is not None and change.told
    if request.headers.get(HEADER, "*").strip() == "*" and not told:
        return None

    def require(read: Any) -> None:
        present = document(read)
        require_match(request, etag_of(present))
        if change is not None:
            change.require_unchanged(present)

    return require


def tagged(document: BaseModel) -> Response:
    """Answer with a document and its tag."""
    return json_response(document, headers={"ETag": etag_of(document)})
