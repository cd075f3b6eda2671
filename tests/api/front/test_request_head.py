"""The heads of requests: which can be served, which may not wait, and how ASGI has them."""

import asyncio

import pytest

from api.front.refusals import Refused
from api.front.request_head import ConnectionScope, RequestHead

GOOD = {"host": "gateway"}
OFFER = {
    **GOOD,
    "connection": "keep-alive, Upgrade",
    "upgrade": "WebSocket",
    "sec-websocket-version": "13",
    "sec-websocket-key": "AAAAAAAAAAAAAAAAAAAAAA==",
}


def head(url: str = "/bodies", lines: dict[str, str] = GOOD) -> RequestHead:
    made = RequestHead()
    made.url = url.encode()
    for name, value in lines.items():
        made.take(name.title().encode(), value.encode(), 10)
    return made


@pytest.mark.parametrize(
    ("url", "method", "version", "lines"),
    [
        ("/bodies", "GET", "2.0", GOOD),
        ("gateway:80", "CONNECT", "1.1", GOOD),
        ("http://gateway/bodies", "GET", "1.1", GOOD),
        ("/bodies", "GET", "1.1", {}),
    ],
)
def test_what_is_not_for_this_server_is_refused(
    url: str, method: str, version: str, lines: dict[str, str]
) -> None:
    with pytest.raises(Refused):
        head(url, lines).complete(method, version)


@pytest.mark.parametrize(
    ("url", "method", "kinds"),
    [
        ("/bodies/3F/stop?x=1", "POST", (True, False, False)),
        ("/bodies/3F/%73top", "POST", (True, False, False)),
        ("/livez", "GET", (False, True, True)),
        ("/jogs/1/heartbeat", "POST", (False, False, True)),
        ("/bodies/3F/stop", "GET", (False, False, False)),
    ],
)
def test_what_may_not_wait_is_known_by_its_path(
    url: str, method: str, kinds: tuple[bool, bool, bool]
) -> None:
    asked = head(url)
    asked.complete(method, "1.1")
    assert (asked.is_stop, asked.is_life_sign, asked.is_urgent) == kinds


def test_a_head_of_too_many_lines_is_refused() -> None:
    asked = head()
    for _ in range(9):
        asked.take(b"x", b"y", 10)
    with pytest.raises(Refused, match="more than 10 header lines"):
        asked.take(b"x", b"y", 10)


@pytest.mark.parametrize(
    ("changed", "method", "version", "ahead"),
    [
        ({}, "POST", "1.1", False),
        ({}, "GET", "1.0", False),
        ({}, "GET", "1.1", True),
        ({"sec-websocket-version": "8"}, "GET", "1.1", False),
        ({"sec-websocket-key": "short"}, "GET", "1.1", False),
    ],
)
def test_a_handshake_that_is_not_complete_is_refused(
    changed: dict[str, str], method: str, version: str, ahead: bool
) -> None:
    assert head("/events", OFFER).opens_websocket
    head("/events", OFFER).require_good_handshake("GET", "1.1", ahead=False)
    with pytest.raises(Refused):
        head("/events", OFFER | changed).require_good_handshake(method, version, ahead=ahead)


def test_the_scope_has_the_path_as_it_is_meant_and_as_it_came() -> None:
    transport = asyncio.BaseTransport({"peername": ("10.0.0.8", 5), "sockname": ("10.0.0.1", 80)})
    scope = ConnectionScope(transport, "/gw").of("http", head("/groups/a%2Db?wait=1"), "1.1")
    assert (scope["path"], scope["raw_path"]) == ("/gw/groups/a-b", b"/gw/groups/a%2Db")
    assert (scope["query_string"], scope["scheme"]) == (b"wait=1", "http")
    assert (scope["client"], scope["server"]) == (("10.0.0.8", 5), ("10.0.0.1", 80))
