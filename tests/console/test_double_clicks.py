"""A double click, and a key that is held, do once whatever a button does."""

from collections.abc import Callable

import pytest
from playwright.sync_api import Locator, expect

from tests.console.browser import Console, Plant
from tests.e2e.processes import until

pytestmark = pytest.mark.prove

Open = Callable[..., Console]
STEP, BODY, UNIT = "Step +1000 pulse", "/bodies/3F", "/robots/r1/units/1"
APART_MS = 300
"""Milliseconds between the clicks of a slow double click; the first is answered by then."""


def moves(plant: Plant, of: str) -> list[str]:
    return [move["kind"] for move in plant.gateway.get(f"{of}/moves")["moves"]]


def stands(plant: Plant) -> bool:
    body, robot = plant.gateway.get("/bodies/3F/status"), plant.gateway.get("/robots/r1")
    return not (body["moving"] or robot["moving"])


SLOWLY = "(it, ms) => new Promise((done) => { it.click(); setTimeout(() => done(it.click()), ms); })"
"""Two clicks within the page: on a busy machine those of a driver come too far apart."""


def twice(button: Locator, delay: float = 0) -> None:
    """Click it twice, as a double click is."""
    expect(button).to_have_attribute("aria-disabled", "false")
    if delay:
        button.evaluate(SLOWLY, delay)
        return
    button.click()
    button.click(click_count=2, force=True)


@pytest.mark.parametrize("delay", [0, APART_MS])
def test_a_double_click_on_a_step_is_one_step(plant: Plant, open_console: Open, delay: float) -> None:
    console = open_console(plant.url, "#/axis/line1.3F")
    console.button("1000").click()
    start, known = plant.gateway.get("/bodies/3F/position")["pulses"], len(moves(plant, BODY))
    twice(console.button(STEP), delay)
    until(lambda: plant.gateway.get("/bodies/3F/position")["pulses"] >= start + 1000, "it has stepped")
    until(lambda: stands(plant), "it stands still")
    assert plant.gateway.get("/bodies/3F/position")["pulses"] == start + 1000
    assert len(moves(plant, BODY)) == known + 1
    expect(console.page.locator(".notices .bad")).to_have_count(0)
    console.button(STEP).click()
    until(lambda: len(moves(plant, BODY)) == known + 2, "a later click is another step")


@pytest.mark.parametrize("name", ["Go", "Home"])
def test_a_double_click_moves_a_body_once(plant: Plant, open_console: Open, name: str) -> None:
    console = open_console(plant.url, "#/axis/line1.3F")
    console.page.get_by_label("Target (pulse)").fill("2500")
    known = len(moves(plant, BODY))
    twice(console.button(name))
    until(lambda: len(moves(plant, BODY)) > known, "it moves")
    console.page.wait_for_timeout(APART_MS)
    assert len(moves(plant, BODY)) == known + 1
    expect(console.page.locator(".notices .bad")).to_have_count(0)


def test_a_double_click_moves_a_robot_once(plant: Plant, open_console: Open) -> None:
    plant.gateway.http.post(f"{UNIT}/moves?wait=60", json={"kind": "home"}).raise_for_status()
    console = open_console(plant.url, "#/robot/r1")
    console.page.get_by_label("Kind").select_option("relative")
    console.page.get_by_label("Target X (mm)").fill("1")
    known = len(moves(plant, UNIT))
    twice(console.button("Move"))
    until(lambda: len(moves(plant, UNIT)) > known and stands(plant), "it has moved")
    assert len(moves(plant, UNIT)) == known + 1
    expect(console.page.locator(".notices .bad")).to_have_count(0)


def test_a_double_click_teaches_one_number(plant: Plant, open_console: Open) -> None:
    console = open_console(plant.url, "#/pendant/line1.3F")
    console.page.get_by_label("Number").fill("30")
    twice(console.button("Teach here as"))
    expect(console.page.get_by_label("Number")).to_have_value("31")
    console.page.wait_for_timeout(APART_MS)
    expect(console.page.get_by_label("Number")).to_have_value("31")


def test_a_key_that_is_held_on_a_step_is_one_step(plant: Plant, open_console: Open) -> None:
    console = open_console(plant.url, "#/axis/line1.3F")
    step = console.button(STEP)
    console.button("1000").click()
    expect(step).to_have_attribute("aria-disabled", "false")
    known = len(moves(plant, BODY))
    step.focus()
    for _ in range(10):  # as a keyboard repeats it
        console.page.keyboard.down("Enter")
        console.page.wait_for_timeout(APART_MS)
    console.page.keyboard.up("Enter")
    until(lambda: len(moves(plant, BODY)) > known and stands(plant), "it has stepped")
    assert len(moves(plant, BODY)) == known + 1
