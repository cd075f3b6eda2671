"""An operator with a phone, in Japanese: from a stop circuit that opens to the next good move, timed."""

from collections.abc import Callable, Iterator
from time import monotonic

import httpx
import pytest
from playwright.sync_api import Browser, Locator, Page, expect

from tests.console.browser import PATIENCE_MS, Console, demo_in
from tests.console.screenshots import LIFT, PHONE

pytestmark = pytest.mark.prove
MOVES = f"/bodies/{LIFT}/moves"
FAR = {"kind": "relative", "direction": "cw", "distance": {"value": 800, "unit": "mm"}}
MOST_TAPS = 4
"""The alarm in the top row, its axis, the call that helps, and the step."""
WITHIN_S = 20.0
"""Seconds of the operator's time, on a machine with other work; a person reads as long again."""
TARGET_PX = 40


class Thumb:
    """Taps what is in view, or is scrolled to, and is large enough; nothing scrolls sideways."""

    def __init__(self, page: Page) -> None:
        self._page = page
        self.taps = 0

    def tap(self, what: Locator) -> None:
        expect(what).to_be_visible()
        what.scroll_into_view_if_needed()
        box = what.bounding_box()
        assert box is not None
        assert min(box["width"], box["height"]) >= TARGET_PX, box
        assert box["x"] >= 0, box
        assert box["x"] + box["width"] <= PHONE[0], box
        what.tap()
        self.taps += 1


@pytest.fixture(scope="module")
def broken(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """A demo of its own: the others find theirs whole."""
    with demo_in(tmp_path_factory.mktemp("phone")) as url:
        httpx.post(f"{url}{MOVES}?wait=60", json={"kind": "home"}, timeout=90).raise_for_status()
        yield url


def test_from_an_open_stop_circuit_to_the_next_good_move(
    broken: str, browser: Browser, record_property: Callable[[str, object], None]
) -> None:
    width, height = PHONE
    context = browser.new_context(
        locale="ja-JP", viewport={"width": width, "height": height}, has_touch=True, is_mobile=True
    )
    context.set_default_timeout(PATIENCE_MS)
    page = context.new_page()
    page.goto(f"{broken}/#/plant")
    console, thumb = Console(page), Thumb(page)
    httpx.post(f"{broken}{MOVES}", json=FAR).raise_for_status()
    httpx.post(f"{broken}/demo/faults", json={"kind": "ems", "target": LIFT}).raise_for_status()
    began_at = monotonic()
    thumb.tap(page.locator("header a.alarms.bad"))
    console.shows("EMS入力がONになりました")
    httpx.delete(f"{broken}/demo/faults").raise_for_status()  # the stop button is released by hand
    thumb.tap(console.button("エラーステータスをクリアします(9CS)").first)
    expect(page.get_by_text("発生中").filter(visible=True)).to_have_count(0)
    thumb.tap(page.get_by_role("link", name="lift").first)
    place = page.locator(".big b")
    before = place.inner_text()
    thumb.tap(console.button("ステップ +1 mm"))
    expect(place).not_to_have_text(before)
    took_s = monotonic() - began_at
    record_property("from_ems_to_good_move_s", round(took_s, 1))
    [last, *_] = httpx.get(f"{broken}{MOVES}").json()["moves"]
    moved = httpx.get(f"{broken}{MOVES}/{last['id']}?wait=10").json()
    assert (moved["kind"], moved["status"]) == ("relative", "succeeded")
    assert thumb.taps <= MOST_TAPS
    assert took_s < WITHIN_S
    print(f"\nfrom the stop circuit to the next good move: {thumb.taps} taps, {took_s:.1f} s")
