"""A browser signs in, and what another service on the same host sees of it is of no use there."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, HTTPServer
from threading import Thread

import httpx
import pytest
from playwright.sync_api import expect

from tests.console.browser import Console, Guarded

pytestmark = pytest.mark.prove

Open = Callable[..., Console]


@contextmanager
def other_service() -> Iterator[tuple[str, list[str]]]:
    """A server at another port of the host of the gateway, and the cookies that browsers send it."""
    seen: list[str] = []

    class Service(BaseHTTPRequestHandler):
        def do_GET(self) -> None:  # its base names it
            seen.append(self.headers.get("Cookie", ""))
            self.send_response(204)
            self.end_headers()

        def log_message(self, *_: object) -> None:
            """Say nothing."""

    with HTTPServer(("127.0.0.1", 0), Service) as server:
        thread = Thread(target=server.serve_forever)
        thread.start()
        try:
            yield f"http://127.0.0.1:{server.server_port}/", seen
        finally:
            server.shutdown()
            thread.join()


def test_the_console_works_and_its_cookie_alone_does_not(guarded: Guarded, open_console: Open) -> None:
    console = open_console(guarded.url, "#/axis/line1.01", key=guarded.key("taro", "setup"))
    console.shows("taro")
    assert "claim" not in console.page.url
    console.button("Step +100 pulse").click()
    expect(console.page.locator(".big b")).to_have_text("100")  # told by the stream of events
    page = console.page.context.new_page()
    page.goto(f"{guarded.url}/#/positions/line1.01")
    second = Console(page)
    second.shows("taro")
    with second.page.expect_download() as saved:
        second.button("CSV (0–19)").click()
    assert saved.value.suggested_filename == "line1.01-positions.csv"
    with other_service() as (url, seen):
        second.page.request.get(url)
    assert "mg-session=" in seen[0]
    thief = {"cookie": seen[0], "origin": guarded.url, "sec-fetch-site": "same-origin"}
    with httpx.Client(base_url=guarded.url, headers=thief) as http:
        assert http.get("/").status_code == 200
        assert http.get("/bodies").status_code == 401
        assert http.post("/tickets").status_code == 401
        move = {"kind": "home"}
        assert http.post("/bodies/line1.01/moves", json=move).status_code == 401
    console.page.reload()
    console.shows("taro")
    expect(console.page.locator(".big b")).to_have_text("100")
