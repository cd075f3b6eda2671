"""Each action of a user has an answer: a refusal and a missing answer are shown."""

import signal
from collections.abc import Callable, Iterator
from pathlib import Path

import httpx
import pytest
from playwright.sync_api import Route, expect

from tests.console.browser import AFTER_A_DOUBLE_CLICK_MS, Console, Guarded, Plant, plant_in
from tests.e2e.processes import until

pytestmark = pytest.mark.prove

Open = Callable[..., Console]
FAR = 2_000_000


@pytest.fixture
def held_up(plant: Plant) -> Iterator[Plant]:
    """The plant whose gateway can be stopped for a while."""
    yield plant
    plant.gateway.program.signal(signal.SIGCONT)
    until(lambda: plant.gateway.http.get("/readyz").is_success, "the gateway is ready again")


def moves_of(plant: Plant) -> int:
    return len(plant.gateway.http.get("/bodies/3F/moves").json()["moves"])


def test_a_second_click_before_the_answer_is_told_as_not_done(plant: Plant, open_console: Open) -> None:
    console = open_console(plant.url, "#/axis/line1.3F")
    asked: list[Route] = []
    console.page.route(
        "**/bodies/line1.3F/moves",
        lambda route: asked.append(route) if route.request.method == "POST" else route.continue_(),
    )
    step = console.button("Step +100 pulse")
    expect(step).to_have_attribute("aria-disabled", "false")
    step.dblclick()
    console.page.wait_for_timeout(AFTER_A_DOUBLE_CLICK_MS)
    expect(console.page.locator(".notices .bad")).to_have_count(0)
    step.click()
    console.shows("It is being done already: wait for its answer.")
    assert len(asked) == 1
    begun = moves_of(plant)
    asked[0].continue_()
    until(lambda: moves_of(plant) == begun + 1, "the step is made, once")
    console.page.unroute("**/bodies/line1.3F/moves")
    console.page.wait_for_timeout(AFTER_A_DOUBLE_CLICK_MS)
    expect(step).to_have_attribute("aria-disabled", "false")
    step.click()
    until(lambda: moves_of(plant) == begun + 2, "the button works again")


def test_what_a_gateway_that_does_not_answer_was_asked_for_is_told_as_unanswered(
    held_up: Plant, open_console: Open
) -> None:
    console = open_console(held_up.url, "#/axis/line1.3F")
    step = console.button("Step +100 pulse")
    expect(step).to_have_attribute("aria-disabled", "false")
    held_up.gateway.program.signal(signal.SIGSTOP)
    step.click()
    console.shows("Step +100 pulse: no answer yet.")
    console.shows("Whether it was done is not known: look before you repeat it.")
    step.click(force=True)
    console.shows("There is no connection to the gateway.")
    console.page.keyboard.press("Escape")
    expect(console.page.locator(".told")).to_contain_text(
        "No answer yet. Use the hardware stop if anything moves.", timeout=1_000
    )
    held_up.gateway.program.signal(signal.SIGCONT)
    console.shows("Everything stands still")


def test_control_that_somebody_else_has_taken_is_told_as_lost(guarded: Guarded, open_console: Open) -> None:
    console = open_console(guarded.url, key=guarded.key("saburo", "operator"))
    console.go("#/axis/line1.3F")
    console.button("Take control").click()
    console.shows("You have control.")
    chief = {"Authorization": f"Bearer {guarded.key('shiro', 'admin')}"}
    lease = {"scope": "line1.3F", "ttl_s": 10, "take_over": True}
    taken = httpx.post(f"{guarded.url}/leases", headers=chief, json=lease)
    assert taken.is_success, taken.text
    console.shows("You have lost control of line1.3F.")
    console.shows("shiro has control.")
    console.button("Step +100 pulse").click(force=True)
    console.shows("shiro has leased it: only they may move it.")


def test_a_scan_that_a_new_gateway_knows_nothing_of_can_be_begun_again(
    tmp_path: Path, open_console: Open
) -> None:
    with plant_in(tmp_path) as plant:
        console = open_console(plant.url)
        console.button("Scan").click()
        console.shows("Asked")
        plant.gateway.kill()
        plant.gateway.start()
        plant.gateway.wait_until_ready()
        console.shows("Scan: not done.")
        expect(console.button("Scan")).to_have_attribute("aria-disabled", "false")
