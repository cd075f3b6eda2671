"""A real browser before a real gateway, whose line and robot are simulated."""

from collections.abc import Callable, Iterator

import pytest
from playwright.sync_api import Browser, Page, sync_playwright

from tests.console.browser import (
    CHROMIUM,
    PATIENCE_MS,
    PATIENTLY,
    Console,
    Guarded,
    Plant,
    demo_in,
    guarded_in,
    plant_in,
)
from tests.e2e.conftest import no_program_outlives_its_tests, programs_words

__all__ = ["no_program_outlives_its_tests", "programs_words"]


@pytest.fixture(scope="module")
def chromium() -> Iterator[Browser]:
    """One for each file: while it is there, an event loop runs that other tests would trip over."""
    if not CHROMIUM:
        pytest.skip("make test installs Chromium")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=CHROMIUM, args=["--no-sandbox"], timeout=PATIENCE_MS
        )
        yield browser
        browser.close()


@pytest.fixture
def browser(chromium: Browser) -> Iterator[Browser]:
    """The browser; no page outlives its test."""
    yield chromium
    for context in chromium.contexts:
        context.close()


@pytest.fixture(scope="session")
def shared_plant(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Plant]:
    with plant_in(tmp_path_factory.mktemp("console")) as plant:
        yield plant


@pytest.fixture
def plant(shared_plant: Plant) -> Iterator[Plant]:
    """The plant that the pages share; each finds it standing still."""
    shared_plant.line.begin_anew()
    yield shared_plant
    shared_plant.gateway.http.post("/stop")
    shared_plant.gateway.http.post("/robots/r1/errors/reset")  # a stop of the robot is an error, too


@pytest.fixture(scope="session")
def shared_guarded(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Guarded]:
    with guarded_in(tmp_path_factory.mktemp("guarded")) as guarded:
        yield guarded


@pytest.fixture
def guarded(shared_guarded: Guarded) -> Guarded:
    """The gateway that needs keys."""
    shared_guarded.line.begin_anew()
    return shared_guarded


@pytest.fixture(scope="session")
def demo(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """The demo, which has a SCARA robot."""
    with demo_in(tmp_path_factory.mktemp("demo")) as url:
        yield url


@pytest.fixture
def open_console(browser: Browser) -> Iterator[Callable[..., Console]]:
    """Open consoles; none may have reported a fault that the test does not expect."""
    pages: list[Page] = []
    faults: list[str] = []

    def open_(
        url: str,
        path: str = "",
        language: str = "en",
        colours: str = "light",
        key: str = "",
        *,
        tablet: bool = False,
        faulty: bool = False,
    ) -> Console:
        context = browser.new_context(
            locale={"en": "en-GB", "ja": "ja-JP"}[language],
            color_scheme="dark" if colours == "dark" else "light",
            viewport={"width": 820, "height": 1180} if tablet else {"width": 1280, "height": 900},
            has_touch=tablet,
            permissions=["clipboard-read", "clipboard-write"],
        )
        context.set_default_timeout(PATIENCE_MS)
        context.add_init_script(PATIENTLY)
        page = context.new_page()
        page.on("pageerror", lambda error: None if faulty else faults.append(str(error)))
        page.on("console", lambda said: faults.append(said.text) if "Content Security" in said.text else None)
        pages.append(page)
        page.goto(f"{url}/{path}")
        if key:
            page.get_by_label("Key").fill(key)
            page.get_by_role("button", name="Sign in").click()
        return Console(page)

    yield open_
    for page in pages:
        page.context.close()
    assert not faults
