"""Operations need a caller: here the caller of a gateway without access control."""

from collections.abc import Iterator

import pytest

from gateway.access.principal import EVERYBODY, asking


@pytest.fixture(autouse=True)
def everybody() -> Iterator[None]:
    with asking(EVERYBODY):
        yield
