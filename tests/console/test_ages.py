"""An old value never looks like one of now."""

import re
import signal
from collections.abc import Callable, Iterator

import pytest
from playwright.sync_api import Locator, WebSocket, WebSocketRoute, expect

from tests.console.browser import Console, Plant, plant_in
from tests.e2e.processes import LONGEST_WAIT_S, until

pytestmark = pytest.mark.prove

Open = Callable[..., Console]
FAR = 2_000_000
AS_LAST_KNOWN = re.compile(r"as last known, \d+ s ago")
HALF_A_MINUTE_S = 30


@pytest.fixture(scope="module")
def own(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Plant]:
    """A plant whose parts are switched off."""
    with plant_in(tmp_path_factory.mktemp("ages")) as plant:
        yield plant


@pytest.fixture
def dying(own: Plant) -> Iterator[Plant]:
    """Give the plant, and switch everything on again at the end."""
    yield own
    own.robot.program.signal(signal.SIGCONT)
    own.gateway.program.signal(signal.SIGCONT)
    own.line.tell("PUT", "/bodies/3F/power", on=True)
    own.line.tell("PUT", "/link/power", on=True)
    until(lambda: own.gateway.get("/bodies/3F")["online"], "the body is back")
    until(lambda: own.gateway.get("/robots/r1")["online"], "the robot is back")
    own.gateway.http.post("/stop")
    own.gateway.http.post("/bodies/3F/power-cycle/acknowledge")
    for alarm in own.gateway.get("/alarms")["alarms"]:
        own.gateway.http.post(f"/alarms/{alarm['id']}/reset")


def is_old(shown: Locator) -> None:
    """Struck out, whatever the rest of the page is."""
    expect(shown).to_have_css("text-decoration-line", "line-through")


def is_of_now(shown: Locator) -> None:
    expect(shown).to_have_css("text-decoration-line", "none")


def test_a_body_without_power_has_no_present_place(dying: Plant, open_console: Open) -> None:
    console = open_console(dying.url)
    tile = console.page.get_by_role("link", name="line1.3F")
    place = tile.locator(".place")
    expect(tile).to_contain_text("stands still")
    is_of_now(place)
    dying.line.tell("PUT", "/bodies/3F/power", on=False)
    expect(tile).to_contain_text("does not answer")
    expect(tile).to_contain_text(AS_LAST_KNOWN)
    is_old(place)
    is_of_now(console.page.get_by_role("link", name="line1.01").locator(".place"))
    assert console.faults() == []
    dying.line.tell("PUT", "/bodies/3F/power", on=True)
    expect(tile).not_to_contain_text("as last known")
    is_of_now(place)


def test_a_line_that_fell_silent_leaves_no_present_value_on_the_page_of_an_axis(
    dying: Plant, open_console: Open
) -> None:
    console = open_console(dying.url, "#/axis/line1.3F")
    big = console.page.locator(".big")
    signals = console.page.get_by_role("region", name="Inputs / Outputs")
    expect(signals.get_by_role("button", name="Outputs 0", exact=True)).to_be_visible()
    dying.gateway.moving("3F", FAR)
    expect(console.page.get_by_role("progressbar")).to_be_visible()
    dying.line.tell("PUT", "/link/power", on=False)
    expect(console.page.get_by_text(AS_LAST_KNOWN)).to_be_visible()
    is_old(big)
    expect(console.page.get_by_role("progressbar")).to_have_count(0)
    expect(signals).to_contain_text("Not known now.")
    expect(console.page.get_by_role("region", name="Sensors and status")).to_contain_text("Not known now.")


def test_a_robot_that_is_silent_has_no_present_place(dying: Plant, open_console: Open) -> None:
    home = dying.gateway.http.post(
        "/robots/r1/units/1/moves", params={"wait": LONGEST_WAIT_S}, json={"kind": "home"}
    )
    assert home.json()["status"] == "succeeded", home.text
    console = open_console(dying.url)
    tile = console.page.get_by_role("link", name="r1")
    axes = tile.locator(".number.row")
    expect(axes).to_contain_text(re.compile(r"X [\d.-]+ mm"))
    is_of_now(axes)
    dying.robot.program.signal(signal.SIGSTOP)
    expect(tile).to_contain_text("does not answer")
    expect(tile).to_contain_text(AS_LAST_KNOWN)
    is_old(axes)
    dying.robot.program.signal(signal.SIGCONT)
    expect(tile).not_to_contain_text("as last known")
    is_of_now(axes)


