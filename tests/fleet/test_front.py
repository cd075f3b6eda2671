"""The requests of the plant process, as far as no gateway is asked."""

import asyncio
from typing import Any

import pytest
from starlette.exceptions import HTTPException

from fleet.front import CONTENT_S, MOST_BYTES, _content_of
from tests.virtual_time import run_virtual


class Sent:
    """A content that comes in pieces, and may not end."""

    def __init__(self, *pieces: bytes, silent: bool = False) -> None:
        self._pieces, self._silent = iter(pieces), silent

    def stream(self) -> "Sent":
        return self

    def __aiter__(self) -> "Sent":
        return self

    async def __anext__(self) -> bytes:
        for piece in self._pieces:
            return piece
        if self._silent:
            await asyncio.sleep(10 * CONTENT_S)
        raise StopAsyncIteration


def request(*pieces: bytes, silent: bool = False) -> Any:
    return Sent(*pieces, silent=silent)


@pytest.mark.parametrize(
    ("asked", "status"),
    [(request(b"{", silent=True), 408), (request(b"x" * MOST_BYTES, b"y"), 413)],
    ids=["half of it", "too much"],
)
def test_a_content_that_does_not_end_is_refused(asked: Any, status: int) -> None:
    async def read() -> None:
        with pytest.raises(HTTPException) as refused:
            await _content_of(asked)
        assert refused.value.status_code == status
        assert "nothing was sent" in refused.value.detail

    run_virtual(read())


def test_a_content_is_all_its_pieces() -> None:
    async def read() -> None:
        assert await _content_of(request(b"a", b"", b"b")) == b"ab"

    run_virtual(read())
