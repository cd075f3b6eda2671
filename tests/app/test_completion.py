"""Completion of the command line in a shell."""

from pathlib import Path

import pytest

from app import http
from tests.app.fake_gateway import FakeGateway, always, plant


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
