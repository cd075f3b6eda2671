"""Targets that a word on the command line can mean."""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app import http
from app.exits import Failure
from app.targets import NamedTarget, numbered
from tests.app.fake_gateway import FakeGateway, always, plant

IDS = st.from_regex("[a-z][a-z0-9-]{0,31}", fullmatch=True)


@given(IDS, st.integers(0x00, 0x9F), st.booleans())
def test_a_number_is_a_body_below_80_and_a_group_from_there_on(line: str, number: int, upper: bool) -> None:
    word = f"{line}.{number:02x}"
    target = numbered(word.upper() if upper else word)
    assert target == NamedTarget("groups" if number >= 0x80 else "bodies", f"{line}.{number:02X}")


@pytest.mark.parametrize("word", ["", "r1", "lift", "3", "3F0", "a.b.3F", "r1/units/1", "F3", ".3F", "٣F"])
def test_everything_else_has_no_number(word: str) -> None:
    assert numbered(word) is None


def test_a_robot_with_one_unit_needs_no_number_of_it() -> None:
    assert NamedTarget("robots", "r1", None, (3,)).unit_path() == "/robots/r1/units/3"
    assert NamedTarget("robots", "r1", 2, (1, 2)).unit_path() == "/robots/r1/units/2"
    with pytest.raises(Failure, match="several units"):
        NamedTarget("robots", "r1", None, (1, 2)).unit_path()


def completed(monkeypatch: pytest.MonkeyPatch, gateway: FakeGateway, *words: str) -> list[str]:
    """Completions that bash gets for the last of some words."""
    line = " ".join(("motion-gateway", *words))
    environment = {"COMP_WORDS": line, "COMP_CWORD": str(len(words)), "_TYPER_COMPLETE_TESTING": "1"}
    said = gateway.run(monkeypatch, _ROOT_COMPLETE="complete_bash", **environment)
    return said.stdout.split()


def test_addresses_and_names_are_completed(monkeypatch: pytest.MonkeyPatch) -> None:
    gateway = FakeGateway(plant(b3F="arm", b02="left rail"))
    assert completed(monkeypatch, gateway, "move", "a") == ["a.3F", "arm", "a.02", "a.80"]


def test_units_of_a_robot_have_addresses(monkeypatch: pytest.MonkeyPatch) -> None:
    found = completed(monkeypatch, FakeGateway(plant()), "send", "r1")
    assert found == ["r1", "r1/units/1", "r1/units/2"]


def test_without_a_gateway_nothing_is_completed(monkeypatch: pytest.MonkeyPatch) -> None:
    assert completed(monkeypatch, always(http.NotReached("refused")), "stop", "a") == []


@pytest.mark.parametrize("by_option", [True, False])
def test_the_key_is_read_from_its_file(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, *, by_option: bool
) -> None:
    file = tmp_path / "key"
    file.write_text("mg_1_secret")
    gateway = FakeGateway(plant(b3F="arm"))
    if by_option:
        found = completed(monkeypatch, gateway, "stop", "--key-file", str(file), "ar")
    else:
        monkeypatch.setenv("MOTION_GATEWAY_KEY_FILE", str(file))
        found = completed(monkeypatch, gateway, "stop", "ar")
    assert found == ["arm"]
    assert {request.headers["Authorization"] for request in gateway.asked} == {"Bearer mg_1_secret"}
