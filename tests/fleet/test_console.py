"""The console of a plant, in a browser."""

from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, expect

from tests.e2e.processes import until
from tests.fleet.plants import Plant, needs_engine, plant_of
from tests.fleet.test_callers import Guarded, shown

pytestmark = needs_engine


@pytest.fixture(scope="module")
def plant(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Plant]:
    with plant_of(Path(tmp_path_factory.mktemp("console"))) as plant:
        yield plant


@pytest.fixture
def page(browser: Browser, plant: Plant) -> Page:
    page = browser.new_context(locale="en-GB").new_page()
    page.goto(plant.process.url)
    return page


def test_gateways_bodies_and_alarms_of_all_are_on_one_page(page: Page, plant: Plant) -> None:
    expect(page.locator("#gateways li")).to_have_count(2)
    expect(page.locator("#summary")).to_have_text("2 of 2 gateways online, 0 alarms")
    expect(page.locator("#bodies tr")).to_have_count(4)
    page.fill("#search", "stocker2 3f")
    expect(page.locator("#bodies tr")).to_have_count(1)
    expect(page.locator("#bodies td").first).to_have_text("stocker2:line1.3F")
    link = page.get_by_role("link", name="console").first
    expect(link).to_have_attribute("href", "gateways/stocker1/")
    page.click("#language")
    expect(page.get_by_role("button", name="全停止")).to_be_visible()


def test_a_body_is_found_among_3600(page: Page, plant: Plant) -> None:
    body = page.request.get(f"{plant.process.url}/bodies").json()["bodies"][0]
    many = [
        {**body, "body_id": f"stocker{gateway}:line1.{number:02X}", "name": f"lift {gateway}"}
        for gateway in range(1, 31)
        for number in range(120)
    ]
    page.route("**/bodies", lambda route: route.fulfill(json={"bodies": many}))
    page.reload()
    expect(page.locator("#bodies tr")).to_have_count(200)
    page.fill("#search", "stocker17 line1.3f")
    expect(page.locator("#bodies tr")).to_have_count(1)
    expect(page.locator("#bodies td").first).to_have_text("stocker17:line1.3F")
    page.fill("#search", "stocker30 LIFT")
    expect(page.locator("#bodies tr")).to_have_count(120)


@pytest.mark.prove
def test_everything_is_stopped_with_one_tap_and_what_is_lost_is_struck_out(page: Page, plant: Plant) -> None:
    expect(page.locator("#bodies tr")).to_have_count(4)
    page.click("#stop")
    expect(page.locator("#stopped")).to_have_text("Every controller of every gateway reports standstill.")
    plant.gateways[1].kill()
    page.click("#stop")
    expect(page.locator("#stopped")).to_contain_text("stocker2 was not reached")
    expect(page.locator("#stopped")).to_contain_text("hardware stop")
    expect(page.locator("#gateways li.unheard")).to_contain_text("stocker2")
    expect(page.locator("#bodies tr.unheard")).to_have_count(2)
    plant.gateways[1].start()


@pytest.mark.long
def test_who_has_signed_in_to_the_plant_works_in_the_console_of_each_gateway(
    browser: Browser, tmp_path: Path
) -> None:
    with ExitStack() as stack:
        guarded = Guarded(tmp_path, stack)
        key, (one, _) = guarded.key("operator-1", "operator"), guarded.gateways
        one.http.headers.update(shown(key))
        until(lambda: one.http.get("/bodies").is_success, "the gateway knows the key")
        page = browser.new_context(locale="en-GB").new_page()
        page.goto(guarded.process.url)
        page.get_by_label("Key").fill(key)
        page.get_by_role("button", name="Sign in").click()
        with page.expect_popup() as opened:
            page.locator("#gateways li", has_text="stocker1").get_by_role("link", name="console").click()
        console = opened.value
        console.goto(f"{guarded.process.url}/gateways/stocker1/#/axis/line1.3F")
        with console.expect_websocket(lambda it: "/gateways/stocker1/events" in it.url):
            console.reload()
        console.get_by_label("Target (pulse)").fill("30")
        console.get_by_role("button", name="Go", exact=True).click()
        until(lambda: one.get("/bodies/3F")["position"] == 30, "it has moved")
        one.program.said('caller="operator-1')
