"""The gateways of a plant, by what each says of itself."""

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


def at(epoch: str, url: str = "https://stocker1.example:8420") -> bytes:
    return json.dumps({"name": "stocker1", "url": url, "cursor": f"{epoch}-000000000009"}).encode()


@pytest.mark.parametrize(
    "twin", [at("0000000b"), at("0000000a", "https://copy.example:8420")], ids=["same address", "another"]
)
def test_two_gateways_with_one_name_are_noticed_until_one_of_them_has_gone(twin: bytes) -> None:
    registry = Registry(clock=(clock := Clock()))
    for content in (at("0000000a"), twin, at("0000000a")):
        registry.note("$KV.gateways.stocker1", content)
        clock.now += 1
    assert "Two gateways call themselves stocker1" in (registry.conflict_of("stocker1") or "")
    assert registry.told(registry.all()[0])["conflict"]
    for _ in range(6):
        clock.now += 2
        registry.note("$KV.gateways.stocker1", at("0000000a"))
    assert registry.conflict_of("stocker1") is None


def test_a_gateway_that_was_started_anew_or_has_moved_is_no_other() -> None:
    registry = Registry(clock=(clock := Clock()))
    lives = [at("0000000a"), at("0000000a"), at("0000000b"), at("0000000b", "https://new.example:8420")]
    for content in (*lives, lives[-1]):
        registry.note("$KV.gateways.stocker1", content)
        clock.now += 1
    assert registry.conflict_of("stocker1") is None
