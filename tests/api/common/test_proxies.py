"""Behind a proxy: whose word counts, who gets past it, and the path at which the gateway is."""

from typing import Any

import pytest
from httpx2 import ASGITransport, AsyncClient
from starlette.types import Receive, Scope, Send

from api.common.proxies import Proxies
from gateway.config import Server
from tests.api.access.guarded import Keys, guarded
from tests.api.stand import HOST, Stand
from tests.virtual_time import run_virtual

FORWARDED = {"x-forwarded-for": "10.9.9.9", "x-forwarded-proto": "https"}


async def seen(server: dict[str, Any], peer: str, **headers: str) -> tuple[int, Any]:
    """Send a request through the proxy rules; give what the application sees of it."""
    scopes: list[Scope] = []

    async def app(scope: Scope, receive: Receive, send: Send) -> None:
        scopes.append(scope)
        await send({"type": "http.response.start", "status": 200, "headers": [(b"location", b"/docs")]})
        await send({"type": "http.response.body"})

    transport = ASGITransport(Proxies(app, Server.model_validate(server)), client=(peer, 1))
    async with AsyncClient(transport=transport, base_url=f"http://{HOST}") as client:
        answer = await client.get("/livez", headers=headers)
    if not scopes:
        return answer.status_code, answer.json()["detail"]
    return answer.status_code, (scopes[0]["client"][0], scopes[0]["scheme"], answer.headers["location"])


@pytest.mark.parametrize(
    ("server", "peer", "expected"),
    [
        ({}, "127.0.0.1", (200, ("127.0.0.1", "http", "/docs"))),
        ({"trusted_proxies": ["127.0.0.1"]}, "127.0.0.1", (200, ("10.9.9.9", "https", "/docs"))),
        ({"trusted_proxies": ["10.0.0.0/24"]}, "10.0.0.5", (200, ("10.9.9.9", "https", "/docs"))),
        ({"trusted_proxies": ["10.0.0.5"]}, "127.0.0.1", (200, ("127.0.0.1", "http", "/docs"))),
        ({"root_path": "/motion"}, "127.0.0.1", (200, ("127.0.0.1", "http", "/motion/docs"))),
    ],
)
def test_only_trusted_proxies_say_who_a_client_is(
    server: dict[str, Any], peer: str, expected: tuple[int, Any]
) -> None:
    async def story() -> None:
        assert await seen(server, peer, **FORWARDED) == expected

    run_virtual(story())


@pytest.mark.parametrize("peer", ["10.0.0.6", "10.0.0.50", "", "unix", "::ffff:10.0.0.5"])
def test_nobody_gets_past_the_proxy_in_plain_text(peer: str) -> None:
    async def story() -> None:
        server = {"host": "10.0.0.1", "trusted_proxies": ["10.0.0.5"]}
        status, detail = await seen(server, peer, **FORWARDED)
        assert status == 403
        assert "proxy only" in detail

    run_virtual(story())


@guarded(root_path="/motion", trusted_proxies=["127.0.0.1"])
async def test_everything_works_at_a_sub_path(stand: Stand, keys: Keys) -> None:
    transport = ASGITransport(stand.app, root_path="/motion", raise_app_exceptions=False)
    headers = {**keys.header("operator"), "x-forwarded-proto": "https"}
    async with AsyncClient(transport=transport, base_url=f"http://{HOST}/motion", headers=headers) as client:
        page = (await client.get("/docs")).text
        assert "/motion/openapi/core.json" in page
        assert "/motion/static-offline-docs/swagger-ui-bundle.js" in page
        assert (await client.get("/static-offline-docs/swagger-ui.css")).status_code == 200
        assert (await client.get("/openapi.json")).json()["servers"] == [{"url": "/motion"}]
        assert 'src="./assets/' in (await client.get("/")).text
        move = {"kind": "relative", "direction": "cw", "distance": {"value": 5, "unit": "pulse"}}
        moved = await client.post("/bodies/arm.3F/moves", json=move)
        if moved.status_code == 202:
            assert moved.headers["location"].startswith("/motion/bodies/arm.3F/moves/")
        assert (await client.post("/stop")).status_code == 200
        assert (await client.get("/events?bodies=arm.3F")).status_code == 200
        form = {"content-type": "application/x-www-form-urlencoded", "origin": f"https://{HOST}"}
        signed = await client.post("/sign-in", content=f"key={keys.of('viewer')}&next=/redoc", headers=form)
        assert signed.headers["location"] == "/motion/redoc"
        assert signed.headers["set-cookie"].startswith("__Host-")
        anybody = {"authorization": "", "sec-fetch-mode": "navigate"}
        page = (await client.get("/sign-in", headers=anybody)).text
        assert '<form method="post">' in page, "it is sent to where it stands"
