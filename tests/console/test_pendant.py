"""A phone as teach pendant, and what a thumb does on the pages: targets by a tap, speeds by a factor."""

import re
from collections.abc import Callable

import httpx
import pytest
from playwright.sync_api import Browser, FilePayload, ViewportSize, expect

from tests.console.browser import Console, Guarded, Plant
from tests.console.test_touch import PHONE, Finger, is_moving, newest_status
from tests.e2e.processes import until

pytestmark = pytest.mark.prove

Open = Callable[..., Console]
TABLET: ViewportSize = {"width": 820, "height": 1180}
HEADER_PX = 120
LEAST_PX = 40
PAGES = (
    *("#/plant", "#/axis/line1.3F", "#/robot/r1", "#/scara/wafer", "#/events", "#/pendant/r1/1"),
    *("#/wire/line1", "#/system", "#/shift", "#/recordings", "#/commission/line1"),
    *("#/positions/line1.3F", "#/positions/r1/units/2", "#/motion/line1.3F", "#/program/line1.3F"),
    *("#/settings/line1.3F", "#/settings/r1/units/1", "#/pendant/wafer", "#/axis/line1.10"),
)
TOO_SMALL = """(least) => [...document.querySelectorAll("button, a, input, select, summary")]
    .filter((it) => it.checkVisibility()).map((it) => [it, it.getBoundingClientRect()])
    .filter(([, { width, height, left }]) => height > 1 && left >= 0 && (width < least || height < least))
    .map(([it, { width, height }]) => `${it.ariaLabel ?? it.textContent} ${width}x${height}`)"""
SIDEWAYS = """() => [...document.querySelectorAll("*")]
    .filter((it) => it.checkVisibility() && ["auto", "scroll"].includes(getComputedStyle(it).overflowX))
    .filter((it) => it.scrollWidth > it.clientWidth + 1 && it.querySelector("button, input, select"))
    .map((it) => it.className)"""


FILLED = """() => [...document.querySelectorAll(".primary:not([aria-disabled='true'])")]
    .filter((it) => it.checkVisibility()).map((it) => it.textContent)"""
SETTLED_MS = 500


@pytest.mark.parametrize("size", [PHONE, TABLET], ids=["phone", "tablet"])
@pytest.mark.parametrize("language", ["en", "ja"])
def test_a_thumb_reaches_everything(demo: str, open_console: Open, language: str, size: ViewportSize) -> None:
    console = open_console(demo, "", language, tablet=True)
    console.page.set_viewport_size(size)
    for path in PAGES:
        console.go(path)
        expect(console.page.get_by_role("heading", level=1)).to_be_visible()
        header = console.page.locator("header").bounding_box()
        assert header
        assert header["height"] <= HEADER_PX, path
        assert console.page.evaluate(TOO_SMALL, LEAST_PX) == [], path
        assert console.page.evaluate(SIDEWAYS) == [], path
        assert console.faults() == [], path


@pytest.mark.parametrize("path", PAGES)
def test_a_page_has_one_filled_button_at_most_and_never_home(
    demo: str, open_console: Open, path: str
) -> None:
    console = open_console(demo, path)
    expect(console.page.get_by_role("heading", level=1)).to_be_visible()
    console.page.wait_for_timeout(SETTLED_MS)
    filled = console.page.evaluate(FILLED)
    assert len(filled) <= 1, filled
    assert "Home" not in filled


def test_a_code_makes_a_phone_the_pendant_of_one_axis_once(
    guarded: Guarded, open_console: Open, browser: Browser
) -> None:
    chief = open_console(guarded.url, "#/system", key=guarded.key("pendant-chief", "admin"))
    chief.page.get_by_role("combobox", name="Of", exact=True).select_option("line1.3F")
    chief.button("Show the code").click()
    expect(chief.page.get_by_role("img", name="Code for the pendant of line1.3F")).to_be_visible()
    link = str(chief.page.get_by_role("link", name="Open it here").get_attribute("href"))
    phone = browser.new_context(viewport=PHONE, has_touch=True).new_page()
    phone.goto(link)
    pendant = Console(phone)
    expect(phone.get_by_role("heading", level=1)).to_contain_text("line1.3F")
    expect(phone.get_by_role("navigation")).to_have_count(0)
    expect(pendant.button("Jog +")).to_have_attribute("aria-disabled", "false")
    thumb = Finger(pendant, "Jog +")
    thumb.press()
    expect(phone.locator(".lamp")).to_contain_text("moves")
    phone.close()  # a phone that is lost lets go
    expect(chief.page.get_by_text("line1.3F").first).to_be_attached()
    chief.go("#/axis/line1.3F")
    expect(chief.page.locator("h1 .lamp")).to_contain_text("stands still")
    late = browser.new_page()
    late.goto(link)
    expect(late.get_by_role("alert")).to_contain_text("used before")


def test_a_pendant_steps_teaches_and_stops(plant: Plant, open_console: Open) -> None:
    console = open_console(plant.url, "#/pendant/line1.3F", tablet=True)
    console.page.set_viewport_size(PHONE)
    console.button("1000 pulse").click()
    start = plant.gateway.get("/bodies/3F/position")["pulses"]
    console.button("Step + 1000 pulse").click()
    until(lambda: plant.gateway.get("/bodies/3F/position")["pulses"] == start + 1000, "it has stepped")
    console.page.get_by_label("Number").fill("9")
    console.page.get_by_label("Name").fill("gate")
    expect(console.button("Teach here as")).to_have_attribute("aria-disabled", "false")
    console.button("Teach here as").click()
    until(
        lambda: plant.gateway.get("/bodies/3F/positions?first=9&last=9")["positions"][0]["name"] == "gate",
        "it is taught",
    )