def test_a_gateway_that_is_held_up_tells_nothing_new(dying: Plant, open_console: Open) -> None:
    """No connection breaks: it is only that nothing comes any more."""
    console = open_console(dying.url)
    tile = console.page.get_by_role("link", name="line1.3F")
    dying.gateway.moving("3F", FAR)
    expect(tile.get_by_role("progressbar")).to_be_visible()
    dying.gateway.program.signal(signal.SIGSTOP)
    expect(tile).to_contain_text(AS_LAST_KNOWN)
    is_old(tile.locator(".place"))
    console.shows("No connection to the gateway. What is shown is from")
    console.page.keyboard.press("Escape")
    console.shows("No answer yet. Use the hardware stop if anything moves.")
    dying.gateway.program.signal(signal.SIGCONT)
    expect(console.page.locator(".banner")).to_have_count(0)
    console.shows("Everything stands still")
    expect(tile).not_to_contain_text("as last known")


def test_a_page_that_has_slept_shows_nothing_as_of_now_before_it_has_asked(
    dying: Plant, open_console: Open
) -> None:
    console = open_console(dying.url)
    tile = console.page.get_by_role("link", name="line1.3F")
    expect(tile).to_contain_text("stands still")
    sockets: list[WebSocket] = []
    console.page.on("websocket", lambda socket: sockets.append(socket))
    console.page.clock.install()
    console.page.reload()
    expect(tile).to_contain_text("stands still")
    before = len(sockets)
    console.page.route("**/bodies", lambda route: route.abort())
    console.page.clock.fast_forward(HALF_A_MINUTE_S * 1000)
    console.shows("No connection to the gateway. What is shown is from")
    is_old(tile.locator(".place"))
    console.page.unroute("**/bodies")
    expect(console.page.locator(".banner")).to_have_count(0)
    is_of_now(tile.locator(".place"))
    assert len(sockets) >= before + 2, "streams that may be dead are opened anew"


def test_streams_that_have_died_without_a_word_are_opened_anew(dying: Plant, open_console: Open) -> None:
    """All else is answered: only what was open already says nothing any more."""
    console = open_console(dying.url)
    carried: list[WebSocketRoute] = []
    dead: list[WebSocketRoute] = []

    def carry(socket: WebSocketRoute) -> None:
        carried.append(socket)
        server = socket.connect_to_server()
        server.on_message(lambda message: None if socket in dead else socket.send(message))

    console.page.route_web_socket("**/events?*", carry)
    console.page.reload()
    tile = console.page.get_by_role("link", name="line1.3F")
    move = dying.gateway.moving("3F", FAR)
    expect(tile).to_contain_text("relative: moves")
    dead.extend(carried)
    dying.gateway.http.post("/stop").raise_for_status()
    dying.gateway.ended("3F", move["id"])
    expect(tile).to_contain_text("relative: stopped")
    expect(tile).not_to_contain_text("as last known")


def test_after_a_crash_of_the_gateway_a_tile_follows_the_move_that_goes_on(
    dying: Plant, open_console: Open
) -> None:
    console = open_console(dying.url)
    tile = console.page.get_by_role("link", name="line1.3F")
    dying.gateway.moving("3F", FAR)
    expect(tile).to_contain_text("relative: moves")
    dying.gateway.kill()
    console.shows("No connection to the gateway. What is shown is from")
    is_old(tile.locator(".place"))
    dying.gateway.start()
    dying.gateway.wait_until_ready()
    expect(console.page.locator(".banner")).to_have_count(0)
    expect(tile).not_to_contain_text("as last known")
    is_of_now(tile.locator(".place"))
    expect(tile).to_contain_text("relative: moves")
    dying.gateway.http.post("/stop").raise_for_status()
    expect(tile).to_contain_text("relative: stopped")
