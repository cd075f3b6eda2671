"""A browser signs in with a key and goes on with a session."""

import pytest

from tests.api.access.guarded import Keys, guarded
from tests.api.stand import HOST, RELATIVE, Stand, on_stand, socket

OWN = {"origin": f"http://{HOST}", "sec-fetch-site": "same-origin"}
FORM = {"content-type": "application/x-www-form-urlencoded"}


async def sign_in(stand: Stand, key: str, following: str = "", **headers: str) -> tuple[int, str, str]:
    """The status, the place to go on and the cookie."""
    content = f"key={key}&next={following}".encode()
    answer = await stand.client.post("/sign-in", content=content, headers={**OWN, **FORM, **headers})
    return answer.status_code, answer.headers.get("location", ""), answer.headers.get("set-cookie", "")


async def proof_of(stand: Stand, place: str, **session: str) -> dict[str, str]:
    """The second secret of a session, which the console takes by the place that it was sent to."""
    claim = place.partition("?claim=")[2]
    answer = await stand.post(f"/sign-in/{claim}", **{**session, **OWN})
    assert (answer.status_code, answer.headers["cache-control"]) == (200, "no-store")
    return {"session-proof": answer.json()["proof"]}


async def page_of(stand: Stand, key: str) -> dict[str, str]:
    """The headers that a console sends whose browser has signed in."""
    _, place, cookie = await sign_in(stand, key)
    stand.client.cookies.clear()
    session = {"cookie": cookie.partition(";")[0]}
    return {**session, **OWN, **await proof_of(stand, place, **session)}


@guarded()
async def test_a_cookie_seen_at_another_port_of_the_host_reads_and_moves_nothing(
    stand: Stand, keys: Keys
) -> None:
    page = await page_of(stand, keys.of("admin"))
    other = await page_of(stand, keys.of("admin"))
    stolen = {name: page[name] for name in ("cookie", *OWN)}
    for told in ({}, {"session-proof": ""}, {"session-proof": "x" * 43}, {**other, "cookie": page["cookie"]}):
        thief = {**stolen, **told}
        for path in ("/bodies", "/bodies/arm.3F/position", "/metrics", "/system/identity", "/no-such-path"):
            refused = await stand.get(path, **thief)
            assert (refused.status_code, refused.json()["moved"]) == (401, "no"), path
            assert "second secret" in refused.json()["detail"]
        for path in ("/bodies/arm.3F/moves", "/tickets", "/pendant/arm.3F", "/leases", "/access/keys"):
            assert (await stand.post(path, RELATIVE, **thief)).status_code == 401, path
        async with socket(stand, "/events", headers=thief) as client:
            assert (await client.message())["status"] == 401
    typed_in = {**stolen, "sec-fetch-site": "none", "sec-fetch-mode": "navigate"}
    assert (await stand.get("/bodies", **typed_in)).status_code == 401  # and no way round by signing in again
    assert stand.moved() == []
    for path in ("/", "/docs", "/openapi.json"):
        assert (await stand.get(path, **stolen)).status_code == 200, path
    assert (await stand.get("/bodies", **page)).status_code == 200
    assert (await stand.post("/bodies/arm.3F/moves", RELATIVE, **page)).status_code == 202
    assert (await stand.post("/bodies/arm.3F/stop", **stolen)).status_code == 200  # no stop is ever lost


@guarded()
async def test_the_second_secret_is_given_once_to_the_session_that_has_begun(
    stand: Stand, keys: Keys
) -> None:
    _, place, cookie = await sign_in(stand, keys.of("operator"))
    stand.client.cookies.clear()
    mine, claim = {"cookie": cookie.partition(";")[0], **OWN}, place.partition("?claim=")[2]
    proof = await proof_of(stand, place, **mine)
    assert (await stand.post(f"/sign-in/{claim}", **mine)).status_code == 401
    assert (await stand.get("/bodies", **mine, **proof)).status_code == 200
    assert proof["session-proof"] not in repr(stand.app.access.sessions.__dict__)
    for cookie_of_another in ({}, mine):
        _, place, _ = await sign_in(stand, keys.of("operator"))
        stand.client.cookies.clear()
        claim = place.partition("?claim=")[2]
        assert (await stand.post(f"/sign-in/{claim}", **{**OWN, **cookie_of_another})).status_code == 401
    _, place, cookie = await sign_in(stand, keys.of("operator"))
    stand.client.cookies.clear()
    foreign = {"cookie": cookie.partition(";")[0], "origin": "http://127.0.0.1:3000"}
    assert (await stand.post(f"/sign-in/{place.partition('?claim=')[2]}", **foreign)).status_code == 403


