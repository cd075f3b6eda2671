"""Leases from the command line: taken, held, listed, given back."""

import pytest

from tests.app.fake_gateway import Answer, FakeGateway, interrupted_at, plant

TAKEN = {"lease": "lease-7", "scope": "a.3F", "ttl_s": 30.0, "token": 12}
LISTED = {"leases": [{**TAKEN, "holder": "ann", "expires_in_s": 9.96}]}


def gateway(**answers: object) -> FakeGateway:
    lines: list[Answer] = [(200, {"lines": [{"line_id": "a"}]})]
    told: dict[str, list[Answer]] = {f"/{name}": [(200, answer)] for name, answer in answers.items()}
    return FakeGateway(plant(b3F="lift") | {"/lines": lines} | told)


@pytest.mark.parametrize(
    ("word", "scope"), [("3f", "3F"), ("lift", "a.3F"), ("a", "a"), ("80", "80"), ("r1/units/1", "r1")]
)
def test_the_token_of_a_lease_is_printed_alone(
    monkeypatch: pytest.MonkeyPatch, word: str, scope: str
) -> None:
    plant = gateway(leases=TAKEN)
    said = plant.run(monkeypatch, "lease", "take", word, "--ttl", "5")
    assert (said.exit_code, said.stdout) == (0, "12\n")
    assert "export MOTION_GATEWAY_LEASE=12" in said.stderr
    assert plant.posted == [("/leases", {"scope": scope, "ttl_s": 5.0, "take_over": False})]


def test_a_lease_is_held_until_ctrl_c_and_given_back(monkeypatch: pytest.MonkeyPatch) -> None:
    plant = gateway(leases=TAKEN, **{"leases/lease-7": TAKEN, "leases/lease-7/renew": TAKEN})
    slept = interrupted_at(monkeypatch, 3)
    said = plant.run(monkeypatch, "lease", "take", "3F", "--hold")
    assert said.exit_code == 0, said.output
    assert slept == [10.0, 10.0, 10.0]
    asked = [
        (request.method, request.path, request.headers.get("Lease-Token")) for request in plant.asked[-3:]
    ]
    assert asked == [
        ("POST", "/leases/lease-7/renew", "12"),
        ("POST", "/leases/lease-7/renew", "12"),
        ("DELETE", "/leases/lease-7", "12"),
    ]


def test_who_has_leased_what_is_a_table(monkeypatch: pytest.MonkeyPatch) -> None:
    said = gateway(leases=LISTED).run(monkeypatch, "lease", "list")
    assert said.stdout.splitlines() == ["LEASE    SCOPE  HOLDER  LASTS", "lease-7  a.3F   ann     10.0 s"]


@pytest.mark.parametrize("word", ["lease-7", "a.3F", "3F", "lift"])
def test_a_lease_is_given_back_by_its_id_or_by_what_is_leased(
    monkeypatch: pytest.MonkeyPatch, word: str
) -> None:
    plant = gateway(leases=LISTED, **{"leases/lease-7": TAKEN})
    said = plant.run(monkeypatch, "lease", "release", word)
    assert (said.exit_code, said.stdout) == (0, "lease-7 of a.3F is given back.\n")
    assert (plant.asked[-1].method, plant.asked[-1].path) == ("DELETE", "/leases/lease-7")


def test_what_is_not_leased_is_not_given_back(monkeypatch: pytest.MonkeyPatch) -> None:
    plant = gateway(leases=LISTED)
    said = plant.run(monkeypatch, "lease", "release", "02")
    assert said.exit_code == 2
    assert "Nothing was given back." in said.stderr


def test_a_move_shows_the_token_of_the_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    plant = gateway()
    plant.run(monkeypatch, "move", "3F", "home", MOTION_GATEWAY_LEASE="12")
    assert plant.asked[-1].headers["Lease-Token"] == "12"


def test_a_move_shows_the_epoch_of_the_owner_that_the_environment_has(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    plant = gateway()
    plant.run(monkeypatch, "move", "3F", "home", MOTION_GATEWAY_OWNER_EPOCH="2")
    assert plant.asked[-1].headers["Owner-Epoch"] == "2"
