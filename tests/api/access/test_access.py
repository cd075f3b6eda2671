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


async def signed_in(stand: Stand, keys: Keys) -> dict[str, str]:
    """The headers of a page whose browser has signed in."""
    grant = keys.credentials.verify(keys.of("viewer"))
    assert grant is not None
    sessions = stand.app.access.sessions
    session = sessions.begin(grant)
    own = {"origin": f"http://{HOST}", "sec-fetch-site": "same-origin"}
    return {"session-proof": str(sessions.new_proof(session)), "cookie": f"mg-session={session}", **own}


@guarded()
async def test_a_stream_opened_by_a_ticket_ends_with_the_session_that_asked_for_it(
    stand: Stand, keys: Keys
) -> None:
    page = await signed_in(stand, keys)
    first, second = [(await stand.post("/tickets", **page)).json()["ticket"] for _ in range(2)]
    by_key = (await stand.post("/tickets", **keys.header("viewer"))).json()["ticket"]
    async with (
        socket(stand, f"/events?ticket={first}") as client,
        socket(stand, f"/events?ticket={by_key}") as other,
    ):
        assert (await client.message())["type"] == "websocket.accept"
        assert (await other.message())["type"] == "websocket.accept"
        await asyncio.sleep(3 * RECHECK_S)
        await stand.post("/sign-out", **page)
        while (message := await client.message())["type"] == "websocket.send":
            pass
        assert (message["type"], message["code"]) == ("websocket.close", CLOSE_NOT_AUTHENTICATED)
        await asyncio.sleep(3 * RECHECK_S)
        assert not other.task.done()
    async with socket(stand, f"/events?ticket={second}") as late:
        assert (await late.message())["status"] == 401


@guarded()
async def test_a_ticket_opens_the_trace_of_a_line_once_and_within_its_scope(stand: Stand, keys: Keys) -> None:
    async def opened(line: str, *scope: str, ticket: str = "") -> object:
        shown = ticket or (await stand.post("/tickets", **keys.header("viewer", *scope))).json()["ticket"]
        async with socket(stand, f"/lines/{line}/trace/stream?last=1&ticket={shown}") as client:
            head = await client.message()
            return head.get("status", head["type"])

    one = (await stand.post("/tickets", **keys.header("viewer"))).json()["ticket"]
    assert await opened("arm", ticket=one) == "websocket.accept"
    assert await opened("arm", ticket=one) == 401
    assert await opened("arm", "arm") == "websocket.accept"
    assert await opened("leg", "arm") == 403


def test_without_a_key_no_path_is_told_from_another_nor_logged_each_time(
    caplog: pytest.LogCaptureFixture,
) -> None:
    caplog.set_level(logging.INFO)

    @guarded()
    async def story(stand: Stand, keys: Keys) -> None:
        caplog.clear()
        for number in range(200):
            assert (await stand.get(f"/wp-login/{number}")).status_code == 401
            assert (await stand.post("/livez")).status_code == 405
        async with socket(stand, "/nowhere") as client:
            assert (await client.message())["status"] == 401
        assert len([it for it in caplog.records if it.name.startswith("api.")]) < 20  # one a second
        found = await stand.get("/bodeis", **keys.header("viewer", "arm"))
        assert (found.status_code, "did you mean bodies?" in found.text) == (404, True)
        assert "GET /bodeis refused with 404" in caplog.text

    story()


@guarded()
async def test_a_key_for_a_part_is_told_of_no_other_by_what_is_ambiguous_or_not_there(
    stand: Stand, keys: Keys
) -> None:
    header = keys.header("operator", "leg")
    for path in ("/bodies/00/moves", "/bodies/00/stop", "/bodies/00/position"):
        asking = stand.get if path.endswith("position") else stand.post
        answer = await asking(path, **header)
        assert (answer.status_code, "arm" in answer.text) == (409, False), answer.text
    assert "arm.00, leg.00" in (await stand.post("/bodies/00/stop", **keys.header("operator"))).text
    for path in ("/bodies/77/stop", "/groups/9E/stop", "/robots/r9/stop", "/scaras/s9/stop", "/lines/x/stop"):
        answer = await stand.post(path, **header)
        assert (answer.status_code, "arm" in answer.text) == (404, False), answer.text


@guarded()
async def test_readiness_names_the_lines_of_the_key_and_none_without(stand: Stand, keys: Keys) -> None:
    stand.ports["arm"].unplug()
    for header, lines, told in (
        ({}, {}, "Not every line can be used."),
        ({"authorization": "Bearer mg_0_0"}, {}, "Not every line can be used."),
        (keys.header("viewer", "leg"), {"leg": "ready"}, "Not every line can be used."),
        (keys.header("viewer"), {"arm": "down", "leg": "ready"}, "Not every line can be used: arm is down."),
    ):
        answer = await stand.get("/readyz", **header)
        assert (answer.status_code, answer.json()["lines"], answer.json()["detail"]) == (503, lines, told)


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
        stand.app.access._told_at = -10.0
        await stand.get("/bodies", authorization="Bearer mg_0_secret", host=HOST)

    story()
    assert "refused requests: 1; the last: GET '/bodies'" in caplog.text


@guarded()
async def test_a_refusal_is_logged_without_the_key(stand: Stand, keys: Keys) -> None:
    access = stand.app.access
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