def test_a_tap_on_the_travel_sets_a_target_and_go_moves_there(plant: Plant, open_console: Open) -> None:
    plant.gateway.http.put("/bodies/3F/position", json={"value": 0, "unit": "pulse"}).raise_for_status()
    console = open_console(plant.url, "#/axis/line1.3F", tablet=True)
    travel = console.page.get_by_role("slider", name="Travel")
    travel.scroll_into_view_if_needed()
    box = travel.bounding_box()
    assert box
    console.page.touchscreen.tap(box["x"] + box["width"] * 0.75, box["y"] + box["height"] / 2)
    expect(console.page.get_by_role("status").filter(has_text="takes")).to_be_visible()
    assert not is_moving(plant)
    target = int(console.page.get_by_label("Target (pulse)").input_value())
    console.button("Go").click()
    until(lambda: plant.gateway.get("/bodies/3F/position")["pulses"] == target, "it is there")


def test_a_factor_slows_whatever_moves_by_hand(plant: Plant, open_console: Open) -> None:
    console = open_console(plant.url, "#/axis/line1.3F")
    expect(console.button("Jog +")).to_contain_text("500 pulse/s")
    console.page.get_by_label("Speed factor of all that moves by hand").select_option("50")
    expect(console.button("Jog +")).to_contain_text("250 pulse/s")
    console.page.get_by_label("Speed factor", exact=True).select_option("10")
    expect(console.button("Jog +")).to_contain_text("25 pulse/s")
    console.go("#/robot/r1")
    expect(console.page.get_by_role("button", name="Move").first).to_contain_text("5 %")


def test_arrow_keys_jog_only_where_somebody_has_asked_for_that(plant: Plant, open_console: Open) -> None:
    console = open_console(plant.url, "#/axis/line1.3F")
    expect(console.button("Jog +")).to_have_attribute("aria-disabled", "false")
    console.page.keyboard.down("ArrowRight")
    console.page.keyboard.up("ArrowRight")
    known = len(plant.gateway.get("/bodies/3F/moves")["moves"])
    console.button("← → jog").click()
    expect(console.button("Jog +")).to_have_attribute("aria-disabled", "false")
    console.page.keyboard.down("ArrowRight")
    until(lambda: is_moving(plant), "it jogs")
    console.page.keyboard.up("ArrowRight")
    until(lambda: not is_moving(plant), "it stands still")
    assert len(plant.gateway.get("/bodies/3F/moves")["moves"]) == known + 1


def test_a_failed_move_is_explained_on_a_page_of_its_own(plant: Plant, open_console: Open) -> None:
    plant.gateway.moving("3F", 2_000_000)
    plant.line.tell("PUT", "/bodies/3F/sensors/ems", on=True)
    until(lambda: newest_status(plant) == "failed", "it has failed")
    plant.line.tell("PUT", "/bodies/3F/sensors/ems", on=None)
    console = open_console(plant.url, "#/events")
    console.page.get_by_role("link", name="Why?").first.click()
    expect(console.page.locator(".cause")).to_contain_text("EMS")
    course = console.page.get_by_label("What came when")
    expect(course).to_contain_text(re.compile("sent|received"))
    expect(course).to_contain_text("get the controller status")
    link = console.page.url
    other = open_console(link.partition("/#")[0], f"#{link.partition('#')[2]}")
    expect(other.page.locator(".cause")).to_contain_text("EMS")
    clear = other.page.get_by_role("button", name="Clear its error status (9CS)", exact=True)
    expect(clear.first).to_be_visible()


def test_positions_of_a_robots_unit_stand_on_the_page_of_positions(demo: str, open_console: Open) -> None:
    httpx.post(
        f"{demo}/robots/r1/units/1/moves?wait=60", json={"kind": "home"}, timeout=90
    ).raise_for_status()
    console = open_console(demo, "#/positions")
    console.page.get_by_label("Body").select_option("r1/units/1")
    expect(console.page.get_by_role("heading", level=1)).to_contain_text("Unit 1")

    def upload(rows: bytes) -> None:
        table: FilePayload = {"name": "r.csv", "mimeType": "text/csv", "buffer": rows}
        console.page.locator("input[type=file]").set_input_files(table)

    upload(b"number,X mm,Y mm,Z mm\r\n7,1,2,3\r\n9,4,5,6\r\n")
    row = console.page.get_by_role("row", name="7")
    expect(row).to_contain_text("2")
    name = console.page.get_by_label("Name 7")
    name.fill("load")
    name.press("Enter")
    console.shows("Name 7: done.")
    upload(b"number,X mm\r\n7,none\r\n")
    console.shows("The file has not the columns number, X mm, Y mm, Z mm, or not a number in each.")
    upload(b"number,X mm,Y mm,Z mm\r\n7,8,8,8\r\n9,8,8,8\r\n")
    expect(row).to_contain_text("8")
    console.button("Put 2 positions back").click()
    expect(row).to_contain_text("3")
    expect(row).not_to_contain_text("8")
    console.page.reload()
    expect(name).to_have_value("load")