@guarded()
async def test_somebody_signs_in_uses_the_pages_and_signs_out(stand: Stand, keys: Keys) -> None:
    status, place, cookie = await sign_in(stand, keys.of("operator"), "/redoc")
    assert (status, place) == (303, "/redoc")
    assert {"HttpOnly", "SameSite=strict", "Path=/"} <= set(cookie.split("; "))
    assert "Secure" not in cookie
    assert keys.of("operator") not in cookie
    stand.client.cookies.clear()
    session = {"cookie": cookie.partition(";")[0]}
    assert (await stand.get("/bodies", **session)).status_code == 401  # no console has asked for its secret
    typed_in = {**session, "sec-fetch-site": "none", "sec-fetch-mode": "navigate"}
    for path in ("/docs", "/openapi.json", "/static-offline-docs/swagger-ui.css"):
        assert (await stand.get(path, **typed_in)).status_code == 200, path
    page = await page_of(stand, keys.of("operator"))
    moved = await stand.post("/bodies/arm.3F/moves", RELATIVE, **page)
    assert moved.status_code not in (401, 403)
    assert (await stand.post("/groups/82", RELATIVE, **page)).status_code == 405
    async with socket(stand, "/events", headers=page) as client:
        assert (await client.message())["type"] == "websocket.accept"
    assert "Sign out" in (await stand.get("/sign-in", **session)).text
    out = await stand.post("/sign-out", **session, **OWN)
    assert (out.status_code, out.headers["location"]) == (303, "/sign-in")
    assert (await stand.get("/docs", **session)).status_code == 401


@guarded()
async def test_a_session_ends_with_its_key(stand: Stand, keys: Keys) -> None:
    token = keys.store.create("hanako", "viewer")  # type: ignore[arg-type]  # a role's word
    session = await page_of(stand, token)
    assert (await stand.get("/bodies", **session)).status_code == 200
    keys.store.revoke("hanako")
    assert (await stand.get("/bodies", **session)).status_code == 401


@pytest.mark.parametrize("key", ["", "wrong", "mg_0_0", "%ff%00", "x" * 5000])
def test_a_bad_key_begins_no_session(key: str) -> None:
    @guarded()
    async def story(stand: Stand, keys: Keys) -> None:
        status, place, cookie = await sign_in(stand, key)
        assert (status, place, cookie) == (401, "", "")

    story()


@guarded()
async def test_forms_of_other_pages_and_other_types_sign_nobody_in(stand: Stand, keys: Keys) -> None:
    for headers in ({"origin": "http://evil.example"}, {"host": "evil.example"}):
        assert (await sign_in(stand, keys.of("admin"), **headers))[0] == 403
    assert (await sign_in(stand, keys.of("admin"), **{"content-type": "text/plain"}))[0] == 401
    assert (await sign_in(stand, "x" * 20_000))[0] == 413


@pytest.mark.parametrize(
    "place",
    [
        "//evil.example",
        "https://evil.example",
        "/%5Cevil.example",
        "javascript:alert(1)",
        "/a%0d%0ax:y",
        "evil",
        "",
    ],
)
def test_no_link_leads_away(place: str) -> None:
    @guarded()
    async def story(stand: Stand, keys: Keys) -> None:
        assert (await sign_in(stand, keys.of("viewer"), place))[1].startswith("/?claim=")
        assert 'value="/"' in (await stand.get(f"/sign-in?next={place}")).text

    story()


