"""The pages of a SCARA robot, with the demo's."""

from collections.abc import Callable
from typing import Any

import httpx
import pytest
from playwright.sync_api import expect

from tests.console.browser import Console
from tests.e2e.processes import until

pytestmark = pytest.mark.prove

Open = Callable[..., Console]


def newest(demo: str) -> dict[str, Any]:
    moves: list[dict[str, Any]] = httpx.get(f"{demo}/scaras/wafer/moves").json()["moves"]
    return moves[0] if moves else {"status": None}


def fastest(demo: str) -> int:
    """The highest speed along the way that its moves by hand have now, in micrometres a second."""
    sets = [httpx.get(f"{demo}/bodies/line1.{body}/speed-sets/29").json() for body in (10, 11, 12)]
    return max(int(speed_set["maximum_speed_pps"]) for speed_set in sets)


def test_a_scara_stands_on_the_plant_with_its_bodies(demo: str, open_console: Open) -> None:
    console = open_console(demo)
    frame = console.page.get_by_role("group", name="SCARA robot")
    expect(frame.get_by_role("link")).to_have_count(4)
    tile = frame.get_by_role("link", name="wafer")
    expect(tile).to_contain_text("115.")
    console.page.get_by_role("region", name="line1").get_by_text("Details").click()
    console.shows("Group line1.81: base, arm, finger")
    tile.click()
    expect(console.page.get_by_role("heading", level=1)).to_contain_text("wafer")


def test_a_gateway_without_scara_robots_is_shown_without_them(demo: str, open_console: Open) -> None:
    console = open_console(demo)
    gone = {"type": "urn:motion-gateway:not-found", "detail": "There is no GET /scaras.", "status": 404}
    console.page.route("**/scaras", lambda route: route.fulfill(status=404, json=gone))
    console.page.reload()
    expect(console.page.get_by_role("link", name="lift")).to_be_visible()
    expect(console.page.get_by_role("group", name="SCARA robot")).to_have_count(0)
    console.page.unroute("**/scaras")


@pytest.mark.parametrize("page", ["scara/wafer", "pendant/wafer", "axis/line1.10", "pendant/line1.10"])
def test_a_place_from_an_unknown_origin_says_so_on_each_page(
    demo: str, open_console: Open, page: str
) -> None:
    console = open_console(demo, f"#/{page}")
    expect(console.page.get_by_role("img", name="Its origin is not known")).to_have_text("?")


def test_its_finger_goes_by_steps_and_to_places(demo: str, open_console: Open) -> None:
    console = open_console(demo, "#/scara/wafer")
    console.button("10").click()
    step = console.button("Step X+ 10 mm")
    expect(step).to_have_accessible_description("5 mm/s")
    step.click()
    until(lambda: newest(demo)["status"] == "succeeded", "it is a step further")
    assert newest(demo)["preparation"][-1].endswith("HXSA[29],10000\\r")
    assert fastest(demo) == 5_000
    console.page.get_by_label("Speed by hand").select_option("20")
    console.page.reload()
    expect(console.button("Step X+ 1 mm")).to_have_accessible_description("20 mm/s")
    console.page.get_by_label("X (mm)").fill("0")
    expect(console.button("Move")).to_have_attribute("aria-disabled", "true")
    console.page.get_by_label("Y (mm)").fill("150")
    console.button("Plan").click()
    console.shows("Y 149.99")
    assert newest(demo)["kind"] == "offset"
    console.button("Move").click()
    until(lambda: newest(demo)["kind"] == "line" and newest(demo)["status"] == "succeeded", "it is there")
    assert fastest(demo) == 20_000
    newest_row = console.page.get_by_role("region", name="Moves").locator("tbody tr").first
    expect(newest_row).to_contain_text("line")
    expect(newest_row).to_contain_text("succeeded")
    expect(console.page.get_by_role("img", name="The arm from above")).to_be_visible()


def test_its_own_stop_ends_a_move(demo: str, open_console: Open) -> None:
    console = open_console(demo, "#/scara/wafer")
    console.page.get_by_label("Kind").select_option("finger")
    console.page.get_by_label("Direction").fill("-90")
    expect(console.button("Move")).to_have_accessible_description("5 deg/s")
    console.button("Move").click()
    until(lambda: newest(demo)["status"] in ("sent", "moving"), "it moves")
    console.page.locator("main").get_by_role("button", name="Stop", exact=True).click()
    until(lambda: newest(demo)["status"] == "stopped", "it stands still")


@pytest.mark.parametrize(("language", "colours"), [("en", "dark"), ("ja", "light")])
def test_its_page_has_no_serious_fault(demo: str, open_console: Open, language: str, colours: str) -> None:
    console = open_console(demo, "#/scara/wafer", language, colours)
    expect(console.page.get_by_role("heading", level=1)).to_contain_text("wafer")
    assert console.faults() == []
