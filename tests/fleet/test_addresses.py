"""Addresses of a plant: taken apart on the way in, put together on the way out."""

import pytest

from fleet.addresses import Place, outward, path_outward, place_of, tokens_for


@pytest.mark.parametrize(
    ("path", "place"),
    [
        ("/bodies/stocker1:line1.3F", Place("stocker1", "/bodies/line1.3F")),
        ("/bodies/stocker1:3F/moves/7", Place("stocker1", "/bodies/3F/moves/7")),
        ("/robots/s2:r1/units/1", Place("s2", "/robots/r1/units/1")),
        ("/alarms/s2:01a/reset", Place("s2", "/alarms/01a/reset")),
        ("/bodies/line1.3F", None),
        ("/bodies/:3F", None),
        ("/bodies/stocker1:", None),
        ("/audit/stocker1:x", None),
        ("/", None),
    ],
)
def test_a_path_leads_to_a_gateway_by_the_name_in_it(path: str, place: Place | None) -> None:
    assert place_of(path) == place


@pytest.mark.parametrize(
    ("own", "told"),
    [
        ("/bodies/line1.3F/moves/7", "/bodies/s1:line1.3F/moves/7"),
        ("/robots/r1/units/1", "/robots/s1:r1/units/1"),
        ("/gateway", "/gateways/s1"),
        ("/events", "/events"),
        ("/bodies", "/bodies"),
    ],
)
def test_a_gateways_own_path_gets_its_name(own: str, told: str) -> None:
    assert path_outward("s1", own) == told


def test_what_a_gateway_tells_has_the_addresses_of_the_plant() -> None:
    told = {
        "body_id": "line1.3F",
        "groups": ["line1.80"],
        "name": "lift",
        "position": 5,
        "links": {"self": "/bodies/line1.3F"},
        "next": [{"path": "/lines/line1", "en": "See the line."}],
        "address": "tcp://terminal:1",
        "token": 7,
        "move_id": None,
    }
    assert outward("s1", told) == {
        **told,
        "body_id": "s1:line1.3F",
        "groups": ["s1:line1.80"],
        "links": {"self": "/bodies/s1:line1.3F"},
        "next": [{"path": "/lines/s1:line1", "en": "See the line."}],
        "token": "s1:7",
    }


@pytest.mark.parametrize(
    ("shown", "of_s1"), [("17", "17"), ("s1:17,s2:4", "17"), ("s2:4", ""), ("s1:1, 5", "1, 5"), ("", "")]
)
def test_each_gateway_is_shown_its_own_tokens(shown: str, of_s1: str) -> None:
    assert tokens_for("s1", shown) == of_s1
