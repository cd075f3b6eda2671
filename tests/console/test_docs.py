"""The documentation as a newcomer uses it, in a real browser."""

import pytest
from playwright.sync_api import Browser, expect

from tests.console.browser import PATIENCE_MS, Plant

pytestmark = pytest.mark.prove


@pytest.mark.parametrize("page_of", ["/docs", "/docs/resources", "/docs/all"])
def test_an_example_is_tried_out_as_it_stands(plant: Plant, browser: Browser, page_of: str) -> None:
    page = browser.new_page()
    page.set_default_timeout(PATIENCE_MS)
    faults: list[str] = []
    page.on("pageerror", lambda error: faults.append(str(error)))
    page.on("console", lambda said: faults.append(said.text) if said.type == "error" else None)
    page.goto(plant.url + page_of)
    page.locator("#operations-tag-moves").click()
    start = page.locator("#operations-moves-startMove")
    start.locator(".opblock-summary-control").click()
    start.get_by_role("button", name="Try it out").click()
    start.get_by_placeholder("body_id").fill("3F")
    start.get_by_role("button", name="Execute").click()
    expect(start.locator(".live-responses-table .response-col_status").last).to_contain_text("202")
    assert faults == []


def test_the_documents_lead_to_each_other(plant: Plant, browser: Browser) -> None:
    page = browser.new_page()
    page.set_default_timeout(PATIENCE_MS)
    page.goto(f"{plant.url}/docs")
    page.get_by_role("link", name="All resources and commands").click()
    expect(page.locator("#operations-tag-scaras")).to_be_visible()
    page.get_by_placeholder("Filter by tag").fill("captures")
    expect(page.locator("#operations-tag-scaras")).to_have_count(0)
    page.get_by_role("link", name="What is needed first").click()
    expect(page.locator("#operations-tag-moves")).to_be_visible()
    expect(page.locator("#operations-tag-scaras")).to_have_count(0)
