"""Sign-in and rights: the gateway's verdict, in OPC UA's words."""

import re
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

from tests.bridges.opcua.stand import Bridge, Client, ClientError, Plant, client_of
from tests.e2e.processes import until


def test_offers_encrypted_endpoints_alone_and_no_anonymous_one(bridge: Bridge, client: Client) -> None:
    found = client.tell("endpoints", url=bridge.url)
    assert {(it["policy"], it["mode"]) for it in found} == {
        ("Basic256Sha256", "SignAndEncrypt"),
        ("Aes256_Sha256_RsaPss", "SignAndEncrypt"),
    }
    assert {token for it in found for token in it["tokens"]} == {"UserName"}


@pytest.mark.parametrize("policy", ["Basic256Sha256", "Aes256_Sha256_RsaPss"])
def test_a_good_key_gets_in(bridge: Bridge, client: Client, policy: str) -> None:
    client.connect(bridge, policy=policy)
    assert client.read("line1.3F.Online")[0]["value"] is True


@pytest.mark.parametrize(
    ("told", "why"),
    [
        ({"user": None}, "Identity|Anonymous|user"),
        ({"password": "wrong"}, "BadUserAccessDenied"),
        ({"password": ""}, "BadUserAccessDenied"),
        ({"user": "viewer"}, "BadUserAccessDenied"),
        ({"user": "nobody"}, "BadUserAccessDenied"),
        ({"policy": "None", "mode": "None"}, "."),
        ({"mode": "Sign"}, "."),
        ({"policy": "Aes128_Sha256_RsaOaep"}, "."),
    ],
)
def test_all_else_does_not(bridge: Bridge, client: Client, told: dict[str, Any], why: str) -> None:
    given = {"user": "mes", "password": bridge.plant.secrets["mes"], **told}
    if given["user"] is None:
        del given["user"]
    with pytest.raises(ClientError, match=why):
        client.tell("connect", url=bridge.url, **given)


def turned_away(bridge: Bridge) -> set[Path]:
    """The certificates that the log says how to trust."""
    return set(map(Path, re.findall(r"if you trust it: cp (\S+) ", bridge.program.words())))


def test_a_client_that_is_not_trusted_is_turned_away_and_can_be_trusted_then(
    bridge: Bridge, tmp_path: Path
) -> None:
    before = turned_away(bridge)
    with client_of(tmp_path, None) as stranger:
        with pytest.raises(ClientError):
            stranger.connect(bridge)
        (rejected,) = until(lambda: turned_away(bridge) - before, "the way to trust it")
        (bridge.trusted / rejected.name).write_bytes(rejected.read_bytes())
        stranger.connect(bridge)


MOVE, STOP, READ = "move", "stop", "read"
MATRIX = {
    "viewer": {MOVE: "BadUserAccessDenied", STOP: "Good", READ: "Good"},
    "mes": {MOVE: "Good", STOP: "Good", READ: "Good"},
    "setup": {MOVE: "Good", STOP: "Good", READ: "Good"},
    "admin": {MOVE: "Good", STOP: "Good", READ: "Good"},
    "of-00": {MOVE: "BadUserAccessDenied", STOP: "Good", READ: "BadUserAccessDenied"},
}


@pytest.mark.parametrize("name", MATRIX)
def test_rights_are_those_of_the_key(bridge: Bridge, client: Client, plant: Plant, name: str) -> None:
    client.connect(bridge, name)
    assert client.move("line1.3F", 10)["status"] == MATRIX[name][MOVE]
    assert client.call("line1.3F", "Stop")["status"] == MATRIX[name][STOP]
    assert client.read("line1.3F.Online")[0]["status"] == MATRIX[name][READ]
    with plant.as_(plant.secrets[name]) as http:
        assert http.get("/bodies/line1.3F").is_success == (MATRIX[name][READ] == "Good")


def test_a_scope_hides_what_it_does_not_cover(bridge: Bridge, client: Client) -> None:
    client.connect(bridge, "of-00")
    assert client.read("line1.00.Online")[0]["value"] is True
    axes = {it["name"] for it in client.tell("browse", node="line1.MotionDevices.line1.Axes")}
    assert axes == {"00"}
    assert "line1" in _devices(client), "the way to it"
    assert client.move("line1.00", 10)["status"] == "Good"


def _devices(client: Client) -> set[str]:
    namespaces = client.tell("read", nodes=["i=2255"])[0]["value"]
    devices = f"ns={namespaces.index('http://opcfoundation.org/UA/DI/')};i=5001"
    return {it["name"] for it in client.tell("browse", node=devices)}


def test_nothing_moves_by_a_write(bridge: Bridge, client: Client, plant: Plant) -> None:
    client.connect(bridge, "admin")
    before = len(plant.moves())
    for node, type_, value in (
        ("line1.3F.ActualPosition", "Double", 1000.0),
        ("line1.3F.MoveId", "String", "x"),
        ("i=2267", "Byte", 0),
    ):
        assert client.tell("write", node=node, type=type_, value=value) == "BadNotWritable"
    assert len(plant.moves()) == before


def test_a_revoked_key_ends_its_session(bridge: Bridge, client: Client, plant: Plant) -> None:
    secret = plant.key("leaving")
    client.tell("connect", url=bridge.url, user="leaving", password=secret)
    assert client.read("line1.3F.Online")[0]["status"] == "Good"
    plant.http.delete("/access/keys/leaving").raise_for_status()
    assert _ends(client)


@pytest.mark.prove
def test_an_expired_key_ends_its_session_and_moves_nothing_before(
    bridge: Bridge, client: Client, plant: Plant
) -> None:
    secret = plant.key("brief", expires_s=3)
    client.tell("connect", url=bridge.url, user="brief", password=secret)
    time.sleep(3.5)  # keys end by the clock
    before = len(plant.moves())
    with suppress(ClientError):  # where its session has ended already
        assert client.move("line1.3F", 10)["status"] == "BadUserAccessDenied"
    assert len(plant.moves()) == before
    assert _ends(client)


def _ends(client: Client) -> bool:
    def look() -> bool:
        try:
            client.read("line1.3F.Online")
        except ClientError:
            return True
        return False

    return until(look, "the session ends")
