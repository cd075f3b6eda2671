"""The gateways of the plant, by what each says of itself."""

import json

import pytest

from fleet.registry import Registry


class Clock:
    now = 0.0

    def __call__(self) -> float:
        return self.now


def entry(name: str, url: str = "https://stocker1.example:8420") -> bytes:
    return json.dumps({"name": name, "url": url, "lines": ["line1"], "version": "1"}).encode()


def test_a_gateway_that_is_not_heard_is_called_so_with_its_age() -> None:
    registry = Registry(clock=(clock := Clock()))
    registry.note("$KV.gateways.stocker1", entry("stocker1"))
    (gateway,) = registry.all()
    assert registry.told(gateway)["state"] == "online"
    clock.now = 10.5
    assert (registry.told(gateway)["state"], registry.told(gateway)["heard_age_s"]) == ("unheard", 10.5)
    registry.heard("stocker1")
    assert registry.told(gateway)["state"] == "online"


@pytest.mark.parametrize(
    ("subject", "content"),
    [
        ("$KV.gateways.stocker2", entry("stocker1")),
        ("$KV.gateways.stocker1", entry("stocker1", "http://thief.example:8420")),
        ("$KV.gateways.stocker1", b"{"),
        ("$KV.gateways.stocker1", b""),
        ("$KV.gateways.x y", entry("x y")),
    ],
)
def test_an_entry_in_anothers_place_or_without_tls_is_left_unheeded(subject: str, content: bytes) -> None:
    registry = Registry()
    registry.note(subject, content)
    assert registry.all() == []


def test_an_address_of_the_configuration_counts_whatever_the_registry_says() -> None:
    registry = Registry({"stocker1": "https://stocker1.example:8420"})
    registry.note("$KV.gateways.stocker1", entry("stocker1", "https://thief.example:8420"))
    (gateway,) = registry.all()
    assert gateway.url == "https://stocker1.example:8420"


def test_a_gateway_that_was_only_named_was_never_heard() -> None:
    registry = Registry({"stocker1": "https://stocker1.example:8420"})
    (gateway,) = registry.all()
    assert registry.told(gateway)["heard_age_s"] is None
    assert registry.told(gateway)["state"] == "unheard"
