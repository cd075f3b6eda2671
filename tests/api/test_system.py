"""How open the gateway is, who asks, and tickets."""

from tests.api.access.guarded import Keys, guarded
from tests.api.stand import HOST, Stand, on_stand, socket


@guarded(raw_commands=True, allowed_origins=["http://panel.plant"])
async def test_the_posture_names_each_weakened_default(stand: Stand, keys: Keys) -> None:
    told = (await stand.get("/system/posture", **keys.header("admin"))).json()
    assert (told["access"], told["tls"], told["network"]) == ("keys", False, False)
    assert {it["setting"]: it["value"] for it in told["weakened"]} == {
        "server.raw_commands": "True",
        "server.allowed_origins": "http://panel.plant",
    }
    seen = (await stand.get("/system/posture", **keys.header("viewer", "leg"))).json()["weakened"]
    assert [it["setting"] for it in seen] == [it["setting"] for it in told["weakened"]]
    assert {it["value"] for it in seen} == {None}


@guarded({"moves_per_key_and_s": 21, "requests_per_key": 100}, max_connections=2000)
async def test_limits_are_weaker_when_they_are_higher(stand: Stand, keys: Keys) -> None:
    told = (await stand.get("/system/posture", **keys.header("admin"))).json()["weakened"]
    assert {it["setting"]: it["value"] for it in told} == {
        "server.max_connections": "2000",
        "access.moves_per_key_and_s": "21",
    }


@guarded()
async def test_the_defaults_are_not_weakened(stand: Stand, keys: Keys) -> None:
    assert (await stand.get("/system/posture", **keys.header("viewer"))).json()["weakened"] == []


@on_stand()
async def test_an_open_gateway_says_so_and_takes_tickets_too(stand: Stand) -> None:
    posture = (await stand.get("/system/posture")).json()
    assert [it["setting"] for it in posture["weakened"]] == ["access.mode"]
    ticket = (await stand.post("/tickets")).json()["ticket"]
    async with socket(stand, f"/events?ticket={ticket}", headers={"host": HOST}) as client:
        assert (await client.message())["type"] == "websocket.accept"
        await stand.post("/stop")
        assert (await client.event())["type"]


@guarded()
async def test_a_client_is_told_who_it_is(stand: Stand, keys: Keys) -> None:
    told = (await stand.get("/system/identity", **keys.header("operator", "arm"))).json()
    assert told == {
        "name": "operator-arm",
        "role": "operator",
        "rights": ["open", "view", "stop", "operate"],
        "scope": ["arm"],
    }
    assert (await stand.get("/system/identity")).status_code == 401


@on_stand()
async def test_where_no_key_is_needed_everybody_may_do_everything(stand: Stand) -> None:
    told = (await stand.get("/system/identity")).json()
    assert (told["name"], told["role"], told["scope"]) == ("everybody", "admin", None)
