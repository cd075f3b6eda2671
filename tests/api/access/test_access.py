"""The door in daily use: keys and scopes, limits, streams that end with their key, and names in the trace."""

import asyncio
import logging

import pytest

from api.common.access import CLOSE_NOT_AUTHENTICATED, RECHECK_S
from tests.api.access.guarded import Keys, guarded
from tests.api.stand import HOST, RELATIVE, Stand, socket


@guarded()
async def test_a_gateway_without_a_key_is_alive_and_nothing_else(stand: Stand, keys: Keys) -> None:
    for path in ("/livez", "/readyz", "/version", "/sign-in"):
        assert (await stand.get(path)).status_code == 200, path
    answer = await stand.get("/bodies")
    assert answer.status_code == 401
    assert answer.headers["www-authenticate"].startswith("Bearer")
    assert answer.headers["content-type"] == "application/problem+json"
    assert answer.json()["type"].endswith(":not-authenticated")
    assert (await stand.get("/livez", authorization="Bearer wrong")).status_code == 200


@guarded()
async def test_a_key_that_was_good_a_moment_ago_stands_for_no_other_header(stand: Stand, keys: Keys) -> None:
    good = keys.header("viewer")["authorization"]
    for shown, status in (([good], 200), ([good, good], 401), ([f"{good}x"], 401), ([good], 200)):
        headers = [("authorization", it) for it in shown]
        assert (await stand.client.get("/bodies", headers=headers)).status_code == status, shown


@guarded()
async def test_lists_show_what_the_scope_covers(stand: Stand, keys: Keys) -> None:
    async def listed(what: str, name: str, *scope: str) -> list[str]:
        answer = await stand.get(f"/{what}", **keys.header("viewer", *scope))
        assert answer.status_code == 200
        return [it[name] for it in answer.json()[what]]

    assert len(await listed("bodies", "body_id")) == 5
    assert await listed("bodies", "body_id", "leg") == ["leg.00", "leg.70"]
    assert await listed("bodies", "body_id", "arm.80") == ["arm.01", "arm.3F"]
    assert await listed("groups", "group_id", "arm.01", "leg") == ["leg.81"]
    assert await listed("lines", "line_id", "arm.3F", "leg") == ["leg"]
    assert await listed("robots", "robot_id", "arm") == []


@guarded()
async def test_frames_are_written_in_the_name_of_the_key(stand: Stand, keys: Keys) -> None:
    await stand.get("/bodies/arm.3F/position", **keys.header("operator", "arm"))
    entries = (await stand.get("/lines/arm/trace", **keys.header("viewer"))).json()["entries"]
    assert [it["caller"] for it in entries if "6PD" in it["data"] and it["kind"] == "tx"][-1:] == [
        "operator-arm (http 127.0.0.1)"
    ]


@guarded()
async def test_a_group_is_defined_by_who_may_set_up_all_its_members(stand: Stand, keys: Keys) -> None:
    members = {"members": ["arm.00", "arm.3F"]}
    for key, status in (("leg", 403), ("arm.00", 403), ("arm", 200)):
        answer = await stand.client.put("/groups/arm.85", json=members, headers=keys.header("setup", key))
        assert answer.status_code == status, key
    foreign = {"members": ["leg.00", "leg.70"]}
    answer = await stand.client.put("/groups/arm.86", json=foreign, headers=keys.header("setup", "arm"))
    assert answer.status_code == 403


def test_a_refusal_names_the_key_in_the_log(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO)

    @guarded({"moves_per_key_and_s": 1})
    async def story(stand: Stand, keys: Keys) -> None:
        caplog.clear()
        for body in ("77", "3F"):  # there is none; the key has had its move of this second
            await stand.post(f"/bodies/{body}/moves", RELATIVE, **keys.header("operator"))
        facts = [record.__dict__["facts"] for record in caplog.records if " refused with " in record.message]
        assert [it["caller"].partition(" (")[0] for it in facts] == ["operator", "operator"]

    story()