@guarded()
async def test_the_page_speaks_both_languages_and_runs_nothing(stand: Stand, keys: Keys) -> None:
    english = await stand.get("/sign-in?next=/x%22%3E%3Cscript%3E")
    assert 'lang="en"' in english.text
    assert "<script" not in english.text
    assert "script" not in english.headers["content-security-policy"]
    assert english.headers["x-frame-options"] == "DENY"
    assert english.headers["cache-control"] == "no-store"
    japanese = await stand.get("/sign-in", **{"accept-language": "ja,en;q=0.5"})
    assert "サインイン" in japanese.text
    assert japanese.headers["content-language"] == "ja"


@guarded()
async def test_a_browser_without_a_session_is_shown_the_page(stand: Stand, keys: Keys) -> None:
    answer = await stand.get("/docs", **{"sec-fetch-mode": "navigate"})
    assert (answer.status_code, answer.headers["location"]) == (303, "/sign-in?next=%2Fdocs")
    assert (await stand.get("/docs")).status_code == 401


@guarded()
async def test_over_tls_the_cookie_is_for_this_host_alone(stand: Stand, keys: Keys) -> None:
    answer = await stand.client.post(
        f"https://{HOST}/sign-in",
        content=f"key={keys.of('viewer')}".encode(),
        headers={**FORM, "origin": f"https://{HOST}", "sec-fetch-site": "same-origin"},
    )
    cookie = answer.headers["set-cookie"]
    assert cookie.startswith("__Host-mg-session=")
    assert {"Secure", "HttpOnly", "Path=/"} <= set(cookie.split("; "))


@on_stand()
async def test_an_open_gateway_needs_no_session(stand: Stand) -> None:
    assert await sign_in(stand, "anything", "/redoc") == (303, "/redoc", "")
    assert (await stand.get("/docs")).status_code == 200


@guarded()
async def test_a_code_begins_one_session_that_is_about_its_target_only(stand: Stand, keys: Keys) -> None:
    lent = await stand.post("/pendant/arm.3F", **keys.header("admin"))
    assert lent.headers["cache-control"] == "no-store"
    path = f"/pendant?ticket={lent.json()['ticket']}"
    used = await stand.get(path)
    assert (used.status_code, used.headers["location"][:9]) == (303, "./?claim=")
    cookie = {"cookie": used.headers["set-cookie"].partition(";")[0], **OWN}
    stand.client.cookies.clear()
    session = {**cookie, **await proof_of(stand, used.headers["location"], **cookie)}
    who = (await stand.get("/system/identity", **session)).json()
    assert (who["role"], who["scope"]) == ("setup", ["arm.3F"])
    assert (await stand.post("/bodies/arm.3F/moves", RELATIVE, **session)).status_code == 202
    assert (await stand.post("/bodies/arm.01/moves", RELATIVE, **session)).status_code == 403
    assert (await stand.get("/access/keys", **session)).status_code == 403
    again = await stand.get(path)
    assert (again.status_code, "set-cookie" in again.headers) == (401, False)
    assert "used before" in again.text


@pytest.mark.parametrize(("role", "scope"), [("viewer", ()), ("operator", ("leg",))])
def test_a_code_is_for_who_may_move_the_target(role: str, scope: tuple[str, ...]) -> None:
    @guarded()
    async def story(stand: Stand, keys: Keys) -> None:
        assert (await stand.post("/pendant/arm.3F", **keys.header(role, *scope))).status_code == 403

    story()


@guarded()
async def test_the_session_of_a_code_ends_with_the_key_of_who_has_shown_it(stand: Stand, keys: Keys) -> None:
    key = keys.store.create("hanako", "operator")  # type: ignore[arg-type]  # a role's word
    lent = await stand.post("/pendant/arm.3F", authorization=f"Bearer {key}")
    used = await stand.get(f"/pendant?ticket={lent.json()['ticket']}")
    session = {"cookie": used.headers["set-cookie"].partition(";")[0]}
    stand.client.cookies.clear()
    assert (await stand.get("/docs", **session)).status_code == 200
    keys.store.revoke("hanako")
    assert (await stand.get("/docs", **session)).status_code == 401
