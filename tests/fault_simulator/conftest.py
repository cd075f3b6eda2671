"""Operations are asked for in somebody's name: here in that of everybody."""

from collections.abc import Iterator

import pytest

from gateway.access.principal import EVERYBODY, asking


@pytest.fixture(autouse=True)
def everybody() -> Iterator[None]:
    with asking(EVERYBODY):
        yield
