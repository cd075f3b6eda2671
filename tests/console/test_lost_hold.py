"""A key that jogs while the finger, the page or the network is lost: whatever moves comes to a standstill."""

from collections.abc import Callable

import httpx
import pytest
from playwright.sync_api import Page

from tests.console.browser import Console
from tests.e2e.processes import until

pytestmark = pytest.mark.prove

Open = Callable[..., Console]
KEYS = {
    "line1.3F": ("Jog +", "/bodies/line1.3F"),
    "r1": ("Jog X+", "/robots/r1"),
    "wafer": ("Jog X+", "/scaras/wafer"),
}
HIDDEN = """() => {
    Object.defineProperty(document, "visibilityState", { value: "hidden" });
    document.dispatchEvent(new Event("visibilitychange"));
}"""
"""Another app comes before the page: no browser without a window tells of it."""
LOST: dict[str, Callable[[Page], None]] = {
    "finger": lambda page: page.mouse.up(),
    "page": lambda page: page.close(),
    "view": lambda page: page.evaluate(HIDDEN),
    "turn": lambda page: page.set_viewport_size({"width": 844, "height": 390}),
    "network": lambda page: page.context.set_offline(True),
}


def moving(demo: str, path: str) -> bool:
    """A SCARA robot stands between its short ways for a moment."""
    told = httpx.get(f"{demo}{path}").json()
    return bool(told["moving"])


@pytest.mark.parametrize(
    ("of", "lost"),
    [
        *(("line1.3F", "finger"), ("r1", "finger"), ("wafer", "finger")),
        *(("line1.3F", "page"), ("r1", "network"), ("line1.3F", "view"), ("r1", "turn")),
    ],
)
def test_what_is_held_stops_when_its_hold_is_lost(demo: str, open_console: Open, of: str, lost: str) -> None:
    key, path = KEYS[of]
    if of == "r1":  # its axes are converted, and jog only when they are homed
        home = f"{demo}{path}/units/1/moves?wait=60"
        httpx.post(home, json={"kind": "home"}, timeout=90).raise_for_status()
    console = open_console(demo, f"#/pendant/{of}")
    console.hold(key, lambda: moving(demo, path))
    LOST[lost](console.page)
    stood: list[bool] = []

    def stands() -> bool:
        stood.append(not moving(demo, path))
        return len(stood) > 20 and all(stood[-20:])

    until(stands, "it stands still, and goes on standing")