@guarded({"requests_per_key": 2, "moves_per_key_and_s": 3, "subscribers_per_key": 1})
async def test_a_key_at_its_limits_still_stops_and_others_go_on(stand: Stand, keys: Keys) -> None:
    key, other = keys.header("operator", "arm"), keys.header("operator")
    statuses = [(await stand.post("/bodies/arm.3F/moves", RELATIVE, **key)).status_code for _ in range(4)]
    assert statuses[-1] == 503
    assert 503 not in statuses[:-1]
    refused = await stand.post("/bodies/arm.3F/moves", RELATIVE, **key)
    assert refused.headers["retry-after"]
    assert refused.json()["type"].endswith(":limit-reached")
    assert (refused.json()["moved"], refused.json()["retryable"]) == ("no", True)
    assert (await stand.post("/bodies/arm.3F/stop", **key)).status_code == 200
    assert (await stand.post("/bodies/arm.00/moves", RELATIVE, **other)).status_code != 503
    events = "/events?bodies=arm.3F"
    async with socket(stand, events, headers=key) as first:
        assert (await first.message())["type"] == "websocket.accept"
        async with socket(stand, events, headers=key) as second:
            assert (await second.message())["status"] == 503
        async with socket(stand, events, headers=other) as third:
            assert (await third.message())["type"] == "websocket.accept"
        stops = await asyncio.gather(*(stand.post("/stop", **key) for _ in range(20)))
        assert {stop.status_code for stop in stops} == {200}
    async with socket(stand, events, headers=key) as again:
        assert (await again.message())["type"] == "websocket.accept"


@guarded()
async def test_a_key_for_a_part_is_not_told_the_names_of_the_rest(stand: Stand, keys: Keys) -> None:
    for query in ("leg", "leg.99"):
        answer = await stand.get(f"/events?bodies={query}", **keys.header("viewer", "leg"))
        assert answer.status_code == 422
        assert "arm" not in answer.text
    assert "arm.3F" in (await stand.get("/events?bodies=leg.99", **keys.header("viewer"))).text


@guarded()
async def test_a_stream_ends_with_its_key(stand: Stand, keys: Keys) -> None:
    token = keys.store.create("dashboard", "viewer")  # type: ignore[arg-type]  # a role's word
    header = {"authorization": f"Bearer {token}"}
    async with socket(stand, "/events", headers=header) as client:
        assert (await client.message())["type"] == "websocket.accept"
        await asyncio.sleep(3 * RECHECK_S)
        stream = asyncio.create_task(stand.get("/events/stream", **header))
        await asyncio.sleep(1)
        assert not stream.done()
        keys.store.revoke("dashboard")
        while (message := await client.message())["type"] == "websocket.send":
            pass
        assert (message["type"], message["code"]) == ("websocket.close", CLOSE_NOT_AUTHENTICATED)
        await asyncio.sleep(RECHECK_S)
        assert stream.done()
    assert (await stand.get("/bodies", **header)).status_code == 401


@pytest.mark.parametrize("name", ["authorization", "cookie"])
def test_two_credentials_are_none(name: str) -> None:
    @guarded()
    async def story(stand: Stand, keys: Keys) -> None:
        good = f"Bearer {keys.of('admin')}".encode()
        headers = [(name.encode(), good), (name.encode(), good)]
        assert (await stand.client.get("/bodies", headers=headers)).status_code == 401

    story()


def test_refusals_are_counted_in_the_log(caplog: pytest.LogCaptureFixture) -> None:
    @guarded()
    async def story(stand: Stand, _: Keys) -> None:
        stand.app.state.access._told_at = -10.0
        await stand.get("/bodies", authorization="Bearer mg_0_secret", host=HOST)

    story()
    assert "refused requests: 1; the last: GET '/bodies'" in caplog.text


@guarded()
async def test_a_refusal_is_logged_without_the_key(stand: Stand, keys: Keys) -> None:
    access = stand.app.state.access
    access._told_at = -10.0
    await stand.get("/bodies", authorization="Bearer mg_0_secret", host=HOST)
    assert access._refused == 0
    await stand.get("/bodies", authorization="Bearer mg_0_secret", host=HOST)
    assert access._refused == 1


@guarded({"lease_mode": "required", "requests_per_key": 1})
async def test_refusals_are_told_in_japanese_to_who_asks_so(stand: Stand, keys: Keys) -> None:
    move, ja = "/bodies/arm.3F/moves", {"accept-language": "ja"}
    operator = keys.header("operator")
    asked = [
        (401, stand.post(move, RELATIVE, **ja)),
        (401, stand.post(move, RELATIVE, authorization="Bearer mg_0_0", **ja)),
        (401, stand.post(move, RELATIVE, authorization="Basic x", **ja)),
        (403, stand.post(move, RELATIVE, **keys.header("viewer"), **ja)),
        (403, stand.post(move, RELATIVE, **keys.header("operator", "leg"), **ja)),
        (403, stand.get("/metrics", **keys.header("viewer", "arm"), **ja)),
        (409, stand.post(move, RELATIVE, **operator, **ja)),
        (409, stand.post(move, RELATIVE, **operator, **ja, **{"lease-token": "7"})),
    ]
    for status, answering in asked:
        answer = await answering
        assert answer.status_code == status
        assert answer.headers["content-language"] == "ja"
        assert "送信していません" in answer.json()["detail"]
        assert answer.json()["title"].endswith(("です", "ません"))
