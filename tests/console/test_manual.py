"""The documents that the gateway serves: read and searched in a browser, under the policy they come with."""

import subprocess
import sys
from collections.abc import Callable, Iterator

import pytest
from playwright.sync_api import Browser, Page, expect

from tests.console.browser import PATIENCE_MS, Console, demo_in
from tests.console.console import ROOT

pytestmark = pytest.mark.prove


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """A demo that was started when the site of today was there."""
    pytest.importorskip("zensical")
    subprocess.run([sys.executable, ROOT / "packaging" / "site.py"], check=True)  # noqa: S603
    with demo_in(tmp_path_factory.mktemp("manual")) as url:
        yield url


@pytest.fixture
def manual(browser: Browser, served: str) -> Iterator[Callable[[str], Page]]:
    """Open a page of the manual; nothing of it may be refused by its policy, or come from elsewhere."""
    faults: list[str] = []

    def open_(path: str) -> Page:
        page = browser.new_page(viewport={"width": 390, "height": 844})
        page.set_default_timeout(PATIENCE_MS)
        page.on("console", lambda said: faults.append(said.text) if said.type == "error" else None)
        page.on("pageerror", lambda error: faults.append(str(error)))
        page.on(
            "request",
            lambda asked: (
                None if asked.url.startswith((served, "data:", "blob:")) else faults.append(asked.url)
            ),
        )
        page.goto(f"{served}/manual{path}")
        return page

    yield open_
    assert faults == []


@pytest.mark.parametrize(
    ("path", "typed", "found"),
    [("/", "cursor", "Follow events over a restart"), ("/ja/index.html", "回路", "軸の停止回路が開いた")],
    ids=["en", "ja"],
)
def test_it_is_searched_without_internet(
    manual: Callable[[str], Page], path: str, typed: str, found: str
) -> None:
    page = manual(path)
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    page.set_viewport_size({"width": 1280, "height": 900})
    page.get_by_role("button", name="Search").first.click()
    page.get_by_role("combobox").fill(typed)
    page.get_by_role("option", name=found).first.click()
    expect(page.get_by_role("heading", name=found)).to_be_visible()


def test_the_console_leads_to_it(served: str, open_console: Callable[..., Console]) -> None:
    console = open_console(served, "#/system", "ja")
    console.page.get_by_role("link", name="説明書").click()
    expect(console.page.get_by_role("heading", name="日本語のページ")).to_be_visible()
