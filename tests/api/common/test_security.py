"""Foreign web pages and foreign host names get nothing through, not even a stop."""

import pytest
from httpx2 import ASGITransport, AsyncClient

from api.common.security import SameSite
from tests.api.stand import HOST, RELATIVE, Stand, on_stand, socket


@pytest.mark.parametrize("host", ["127.0.0.1", "127.0.0.1:8420", "localhost:8420", "LOCALHOST", "[::1]:8420"])
def test_this_machines_own_names_are_welcome(host: str) -> None:
    @on_stand()
    async def story(stand: Stand) -> None:
        assert (await stand.get("/livez", host=host)).status_code == 200

    story()


@pytest.mark.parametrize(
    "host", ["evil.example", "127.0.0.1.evil.example", "localhost:x", "evil@localhost", ""]
)
def test_another_host_name_is_403_and_nothing_is_sent(host: str) -> None:
    @on_stand()
    async def story(stand: Stand) -> None:
        answer = await stand.post("/bodies/3F/moves", RELATIVE, host=host)
        assert answer.status_code == 403
        assert answer.json()["moved"] == "no"
        assert "allowed_hosts" in answer.json()["remedy"]
        assert stand.moved() == []

    story()


@on_stand(allowed_hosts=["Gateway.plant"])
async def test_a_configured_host_name_is_welcome(stand: Stand) -> None:
    assert (await stand.get("/livez", host="gateway.plant:8420")).status_code == 200


@pytest.mark.parametrize(
    "headers",
    [
        {"origin": "http://evil.example"},
        {"origin": "null"},
        {"origin": "http://127.0.0.1:3000"},
        {"origin": f"file://{HOST}"},
        {"origin": f"http://{HOST}/"},
        {"origin": f"http://user@{HOST}"},
        {"origin": "http://["},
        {"sec-fetch-site": "cross-site"},
        {"origin": "http://evil.example", "sec-fetch-site": "cross-site"},
    ],
)
def test_a_foreign_page_can_neither_move_nor_listen(headers: dict[str, str]) -> None:
    @on_stand()
    async def story(stand: Stand) -> None:
        answer = await stand.post("/bodies/3F/moves", RELATIVE, **headers)
        assert answer.status_code == 403
        assert answer.headers["content-type"] == "application/problem+json"
        assert "allowed_origins" in answer.json()["remedy"]
        assert stand.moved() == []
        async with socket(stand, "/events", headers=headers) as client:
            refused = await client.message()
        assert (refused["type"], refused["status"]) == ("websocket.http.response.start", 403)

    story()


@on_stand()
async def test_the_gateways_own_pages_may_use_it(stand: Stand) -> None:
    own = {"origin": f"http://{HOST}", "sec-fetch-site": "same-origin"}
    assert (await stand.post("/stop", **own)).status_code == 200
    async with socket(stand, "/events", headers=own) as client:
        assert (await client.message())["type"] == "websocket.accept"


@on_stand(allowed_origins=["http://panel.plant:8080"])
async def test_a_configured_page_may_use_it_and_its_browser_is_told_so(stand: Stand) -> None:
    page = {"origin": "http://panel.plant:8080", "sec-fetch-site": "cross-site"}
    answer = await stand.get("/bodies", **page)
    assert answer.headers["access-control-allow-origin"] == "http://panel.plant:8080"
    preflight = {
        **page,
        "access-control-request-method": "POST",
        "access-control-request-headers": "content-type",
    }
    asked = await stand.client.options("/bodies/3F/moves", headers=preflight)
    assert asked.status_code == 200
    assert "content-type" in asked.headers["access-control-allow-headers"]


@pytest.mark.parametrize(
    ("client", "welcome"),
    [
        ("10.1.2.3", True),
        ("::ffff:10.1.2.3", True),
        ("127.0.0.1", True),
        ("::1", True),
        ("10.2.0.1", False),
        ("fd00::1", False),
        ("unix", False),
        ("", False),
    ],
)
def test_where_networks_are_configured_clients_come_from_them_or_this_machine(
    client: str, welcome: bool
) -> None:
    scope = {"client": (client, 1), "headers": [(b"host", b"localhost")]}
    reason = SameSite([], [], ["10.1.0.0/16"]).reason_against(scope)
    assert (reason is None) == welcome
    assert SameSite([], []).reason_against(scope) is None
    if reason is not None:
        assert "client_networks" in reason.remedy


def test_the_network_counts_at_the_door() -> None:
    @on_stand(client_networks=["10.1.0.0/16"])
    async def story(stand: Stand) -> None:
        far = ASGITransport(stand.app, client=("10.2.0.1", 1), raise_app_exceptions=False)
        async with AsyncClient(transport=far, base_url=f"http://{HOST}") as foreign:
            answer = await foreign.post("/bodies/3F/moves", json=RELATIVE)
            assert (answer.status_code, stand.moved()) == (403, [])
        assert (await stand.get("/bodies")).status_code == 200

    story()
