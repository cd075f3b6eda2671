"""The certificate of a client: one name, or none."""

import asyncio
from typing import Any

import pytest

from api.front.certificates import CERTIFIED, common_name, note


class Shown(asyncio.BaseTransport):
    """A connection whose client has shown this."""

    def __init__(self, *parts: tuple[tuple[str, str], ...]) -> None:
        super().__init__({"peercert": {"subject": parts}} if parts else None)


@pytest.mark.parametrize(
    ("shown", "name"),
    [
        (Shown((("organizationName", "Fab"),), (("commonName", "mes"),)), "mes"),
        (Shown((("organizationName", "Fab"),)), None),
        (Shown((("commonName", "mes"),), (("commonName", "admin"),)), None),
        (Shown(), None),
    ],
)
def test_a_certificate_with_one_common_name_names_a_key(shown: Shown, name: str | None) -> None:
    assert common_name(shown) == name
    scope: dict[str, Any] = {}
    note(scope, common_name(shown))
    assert scope.get(CERTIFIED) == name
