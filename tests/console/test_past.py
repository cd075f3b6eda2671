"""The slider under the plant: where everything was, which alarms stood, and what went over the line."""

from collections.abc import Callable, Iterator
from datetime import datetime
from time import sleep

import httpx
import pytest
from playwright.sync_api import expect

from tests.console.browser import Console, demo_in
from tests.console.screenshots import LIFT, break_something

pytestmark = pytest.mark.prove
MM = {"unit": "mm"}
APART_S = 2.0
"""Seconds between two moves, in which everything rests."""


@pytest.fixture(scope="module")
def worked(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[str, datetime]]:
    """A demo in which the lift has gone to 120 mm, then to 400, and has met an open stop circuit."""
    with demo_in(tmp_path_factory.mktemp("past")) as url:
        moves = f"{url}/bodies/{LIFT}/moves?wait=60"
        httpx.post(moves, json={"kind": "home"}, timeout=90).raise_for_status()
        for place in (120, 400):
            sleep(APART_S)
            there = {"kind": "absolute", "position": {"value": place, **MM}}
            done = httpx.post(moves, json=there, timeout=90).raise_for_status().json()
        sleep(APART_S)
        break_something(url)
        yield url, datetime.fromisoformat(done["sent_at"])


@pytest.mark.parametrize(("language", "width"), [("en", 1280), ("ja", 390)])
def test_the_plant_is_shown_as_it_was(
    worked: tuple[str, datetime], open_console: Callable[..., Console], language: str, width: int
) -> None:
    url, sent_at = worked
    console = open_console(url, "#/plant", language)
    page = console.page
    page.set_viewport_size({"width": width, "height": 844})
    page.get_by_text({"en": "As it was: go back in time", "ja": "過去の状態を見る"}[language]).click()
    slider = page.get_by_role("slider")
    expect(page.locator(".places .place").first).to_be_visible()
    lift = page.locator(".places li", has_text="lift")
    alarm = page.locator("details p.bad")
    expect(alarm.first).to_be_visible()

    def go_to(seconds: float) -> None:
        """Move the slider to `seconds` after the last move was sent."""
        wanted = round((sent_at.timestamp() + seconds) * 1000)
        slider.evaluate("(it, at) => { it.value = at; it.dispatchEvent(new Event('input')) }", wanted)

    go_to(-1.0)
    expect(lift.locator(".place")).to_have_text("120.00 mm")
    expect(lift).to_contain_text({"en": "stood still", "ja": "静止"}[language])
    expect(alarm).to_have_count(0)
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    page.locator("details details summary").click()
    expect(page.locator("details pre")).to_contain_text("&3F")
    assert console.faults() == []
    console.go("#/shift")
    failures = page.get_by_role("region", name={"en": "Failures by cause", "ja": "原因別の失敗"}[language])
    expect(failures.get_by_role("row")).to_contain_text("EMS")  # and not ems, as the API has it
