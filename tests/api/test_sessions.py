"""Sessions over HTTP: an administrator sees and ends them, and no key ends those of another."""

from gateway.access.limits import Rates
from tests.api.access.guarded import Keys, guarded
from tests.api.stand import Stand
from tests.api.test_sign_in import page_of as session_of
from tests.api.test_sign_in import sign_in


@guarded()
async def test_a_thousand_sign_ins_with_one_key_end_nobody_else_s_session(stand: Stand, keys: Keys) -> None:
    operator = await session_of(stand, keys.of("operator"))
    statuses = [(await sign_in(stand, keys.of("viewer")))[0] for _ in range(1000)]
    stand.client.cookies.clear()
    assert statuses[:20] == 20 * [303]
    assert statuses[-1] == 503
    assert (await stand.get("/bodies", **operator)).status_code == 200
    assert (await stand.post("/bodies/arm.3F/stop", {"mode": "immediate"}, **operator)).status_code == 200


@guarded()
async def test_a_stop_from_a_page_whose_session_made_room_is_not_lost(stand: Stand, keys: Keys) -> None:
    stand.app.access.sign_ins = Rates(at_once=100, per_s=100.0)
    page = await session_of(stand, keys.of("viewer"))
    for _ in range(25):
        await session_of(stand, keys.of("viewer"))
    assert (await stand.get("/bodies", **page)).status_code == 401
    stop = "/bodies/arm.3F/stop", {"mode": "immediate"}
    assert (await stand.post(*stop, **page)).status_code == 200
    assert (await stand.post(*stop, **{**page, "origin": "http://evil.example"})).status_code == 403
    keys.store.revoke("viewer")
    assert (await stand.post(*stop, **page)).status_code == 401


@guarded()
async def test_an_administrator_lists_and_ends_sessions(stand: Stand, keys: Keys) -> None:
    admin = keys.header("admin")
    one = await session_of(stand, keys.of("operator"))
    two = await session_of(stand, keys.of("operator"))
    other = await session_of(stand, keys.of("viewer"))
    found = (await stand.get("/access/sessions", **admin)).json()["sessions"]
    assert [(it["name"], it["role"], it["address"]) for it in found] == [
        ("viewer", "viewer", "127.0.0.1"),
        *2 * [("operator", "operator", "127.0.0.1")],
    ]
    ended = await stand.client.delete(f"/access/sessions/{found[-1]['id']}", headers=admin)
    assert (ended.status_code, ended.json()["id"]) == (200, found[-1]["id"])
    assert (await stand.get("/bodies", **one)).status_code == 401
    assert (await stand.get("/bodies", **two)).status_code == 200
    again = await stand.client.delete(f"/access/sessions/{found[-1]['id']}", headers=admin)
    assert again.status_code == 404
    all_of_it = await stand.client.delete("/access/sessions?key=operator", headers=admin)
    assert [it["id"] for it in all_of_it.json()["sessions"]] == [found[1]["id"]]
    assert (await stand.get("/bodies", **two)).status_code == 401
    assert (await stand.get("/bodies", **other)).status_code == 200
    assert (await stand.get("/bodies", **keys.header("operator"))).status_code == 200  # the key stays good


@guarded()
async def test_only_an_administrator_of_the_whole_plant_does(stand: Stand, keys: Keys) -> None:
    for header in (keys.header("setup"), keys.header("admin", "arm")):
        assert (await stand.get("/access/sessions", **header)).status_code == 403
        assert (await stand.client.delete("/access/sessions?key=x", headers=header)).status_code == 403
