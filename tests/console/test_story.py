"""An operator's story in a real browser: look at the plant, move a motor by hand, stop everything."""

from collections.abc import Callable

from playwright.sync_api import expect

from tests.console.browser import Console, Plant

FAR = 2_000_000


def test_an_operator_moves_a_motor_by_hand_and_stops_everything(
    plant: Plant, open_console: Callable[..., Console]
) -> None:
    plant.gateway.http.put("/bodies/3F/position", json={"value": 0, "unit": "pulse"}).raise_for_status()
    console = open_console(plant.url)
    expect(console.page.get_by_role("link", name="line1.3F")).to_contain_text("stands still")
    console.go("#/axis/line1.3F")
    console.button("1000").click()
    console.button("Step +1000 pulse").click()
    expect(console.page.locator(".big b")).to_have_text("1\u202f000")
    plant.gateway.moving("3F", FAR)
    console.page.keyboard.press("Escape")
    console.shows("Everything stands still")
    assert plant.gateway.get("/bodies/3F/status")["moving"] is False
