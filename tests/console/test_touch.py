"""The console on a tablet: a JOG is held with a finger, and nothing is cut off."""

from collections.abc import Callable

import pytest
from playwright.sync_api import CDPSession, ViewportSize, expect

from tests.console.browser import Console, Plant
from tests.console.test_pages import PAGES
from tests.e2e.processes import until

pytestmark = pytest.mark.prove

Open = Callable[..., Console]
BESIDE_PX = 200
HITS_STOP = """() => {
    const stop = document.querySelector("header .stop"), box = stop.getBoundingClientRect();
    const places = [[1, 1], [1, 9], [5, 5], [9, 1], [9, 9]];
    return places.every(([x, y]) => stop ===
        document.elementFromPoint(box.x + (box.width * x) / 10, box.y + (box.height * y) / 10));
}"""


class Finger:
    """A finger on a button."""

    def __init__(self, console: Console, name: str) -> None:
        button = console.button(name)
        button.scroll_into_view_if_needed()
        box = button.bounding_box()
        assert box
        self._x, self._y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
        self._session: CDPSession = console.page.context.new_cdp_session(console.page)

    def press(self) -> None:
        self._touch("touchStart", [{"x": self._x, "y": self._y}])

    def slide_off(self) -> None:
        self._touch("touchMove", [{"x": self._x, "y": self._y + BESIDE_PX}])

    def lift(self) -> None:
        self._touch("touchEnd", [])

    def _touch(self, kind: str, points: list[dict[str, float]]) -> None:
        self._session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})


def is_moving(plant: Plant) -> bool:
    return bool(plant.gateway.get("/bodies/3F/status")["moving"])


def newest_status(plant: Plant) -> str:
    return str(plant.gateway.get("/bodies/3F/moves")["moves"][0]["status"])


@pytest.mark.parametrize("let_go", [Finger.lift, Finger.slide_off])
def test_a_jog_ends_when_the_finger_leaves_the_button(
    plant: Plant, open_console: Open, let_go: Callable[[Finger], None]
) -> None:
    console = open_console(plant.url, "#/axis/line1.3F", tablet=True)
    expect(console.button("Jog +")).to_have_attribute("aria-disabled", "false")
    finger = Finger(console, "Jog +")
    finger.press()
    until(lambda: is_moving(plant), "the motor moves")
    let_go(finger)
    until(lambda: not is_moving(plant), "the motor stands still")
    until(lambda: newest_status(plant) == "stopped", "it has ended")
    expect(console.page.locator(".notices .bad")).to_have_count(0)


def test_a_jog_that_is_over_says_so_while_the_finger_still_holds(plant: Plant, open_console: Open) -> None:
    console = open_console(plant.url, "#/axis/line1.3F", tablet=True)
    over = {
        "type": "urn:motion-gateway:jog-over",
        "title": "Over",
        "status": 409,
        "detail": "The JOG is over.",
    }
    console.page.route("**/heartbeat", lambda route: route.fulfill(status=409, json=over))
    expect(console.button("Jog +")).to_have_attribute("aria-disabled", "false")
    finger = Finger(console, "Jog +")
    finger.press()
    console.shows("The JOG is over.")
    expect(console.page.locator(".held")).to_have_count(0)
    until(lambda: not is_moving(plant), "the motor stands still")
    finger.lift()


def test_no_page_is_wider_than_a_tablet(plant: Plant, open_console: Open) -> None:
    console = open_console(plant.url, tablet=True)
    for path in PAGES:
        console.go(path)
        expect(console.page.get_by_role("heading", level=1)).to_be_visible()
        beyond = "document.documentElement.scrollWidth - document.documentElement.clientWidth"
        assert console.page.evaluate(beyond) == 0, path


PHONE: ViewportSize = {"width": 390, "height": 844}
ALL_PAGES = (
    *("#/", "#/axis/line1.00", "#/axis/line1.10", "#/scara/wafer", "#/robot/r1", "#/positions/line1.00"),
    *("#/motion/line1.00", "#/program/line1.00", "#/settings/line1.00", "#/events", "#/wire/line1"),
    *("#/wire/cell1", "#/system"),
)
"""Pages of the demo, which has one thing of each kind."""
READ = {"en": "Read", "ja": "読み出し"}
"""Pressed where it is: what it shows is wide, too."""


@pytest.mark.parametrize("language", ["en", "ja"])
def test_no_page_is_wider_than_a_phone(demo: str, open_console: Open, language: str) -> None:
    console = open_console(demo, "", language, tablet=True)
    console.page.set_viewport_size(PHONE)
    for path in ALL_PAGES:
        console.go(path)
        expect(console.page.get_by_role("heading", level=1)).to_be_visible()
        console.page.wait_for_load_state("networkidle")
        console.page.evaluate("document.querySelectorAll('details').forEach((it) => { it.open = true })")
        for button in console.page.get_by_role("button", name=READ[language], exact=True).all():
            button.click()
            expect(console.page.locator(".spinning")).to_have_count(0)
        assert console.page.evaluate("document.documentElement.scrollWidth") <= PHONE["width"], path


@pytest.mark.parametrize("size", [(390, 844), (844, 390), (800, 1000)])
def test_nothing_ever_covers_the_stop(plant: Plant, open_console: Open, size: tuple[int, int]) -> None:
    console = open_console(plant.url, "#/axis/line1.3F", tablet=True)
    console.page.set_viewport_size({"width": size[0], "height": size[1]})
    for name in ("Go", "Set position", "Change", "Faster", "Slower"):
        console.button(name).click(force=True)
    console.page.route("**/bodies", lambda route: route.abort())
    console.shows("No connection to the gateway. What is shown is from")
    console.page.evaluate("scrollTo(0, document.body.scrollHeight)")
    console.page.keyboard.press("Tab")
    console.page.get_by_text("Skip to the content").focus()
    assert console.page.evaluate(HITS_STOP)
    beyond = "document.documentElement.scrollWidth - document.documentElement.clientWidth"
    assert console.page.evaluate(beyond) == 0


def test_the_list_of_unconfirmed_stops_is_read_to_its_end_on_a_phone(
    plant: Plant, open_console: Open
) -> None:
    bodies = [
        {"body_id": f"line1.{number:02X}", "state": "sent", "detail": "It moves."} for number in range(120)
    ]
    console = open_console(plant.url, tablet=True)
    console.page.set_viewport_size({"width": 390, "height": 844})
    console.page.route(
        "**/stop", lambda route: route.fulfill(json={"confirmed": False, "bodies": bodies, "robots": []})
    )
    console.button("STOP ALL").click()
    console.shows("NOT CONFIRMED: use the hardware stop if anything moves.")
    last = console.page.get_by_text("line1.77: sent, not confirmed It moves.")
    last.scroll_into_view_if_needed()
    expect(last).to_be_in_viewport()
    expect(console.button("STOP ALL")).to_be_in_viewport()
    assert console.page.evaluate(HITS_STOP)


def test_what_a_finger_presses_is_big_enough(plant: Plant, open_console: Open) -> None:
    console = open_console(plant.url, "#/axis/line1.3F", tablet=True)
    for name in ("STOP ALL", "Go", "Home", "Jog +"):
        box = console.button(name).bounding_box()
        assert box
        assert box["height"] >= 44, name
