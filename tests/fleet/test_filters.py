"""Filters of a plant's events."""

import pytest

from fleet.filters import filter_of
from gateway.core.errors import InvalidRequest
from tests.fleet.test_feed import event

EVENT = event("s1", 1)


@pytest.mark.parametrize(
    ("wanted", "passes"),
    [
        ({}, True),
        ({"bodies": "s1:line1.3F"}, True),
        ({"bodies": "3f"}, True),
        ({"bodies": "line1.3F,s2:00"}, True),
        ({"bodies": "s2:line1.3F"}, False),
        ({"bodies": "00"}, False),
        ({"types": "body.*"}, True),
        ({"types": "body.online,line.up"}, True),
        ({"types": "line.*"}, False),
        ({"gateways": "s2,s1"}, True),
        ({"gateways": "s2"}, False),
        ({"gateways": "s1", "types": "line.*"}, False),
    ],
)
def test_what_is_wanted_passes(wanted: dict[str, str], passes: bool) -> None:
    assert filter_of(wanted.get("bodies"), wanted.get("types"), wanted.get("gateways"))(EVENT) is passes


@pytest.mark.parametrize(
    "wanted", [{"bodies": "s1:"}, {"bodies": "S 1:3F"}, {"types": "body.?"}, {"gateways": "Stocker 1"}]
)
def test_what_can_be_nothing_is_refused(wanted: dict[str, str]) -> None:
    with pytest.raises(InvalidRequest):
        filter_of(wanted.get("bodies"), wanted.get("types"), wanted.get("gateways"))
