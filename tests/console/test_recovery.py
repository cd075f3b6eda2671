"""The panel of the demo breaks things, and the console leads back to work, as in docs/recovery.md."""

from collections.abc import Callable, Iterator

import httpx
import pytest
from playwright.sync_api import expect

from tests.console.browser import Console, demo_in
from tests.e2e.processes import until
from tests.recovery.page import label_of
from tests.recovery.stories import DISK, END, HOME, STORIES, Story

pytestmark = pytest.mark.prove
FAR = {"kind": "relative", "direction": "cw", "distance": {"value": 400_000, "unit": "pulse"}, "pattern": 12}
DONE = "Back to work after"
AT_ORIGIN = {"kind": "absolute", "position": {"value": 0, "unit": "pulse"}}
STEP = {"kind": "relative", "direction": "cw", "distance": {"value": 500, "unit": "pulse"}}
FAR_OF_ROBOT = {"kind": "relative", "axes": {"Z": {"value": 50, "unit": "mm"}}}
STEP_OF_ROBOT = {"kind": "relative", "axes": {"Z": {"value": 1, "unit": "mm"}}}
BUTTONS = {
    "ems": "Press the stop circuit",
    "limit": "Limit sensor on",
    "power": "Cut the power",
    "cable": "Pull the cable",
    "driver": "Driver error",
    "dead": "Dead controller",
    "disk": "Full disk",
}


@pytest.fixture(scope="module")
def broken(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """A demo of its own: the others find theirs whole."""
    with demo_in(tmp_path_factory.mktemp("broken")) as url:
        yield url


@pytest.mark.parametrize("story", [*STORIES, DISK], ids=lambda story: story.id)
def test_from_a_fault_to_the_next_good_move(
    broken: str, open_console: Callable[..., Console], story: Story
) -> None:
    console = open_console(broken, "#/system")
    robot = story.target == "r1"
    told = story.told.replace("line1.3F", "lift (line1.3F)")  # the console names what has a name
    moves = f"{broken}/robots/r1/units/1/moves" if robot else f"{broken}/bodies/line1.3F/moves"
    start_over(moves, robot)
    if story.moving:
        httpx.post(moves, json=FAR_OF_ROBOT if robot else FAR).raise_for_status()
    if story is not DISK:
        console.page.get_by_label("Where").select_option(story.target)
    console.button(BUTTONS[story.kind]).click()
    expect(console.page.get_by_role("timer")).to_be_visible()
    if story is DISK:
        assert httpx.post(moves, json=STEP).status_code == 503
    if not story.is_told_when_mended:
        console.shows(told)
    else:
        console.shows("does not answer any more")
    for tap in story.taps:
        if tap == HOME and robot:
            console.shows(DONE)
            home_on_its_page(console, moves)
        else:
            console.button(label_of(story, tap)).first.click()
        if tap == END and story.is_told_when_mended:
            console.shows(told)
    if console.page.url.endswith("#/system"):
        console.shows(DONE)
    moved = httpx.post(f"{moves}?wait=30", json=STEP_OF_ROBOT if robot else STEP, timeout=60).json()
    assert moved["status"] == "succeeded"
    for alarm in httpx.get(f"{broken}/alarms").json()["alarms"]:
        httpx.post(f"{broken}/alarms/{alarm['id']}/reset")


def home_on_its_page(console: Console, moves: str) -> None:
    """Press *Home* where the robot is; the stopwatch, which is elsewhere, has stopped."""
    console.go("#/robot/r1")
    before = httpx.get(moves).json()["moves"][0]["id"]
    console.button("Home").click()

    def is_homed() -> bool:
        newest = httpx.get(moves).json()["moves"][0]
        return newest["id"] != before and (newest["kind"], newest["status"]) == ("home", "succeeded")

    until(is_homed, "the robot is homed")


def start_over(moves: str, robot: bool) -> None:
    """Home the robot, and send the lift to its origin: searched for from far away, it takes a minute."""
    begin = {"kind": "home"} if robot else AT_ORIGIN
    done = httpx.post(f"{moves}?wait=60", json=begin, timeout=90).json()
    assert done["status"] == "succeeded", done
