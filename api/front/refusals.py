"""Requests that end their connection, and what is answered to them."""

import logging
import re
from http import HTTPStatus
from typing import Final

import httptools

from api.common.problems import MEDIA_TYPE, RETRY_AFTER_S, plain_problem
from api.common.request_ids import Headers, header_of, request_id_of

log = logging.getLogger(__name__)

NOT_HTTP: Final = "The request cannot be read as HTTP/1.1."


_STATUS_LINES: Final = {
    int(status): f"HTTP/1.1 {status.value} {status.phrase}\r\n".encode() for status in HTTPStatus
}
_CONTROL: Final = re.compile(rb"[\x00-\x08\x0a-\x1f\x7f]")


def head_of(status: int, headers: Headers) -> bytes:
    """The head of an answer.

    :raises ValueError: a header has control characters: it could end its line.
    """
    if _CONTROL.search(b"".join([part for header in headers for part in header])):
        raise ValueError("A header of an answer has control characters.")
    lines = b"".join([b"%b: %b\r\n" % header for header in headers])
    return b"%b%b\r\n" % (_STATUS_LINES[status], lines)


class Refused(Exception):
    """A request that ends its connection; nothing of it was done."""

    def __init__(self, status: int, detail: str) -> None:
        super().__init__(detail)
        self.status = status
        self.detail = f"{detail} Nothing was sent."

    def answer(self, default_headers: Headers, path: str, asked: Headers) -> bytes:
        """The whole answer to a request with the headers `asked`, as far as they were read."""
        request_id = request_id_of(asked)
        problem = plain_problem(self.status, self.detail, path)
        problem.request_id = request_id
        problem.retryable = self.status in (HTTPStatus.REQUEST_TIMEOUT, HTTPStatus.SERVICE_UNAVAILABLE)
        content = problem.model_dump_json(exclude_none=True).encode()
        headers = [
            *default_headers,
            header_of(request_id),
            (b"content-type", MEDIA_TYPE.encode()),
            (b"content-length", str(len(content)).encode()),
            (b"connection", b"close"),
        ]
        if self.status == HTTPStatus.SERVICE_UNAVAILABLE:
            headers.append((b"retry-after", str(RETRY_AFTER_S).encode()))
        return head_of(self.status, headers) + content


def refusal_in(error: httptools.HttpParserError) -> Refused:
    """The refusal that was raised while the parser called us, or one for what it found itself."""
    reason = error.__context__
    if isinstance(reason, Refused):
        return reason
    if not isinstance(reason, httptools.HttpParserError | ValueError | None):
        log.error("A request could not be taken in.", exc_info=reason)
    return Refused(400, NOT_HTTP)
