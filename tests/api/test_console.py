"""The console's pages: they come from here, load nothing from elsewhere, and are fetched once."""

import re

from tests.api.access.guarded import Keys, guarded
from tests.api.stand import Stand, on_stand


@on_stand()
async def test_the_page_and_all_it_loads_are_here(stand: Stand) -> None:
    page = await stand.get("/")
    places = re.findall(r'(?:src|href)="([^"]+)"', page.text)
    assert {place.rpartition(".")[2] for place in places} == {"js", "css", "svg"}
    for place in places:
        assert place.startswith("./assets/")
        asset = await stand.get(place[1:])
        assert asset.status_code == 200
        assert asset.headers["cache-control"] == "public, max-age=31536000, immutable"
    missing = await stand.get("/assets/index.js")
    assert (missing.status_code, missing.headers.get("cache-control")) == (404, "no-store")


@on_stand()
async def test_the_page_is_asked_for_again_and_sent_once(stand: Stand) -> None:
    page = await stand.get("/")
    assert page.headers["cache-control"] == "no-cache"
    again = await stand.get("/", **{"if-none-match": page.headers["etag"]})
    assert again.status_code == 304


@on_stand()
async def test_the_page_runs_its_own_scripts_and_no_others(stand: Stand) -> None:
    page = await stand.get("/")
    policy = dict(part.split(" ", 1) for part in page.headers["content-security-policy"].split("; "))
    assert policy["default-src"] == policy["frame-ancestors"] == policy["base-uri"] == "'none'"
    assert {policy[name] for name in ("script-src", "style-src", "img-src", "connect-src")} == {"'self'"}
    assert not re.search(r"<script>|<style|style=|\son\w+=", page.text)


@guarded()
async def test_a_browser_without_a_session_is_led_to_the_sign_in(stand: Stand, keys: Keys) -> None:
    answer = await stand.get("/", **{"sec-fetch-mode": "navigate"})
    assert (answer.status_code, answer.headers["location"]) == (303, "/sign-in?next=%2F")
    assert (await stand.get("/", **keys.header("viewer", "arm"))).status_code == 200
