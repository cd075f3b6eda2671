"""The console as an operator uses it, in a real browser."""

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

import httpx
import pytest
from playwright.sync_api import Locator, Route, expect

from tests.console.browser import SCAN_MS, Console, Guarded, Plant, plant_in
from tests.e2e.processes import LONGEST_WAIT_S, simulated_line, simulated_robot, until

pytestmark = pytest.mark.prove

Open = Callable[..., Console]

PAGES = (
    *("#/", "#/axis/line1.3F", "#/robot/r1", "#/positions/line1.3F", "#/motion/line1.3F"),
    *("#/program/line1.3F", "#/settings/line1.3F", "#/events", "#/shift", "#/wire/line1", "#/system"),
    *("#/commission/line1", "#/recordings"),
)
TITLES = {
    "en": (
        *("Plant", "line1.3F", "r1", "Positions", "Motion"),
        *("Program", "Settings", "Events", "Shift", "Wire", "System", "First contact", "Recordings"),
    ),
    "ja": (
        *("設備", "line1.3F", "r1", "位置", "加減速"),
        *("プログラム", "設定", "イベント", "シフト", "通信", "システム", "初回確認", "記録"),
    ),
}
FAR = 2_000_000
READS: Final = re.compile("/curve|/commands/get-")
"""Paths that a page reads with POST, and that change nothing."""


def moves(plant: Plant, body: str = "3F") -> bool:
    return bool(plant.gateway.get(f"/bodies/{body}/status")["moving"])


@pytest.mark.parametrize(("language", "colours"), [("en", "light"), ("ja", "dark")])
def test_every_page_speaks_the_language_and_has_no_serious_fault(
    plant: Plant, open_console: Open, language: str, colours: str
) -> None:
    console = open_console(plant.url, "#/", language, colours)
    for path, title in zip(PAGES, TITLES[language], strict=True):
        console.go(path)
        expect(console.page.get_by_role("heading", level=1)).to_contain_text(title)
        assert console.page.locator("html").get_attribute("lang") == language
        assert console.faults() == [], path


def test_a_shift_is_summed_up_on_a_page_that_links_to_its_slowest_move(
    plant: Plant, open_console: Open
) -> None:
    plant.gateway.move("3F", 500, wait=LONGEST_WAIT_S)
    console = open_console(plant.url, "#/events")
    console.page.get_by_role("link", name="Shift").click()
    moves = console.page.get_by_role("region", name="Moves")
    row = moves.get_by_role("row").filter(has_text="line1.3F")
    expect(row).to_be_visible()
    row.get_by_role("link").click()
    expect(console.page.get_by_role("heading", level=1)).to_contain_text("Why?")


def test_a_line_is_commissioned_from_its_page(plant: Plant, open_console: Open) -> None:
    console = open_console(plant.url, "#/system")
    console.page.get_by_role("link", name="line1", exact=True).click()
    console.page.get_by_role("button", name="Try by questions").click()
    results = console.page.get_by_role("region", name="Results")
    row = results.get_by_role("row").filter(has_text="silent-xid")
    expect(row).to_contain_text("XID is answered", timeout=LONGEST_WAIT_S * 1000)
    expect(results).not_to_contain_text("contradicts")
    expect(console.page.get_by_role("region", name="Frames")).to_be_visible()
    until(lambda: plant.gateway.get("/lines/line1")["state"] == "ready", "the line serves again")


def test_a_tile_follows_a_move_from_its_start_to_its_end(plant: Plant, open_console: Open) -> None:
    console = open_console(plant.url)
    tile = console.page.get_by_role("link", name="line1.3F")
    expect(tile).to_contain_text("stands still")
    plant.gateway.moving("3F", FAR)
    expect(tile).to_contain_text("moves")
    expect(tile.get_by_role("progressbar")).to_be_visible()
    plant.gateway.http.post("/bodies/3F/stop").raise_for_status()
    expect(tile).to_contain_text("relative: stopped")
    ended = plant.gateway.ended("3F", plant.gateway.moving("3F", 100)["id"])
    expect(tile).to_contain_text("relative: succeeded")
    expect(tile).to_contain_text(f"{ended['position']:,}".replace(",", "\u202f"))


def test_groups_are_frames_round_their_members(plant: Plant, open_console: Open) -> None:
    console = open_console(plant.url)
    group = console.page.get_by_role("group", name="Group line1.80")
    expect(group.get_by_role("link")).to_have_count(2)


def test_escape_stops_everything_even_in_a_field(plant: Plant, open_console: Open) -> None:
    console = open_console(plant.url, "#/axis/line1.3F")
    plant.gateway.moving("3F", FAR)
    console.page.get_by_label("Target (pulse)").focus()
    console.page.keyboard.press("Escape")
    console.shows("Everything stands still: 4 confirmed")
    assert not moves(plant)


def test_space_stops_outside_fields_and_writes_a_blank_in_them(plant: Plant, open_console: Open) -> None:
    console = open_console(plant.url, "#/events")
    console.page.get_by_label("Contains").press("Space")
    plant.gateway.moving("3F", FAR)
    assert moves(plant)
    pause = console.button("Pause")
    pause.focus()
    console.page.keyboard.press("Space")
    console.shows("Everything stands still")
    expect(pause).to_be_visible()
    assert not moves(plant)


def test_a_stop_is_heard_while_the_page_is_busy(plant: Plant, open_console: Open) -> None:
    console = open_console(plant.url, "#/wire/line1")
    plant.gateway.moving("3F", FAR)
    console.page.evaluate("""() => setInterval(() => {
        const until = performance.now() + 100;
        while (performance.now() < until);
        for (let n = 0; n < 3; n++) fetch("lines/line1/trace?limit=5000");
    }, 110)""")
    console.page.keyboard.press("Escape")
    (stop,) = until(lambda: plant.line.truth("pulses_stop"), "the motor is stopped")
    assert stop.facts["why"] != "done"
    console.shows("Everything stands still")


def test_a_motor_is_stepped_sent_to_a_place_and_homed(plant: Plant, open_console: Open) -> None:
    plant.gateway.http.put("/bodies/3F/position", json={"value": 0, "unit": "pulse"}).raise_for_status()
    console = open_console(plant.url, "#/axis/line1.3F")
    place = console.page.locator(".big b")
    console.button("1000").click()
    console.button("Step +1000 pulse").click()
    expect(place).to_have_text("1\u202f000")
    expect(console.button("Go")).to_have_attribute("aria-disabled", "true")
    console.page.get_by_label("Target (pulse)").fill("-250")
    console.button("Go").click()
    expect(place).to_have_text("-250")
    console.page.get_by_role("button", name="Home", exact=True).click()
    console.shows("homing")
    expect(console.page.get_by_role("row", name="homing").first).to_contain_text("moves")


def test_what_a_button_sends_can_be_copied_as_curl(plant: Plant, open_console: Open) -> None:
    console = open_console(plant.url, "#/axis/line1.3F")
    before = plant.line.truth("move")
    _, _, method, url, _, header, _, body = console.copied_as_curl("Step +100 pulse")
    assert plant.line.truth("move") == before
    name, value = header.split(": ")
    answer = httpx.request(method, url, content=body, headers={name: value})
    assert answer.status_code == 202
    assert answer.json()["frame"] == "&3F1+MA[29],100\\r"


def test_copying_as_curl_changes_nothing_on_any_page(plant: Plant, open_console: Open) -> None:
    console = open_console(plant.url)
    console.show_calls()
    sent: list[str] = []
    console.page.on("request", lambda request: sent.append(f"{request.method} {request.url}"))
    for path in PAGES:
        console.go(path)
        expect(console.page.get_by_role("heading", level=1)).to_be_visible()
        copies = console.page.locator("main").get_by_role("button", name="Copy as curl")
        if path != "#/wire/line1":
            expect(copies.first).to_be_visible()
        for copy in copies.all():
            copy.dispatch_event("click")
    console.shows("Copied")
    console.go("#/axis/line1.3F")
    expect(console.button("Take control")).to_be_visible()
    expect(console.page.get_by_text("not done")).to_have_count(0)
    assert [request for request in sent if not request.startswith("GET") and not READS.search(request)] == []


def test_a_robot_jogs_while_the_button_is_held(plant: Plant, open_console: Open) -> None:
    console = open_console(plant.url, "#/robot/r1")
    known = robot_moves(plant)
    console.page.get_by_role("button", name="Home", exact=True).click()
    until(lambda: len(robot_moves(plant)) > len(known), "it begins to home")
    until(lambda: robot_moves(plant)[0]["status"] == "succeeded", "the robot is homed")
    jogged(plant, lambda: press_mouse(console), lambda: console.page.mouse.up())
    jogged(plant, lambda: press_key(console), lambda: console.page.keyboard.up("Enter"))
    expect(console.page.locator(".notices .bad")).to_have_count(0)


def jogged(plant: Plant, hold: Callable[[], None], release: Callable[[], None]) -> None:
    start = robot_x(plant) or 0
    hold()
    until(lambda: (robot_x(plant) or 0) > start, "the axis jogs")
    release()
    until(lambda: not plant.gateway.get("/robots/r1")["moving"], "the axis stands still")


def test_a_robots_tile_tells_where_its_axes_are(plant: Plant, open_console: Open) -> None:
    console = open_console(plant.url)
    tile = console.page.get_by_role("link", name="r1")
    moves = "/robots/r1/units/1/moves"
    home = plant.gateway.http.post(moves, params={"wait": LONGEST_WAIT_S}, json={"kind": "home"})
    assert home.json()["status"] == "succeeded", home.text
    expect(tile).to_contain_text("homed")
    place = (robot_x(plant) or 0) - 5
    there = {"kind": "absolute", "axes": {"X": {"value": place, "unit": "mm"}}}
    plant.gateway.http.post(moves, json=there).raise_for_status()
    expect(tile).to_contain_text(f"X {place:g} mm")


def test_a_unit_is_told_as_homed_while_the_robot_acts_on_another(demo: str, open_console: Open) -> None:
    unit = f"{demo}/robots/r1/units/1"
    httpx.post(
        f"{unit}/moves", params={"wait": LONGEST_WAIT_S}, json={"kind": "home"}, timeout=90
    ).raise_for_status()
    httpx.get(unit.replace("units/1", "units/2/position"), timeout=90).raise_for_status()
    console = open_console(demo)
    tile = console.page.get_by_role("link", name="r1")
    expect(tile.get_by_text("homed", exact=True)).to_have_count(2)
    expect(tile).not_to_contain_text("homing unknown")
    console.go("/events")
    console.page.get_by_label("raw").check()
    console.shows("robot.move.succeeded")
    expect(console.page.locator("tr", has_text="homing").first).not_to_contain_text("null")


def test_where_a_robot_stands_is_read_once_a_page_is_loaded(demo: str, open_console: Open) -> None:
    """Only the unit that a robot acts on is followed: the others tell it once."""
    for unit in (2, 1):
        home = f"{demo}/robots/r1/units/{unit}/moves"
        httpx.post(
            home, params={"wait": LONGEST_WAIT_S}, json={"kind": "home"}, timeout=90
        ).raise_for_status()
    console = open_console(demo)
    axes = console.page.get_by_role("link", name="r1").locator(".number.row")
    for unit in (0, 1):
        expect(axes.nth(unit)).to_contain_text(re.compile(r"X -?[\d.]+ "))
    console.go("#/robot/r1")
    console.shows("Inputs 1:")
    expect(console.page.get_by_role("region", name="Variables")).to_contain_text("read")


def robot_moves(plant: Plant) -> list[dict[str, Any]]:
    return list(plant.gateway.get("/robots/r1/units/1/moves?limit=1000")["moves"])


def robot_x(plant: Plant) -> float | None:
    place = plant.gateway.http.get("/robots/r1/units/1/position")
    value = place.json()["axes"]["X"]["value"] if place.is_success else None
    return None if value is None else float(value)


def press_mouse(console: Console) -> None:
    expect(console.button("Jog X+")).to_have_attribute("aria-disabled", "false")
    console.button("Jog X+").hover()
    console.page.mouse.down()


def press_key(console: Console) -> None:
    expect(console.button("Jog X+")).to_have_attribute("aria-disabled", "false")
    console.button("Jog X+").focus()
    console.page.keyboard.down("Enter")


def test_a_jog_ends_with_the_page(plant: Plant, open_console: Open) -> None:
    console = open_console(plant.url, "#/robot/r1")
    until(lambda: not plant.gateway.get("/robots/r1")["moving"], "the robot stands still")
    console.hold("Jog X+", lambda: bool(plant.gateway.get("/robots/r1")["moving"]))
    console.page.close(run_before_unload=False)
    until(lambda: not plant.gateway.get("/robots/r1")["moving"], "the axis stands still")


def test_a_page_that_is_loaded_in_the_middle_of_a_move_knows_it(plant: Plant, open_console: Open) -> None:
    console = open_console(plant.url, "#/axis/line1.3F")
    plant.gateway.moving("3F", FAR)
    expect(console.page.get_by_role("progressbar")).to_be_visible()
    console.page.reload()
    expect(console.page.get_by_role("progressbar")).to_be_visible()
    console.shows("moves")
    console.page.locator("main").get_by_role("button", name="Stop", exact=True).click()
    expect(console.page.get_by_role("row", name="relative").first).to_contain_text("stopped")


def test_after_the_gateway_is_gone_nothing_pretends_to_be_fresh(tmp_path: Path, open_console: Open) -> None:
    with plant_in(tmp_path) as plant:
        lose_and_find(plant, open_console)


def lose_and_find(plant: Plant, open_console: Open) -> None:
    console = open_console(plant.url, "#/axis/line1.3F")
    plant.gateway.moving("3F", FAR)
    console.shows("moves")
    place, moving = console.page.locator(".big b"), console.page.locator("summary .live")
    expect(place).to_have_text(re.compile(r"\d\s\d"))
    before = number_in(place)
    plant.gateway.kill()
    console.shows("No connection to the gateway. What is shown is from")
    console.shows("as last known")
    assert number_in(place) >= before
    for shown in (console.page.locator(".big"), moving):
        expect(shown).to_have_css("text-decoration-line", "line-through")
    expect(console.page.get_by_role("progressbar")).to_have_count(0)
    console.button("Step +100 pulse").click(force=True)
    console.shows("There is no connection to the gateway.")
    console.page.keyboard.press("Escape")
    console.shows("THE STOP DID NOT GET THROUGH. Use the hardware stop.")
    plant.gateway.start()
    plant.gateway.wait_until_ready()
    expect(console.page.locator(".banner")).to_have_count(0)
    expect(console.page.locator(".connection .good")).to_be_visible()
    console.page.keyboard.press("Escape")
    console.shows("Everything stands still")


def number_in(shown: Locator) -> int:
    return int(re.sub(r"\D", "", shown.inner_text()))


def test_faults_of_a_program_are_marked_and_a_good_one_runs(plant: Plant, open_console: Open) -> None:
    console = open_console(plant.url, "#/program/line1.01")
    editor = console.page.get_by_label("Source")
    editor.fill("*UP\n1+M500\nJMP *DOWN\nEND")
    console.button("Upload").click()
    console.shows("Line 3:")
    expect(console.page.locator(".cm-lint-marker-error")).to_have_count(1)
    editor.fill("*UP\n1+M500\nJON MT, +0\nWAT 300\nEND")
    console.again("Upload")
    console.shows("RAM holds the program: 5 instructions, read back.")
    console.button("Run").click()
    console.shows("Runs, at line 4")
    expect(console.page.locator(".running")).to_have_text("WAT 300")
    console.page.keyboard.press("Escape")
    console.shows("Does not run. Last end: stopped")


def test_the_keys_of_the_editor_move_select_and_delete(plant: Plant, open_console: Open) -> None:
    console = open_console(plant.url, "#/program/line1.01")
    editor = console.page.get_by_label("Source")
    editor.fill("  1+M500\nEND")
    for key in (
        *("Control+Home", "End", "Enter", "W", "A", "T", "Space", "7", "Backspace", "5"),
        *("ArrowDown", "Home", "Shift+End", "Delete", "E", "N", "X", "Backspace", "D"),
        *("Control+Home", "Delete", "Control+End", "Enter", "Z", "Z", "Control+Backspace", "Backspace"),
    ):
        editor.press(key)
    assert editor.inner_text() == " 1+M500\n  WAT 5\nEND"
    editor.press("Control+z")
    editor.press("Control+a")
    editor.press("Backspace")
    assert editor.inner_text().strip() == ""


def test_a_program_that_was_not_read_is_replaced_only_when_asked_and_can_be_put_back(
    plant: Plant, open_console: Open
) -> None:
    theirs = "*KEEP\n1+M700\nWAT 5\nEND"
    put_program(plant, theirs)
    console = open_console(plant.url, "#/program/line1.01")
    console.page.get_by_label("Source").fill("1+M5\nEND")
    question = console.page.get_by_role("dialog", name="Replace the program")
    console.button("Upload").click()
    expect(question).to_contain_text("has a program of 4 instructions that was not read here")
    expect(question).to_contain_text("1+M700")
    question.get_by_role("button", name="Cancel").click()
    expect(question).to_have_count(0)
    assert "1+M700" in program_of(plant)
    console.again("Upload")
    question.get_by_role("button", name="Replace it").click()
    console.shows("RAM holds the program: 2 instructions, read back.")
    assert "1+M700" not in program_of(plant)
    console.page.reload()
    console.button("Put the earlier program back (4 instructions)").click()
    question.get_by_role("button", name="Replace it").click()
    console.shows("RAM holds the program: 4 instructions, read back.")
    assert "1+M700" in program_of(plant)


def put_program(plant: Plant, source: str) -> None:
    plant.gateway.http.put(
        "/bodies/01/program?wait=60", json={"source": source}, timeout=90
    ).raise_for_status()


def program_of(plant: Plant) -> str:
    source: str = plant.gateway.get("/bodies/01/program")["source"]
    return source


def test_a_setting_of_a_robots_axis_is_read_in_words_and_changed(plant: Plant, open_console: Open) -> None:
    console = open_console(plant.url, "#/robot/r1")
    console.page.locator("summary", has_text="Settings").click()
    field = console.page.get_by_label("Acceleration time X", exact=True)
    expect(field).to_have_value("200")
    field.fill("250")
    field.press("Enter")
    console.shows("Acceleration time X: done.")
    told = plant.gateway.get("/robots/r1/units/1/settings")
    assert told["acceleration_time_ms"]["X"] == 250
    expect(field).to_have_value("250")


def test_the_wire_shows_what_a_frame_means_and_who_asked(plant: Plant, open_console: Open) -> None:
    console = open_console(plant.url, "#/wire/line1")
    plant.gateway.command("00", "get-information", comment_number=1)
    console.page.get_by_label("Contains").fill("&009VD1")
    row = console.page.locator("tbody tr").last
    expect(row).to_contain_text("00 · ")
    expect(row).to_contain_text("http 127.0.0.1")


def test_the_wire_of_one_body_and_one_request_is_told_apart(plant: Plant, open_console: Open) -> None:
    console = open_console(plant.url, "#/wire/line1")
    rows = console.page.locator("tbody tr")
    own = console.page.get_by_label("without the gateway's own")
    expect(own).to_be_checked()
    own.uncheck()
    expect(rows.filter(has_text="the gateway: looks after it").first).to_be_visible()
    console.page.get_by_role("combobox", name="Body", exact=True).select_option("line1.01")
    asked = {"X-Request-Id": "job-17"}
    plant.gateway.http.get("/bodies/01/position", headers=asked).raise_for_status()
    own.check()
    console.button("job-17").first.click()
    expect(console.page.get_by_label("Request")).to_have_value("job-17")
    expect(rows.filter(has_text="looks after it")).to_have_count(0)
    expect(rows.first).to_contain_text("← >&01")
    expect(rows.filter(has_text="get the present position: ").first).to_be_visible()
    console.page.get_by_label("raw").check()
    expect(rows.first).to_contain_text("received")
    for told in rows.all_inner_texts():
        assert "01 · " in told
        assert "http 127.0.0.1" in told


def test_a_command_is_sent_by_hand_with_its_effect_and_right_beside_it(
    plant: Plant, open_console: Open
) -> None:
    console = open_console(plant.url, "#/wire/line1")
    form = console.page.locator("details", has_text="Send a command")
    form.locator("summary").click()
    form.get_by_role("combobox", name="To", exact=True).select_option("line1.00")
    form.get_by_role("combobox", name="Command", exact=True).select_option("set-homing-retries")
    expect(form).to_contain_text("Changes a setting · takes the right to set up")
    expect(form).to_contain_text("retries is missing.")
    form.get_by_label("retries", exact=True).fill("5")
    assert console.copied_as_curl("Send")[-1] == '{"retries":5}'
    form.get_by_role("button", name="Send", exact=True).click()
    console.shows("Send: done.")
    told = plant.gateway.command("00", "get-homing-retries")
    assert told["retries"] == 5
    form.get_by_role("combobox", name="Command", exact=True).select_option("get-homing-retries")
    form.get_by_role("button", name="Send", exact=True).click()
    expect(form.get_by_label("Answer")).to_contain_text('"retries": 5')


def test_the_hints_of_a_command_are_in_the_language_of_the_page(plant: Plant, open_console: Open) -> None:
    console = open_console(plant.url, "#/wire/line1", "ja")
    form = console.page.locator("details", has_text="コマンドを送る")
    form.locator("summary").click()
    form.get_by_role("combobox").first.select_option("line1.00")
    form.get_by_role("combobox").nth(1).select_option("set-homing-retries")
    expect(form).to_contain_text("再試行回数。初期値は 0。")


def test_the_wire_stands_still_while_it_is_read_and_goes_on_with_what_came(
    plant: Plant, open_console: Open
) -> None:
    console = open_console(plant.url, "#/wire/line1")
    console.page.get_by_label("Contains").fill("009VD1")
    plant.gateway.command("00", "get-information", comment_number=1)
    rows = console.page.locator("tbody tr")
    expect(rows.first).to_contain_text("&009VD1")
    console.button("Pause").click()
    before = rows.count()
    plant.gateway.command("00", "get-information", comment_number=1)
    console.page.wait_for_timeout(500)  # it stands still, however long that is
    assert rows.count() == before
    console.button("Follow").click()
    expect(rows).not_to_have_count(before)


def test_an_alarm_has_its_remedy_beside_it(plant: Plant, open_console: Open) -> None:
    console = open_console(plant.url, "#/events")
    plant.line.tell("POST", "/bodies/00/brown-outs", for_s=0.05)
    there = {"kind": "absolute", "position": {"value": 5, "unit": "pulse"}}
    until(
        lambda: plant.gateway.http.post("/bodies/00/moves", json=there).json().get("detail"),
        "a move is refused",
    )
    lost = console.page.locator(".alarm", has_text="line1.00 has lost its power")
    lost.get_by_role("button", name="Acknowledge").first.click()
    lost.get_by_role("button", name="Reset the alarm", exact=True).click()
    expect(lost).to_have_count(0)
    console.page.get_by_label("raw").check()
    console.page.get_by_label("Type").fill("body.power_cycle")
    expect(console.page.locator("tbody tr").first).to_contain_text("body.power_cycle.acknowledged")
    console.page.get_by_label("Type").fill("alarm.raised")
    expect(console.page.locator("tbody tr td").nth(3)).to_have_text(
        re.compile("^line1.00 has lost its power")
    )


def test_what_is_over_has_both_its_times_and_all_of_it_is_reset_at_once(
    plant: Plant, open_console: Open
) -> None:
    seen_to(plant)
    console = open_console(plant.url, "#/events")
    for body in ("00", "01"):
        plant.line.tell("POST", f"/bodies/{body}/brown-outs", for_s=0.05)
    until(
        lambda: all(plant.gateway.get(f"/bodies/{body}")["power_cycled"] for body in ("00", "01")),
        "both have lost their power",
    )
    lost = console.page.locator(".alarm", has_text="has lost its power")
    expect(lost).to_have_count(1)  # one fuse, one event
    expect(lost).to_contain_text("stands now")
    expect(console.page.get_by_role("button", name=re.compile("^Reset all"))).to_have_count(0)
    for body in ("00", "01"):
        plant.gateway.http.post(f"/bodies/{body}/power-cycle/acknowledge").raise_for_status()
    over = console.page.locator(".alarm", has_text="had lost its power")
    expect(over).to_contain_text("over, not yet read")
    expect(over).to_contain_text(re.compile(r"\d\d:\d\d:\d\d – \d\d:\d\d:\d\d"))
    console.page.get_by_role("button", name=re.compile("^Reset all")).first.click()
    expect(over).to_have_count(0)


def test_the_page_of_an_axis_tells_one_event_in_one_box(plant: Plant, open_console: Open) -> None:
    seen_to(plant)
    away = {"kind": "relative", "direction": "cw", "distance": {"value": FAR, "unit": "pulse"}}
    plant.gateway.http.post("/bodies/00/moves", json=away).raise_for_status()
    until(lambda: plant.gateway.get("/bodies/00/status")["moving"], "the motor moves")
    plant.line.tell("PUT", "/bodies/00/sensors/ems", on=True)
    console = open_console(plant.url, "#/axis/line1.00")
    box = console.page.locator(".alarm")
    expect(box.locator("li")).to_contain_text("did not end as it should: EMS input")
    expect(box).to_have_count(1)
    expect(box).to_contain_text("The EMS input of line1.00 was on")
    plant.line.tell("PUT", "/bodies/00/sensors/ems", on=None)


def test_the_worst_alarm_takes_the_place_of_the_lamp(plant: Plant, open_console: Open) -> None:
    seen_to(plant)
    console = open_console(plant.url)
    tile = console.page.locator(".tile", has_text="line1.01")
    expect(tile).to_contain_text("stands still")
    plant.line.tell("POST", "/bodies/01/brown-outs", for_s=0.05)
    expect(tile.locator(".lamp")).to_contain_text("lost its power")
    expect(tile.get_by_role("img", name="Its origin is not known")).to_have_text("?")
    seen_to(plant)
    expect(tile.locator(".lamp")).to_contain_text("stands still")


def seen_to(plant: Plant) -> None:
    """Acknowledge and reset all that is told of bodies."""
    for body in ("00", "01", "3F"):
        plant.gateway.http.post(f"/bodies/{body}/power-cycle/acknowledge").raise_for_status()
    for alarm in plant.gateway.get("/alarms?standing=true")["alarms"]:
        plant.gateway.http.post(f"/alarms/{alarm['id']}/reset")


def test_everything_stands_still_goes_with_the_first_motion(plant: Plant, open_console: Open) -> None:
    console = open_console(plant.url)
    console.page.keyboard.press("Escape")
    told = console.page.locator(".told")
    expect(told).to_contain_text(re.compile(r"\d\d:\d\d:\d\d Everything stands still"))
    move = {
        "kind": "relative",
        "direction": "cw",
        "distance": {"value": 4000, "unit": "pulse"},
        "max_speed": {"value": 500, "unit": "pulse/s"},
    }
    plant.gateway.http.post("/bodies/3F/moves", json=move).raise_for_status()
    expect(told).not_to_contain_text("Everything stands still")


def test_a_notice_stands_below_its_button_with_the_remedy_and_covers_nothing(
    plant: Plant, open_console: Open
) -> None:
    plant.gateway.http.put("/bodies/3F/position", json={"value": 0, "unit": "pulse"}).raise_for_status()
    console = open_console(plant.url, "#/axis/line1.3F")
    console.page.route(
        "**/bodies/line1.3F/moves",
        lambda route: (
            route.fulfill(status=409, json=REFUSED) if route.request.method == "POST" else route.continue_()
        ),
    )
    console.page.get_by_label("Target (pulse)").fill("10")
    console.button("Go").click()
    notice = console.page.locator(".notices", has_text="It has lost its power.")
    expect(notice.get_by_role("button", name="Acknowledge the power cycle", exact=True)).to_be_visible()
    box, go = notice.bounding_box(), console.button("Go").bounding_box()
    assert box
    assert go
    assert 0 <= box["y"] - (go["y"] + go["height"]) < 60
    assert notice.evaluate("it => getComputedStyle(it).position") == "static"
    console.page.unroute_all(behavior="wait")
    console.button("Go").click()
    expect(console.page.locator(".notices", has_text="It has lost its power.")).to_have_count(0)
    expect(console.page.locator(".notices", has_text="Go")).to_have_count(0)  # its move is over


def test_a_command_for_a_line_with_a_spare_carries_the_epoch_of_the_owner_that_was_shown(
    plant: Plant, open_console: Open
) -> None:
    def with_owner(route: Route) -> None:
        lines = route.fetch().json()["lines"]
        told = [{**line, "owner": {"gateway": "stocker1", "epoch": 3}} for line in lines]
        route.fulfill(json={"lines": told})

    console = open_console(plant.url, "#/axis/line1.3F")
    with console.page.expect_response("**/lines"):
        console.page.route("**/lines", with_owner)
    with console.page.expect_response("**/lines"):
        pass
    with console.page.expect_request(
        lambda request: request.method == "POST" and request.url.endswith("/moves")
    ) as asked:
        console.page.get_by_label("Target (pulse)").fill("20")
        console.button("Go").click()
    assert asked.value.headers["owner-epoch"] == "3"
    console.page.unroute_all(behavior="wait")


REFUSED: Final = {
    "type": "urn:motion-gateway:problem:power-cycled",
    "title": "Power was lost",
    "status": 409,
    "detail": "It has lost its power.",
    "moved": "no",
    "remedy": "Acknowledge it.",
    "next": [
        {
            "method": "POST",
            "path": "/bodies/line1.3F/power-cycle/acknowledge",
            "right": "operate",
            "en": "Acknowledge the power cycle.",
            "ja": "電源再投入を確認済みにします。",
            "body": None,
        }
    ],
}


def test_what_happened_before_the_page_was_opened_can_be_read(plant: Plant, open_console: Open) -> None:
    console = open_console(plant.url, "#/events")
    console.shows("This is all that the gateway still has.")
    console.page.get_by_label("Type").fill("line.up")
    expect(console.page.locator("tbody tr").first).to_contain_text("line: up")


def test_what_happens_while_the_page_reads_is_shown_once(plant: Plant, open_console: Open) -> None:
    console = open_console(plant.url, "#/wire")

    def answer_after_a_move(route: Route) -> None:
        plant.gateway.http.post("/bodies/01/stop").raise_for_status()
        route.continue_()

    console.page.route("**/events?*limit=1000*", answer_after_a_move)
    console.page.evaluate("location.hash = '#/events'")
    console.shows("This is all that the gateway still has.")
    console.page.get_by_label("raw").check()
    console.page.get_by_label("Type").fill("body.stop.confirmed")
    expect(console.page.locator("tbody tr").first).to_contain_text("body.stop.confirmed")


def test_a_fault_of_one_page_leaves_the_others_and_the_stop(plant: Plant, open_console: Open) -> None:
    console = open_console(plant.url, faulty=True)
    console.page.route("**/system/posture", lambda route: route.fulfill(json={}))
    console.go("#/system")
    console.shows("This part of the page has failed.")
    expect(console.page.get_by_label("Notices")).to_contain_text("A fault of this page")
    plant.gateway.moving("3F", FAR)
    console.page.keyboard.press("Escape")
    console.shows("Everything stands still")
    console.go("#/wire/line1")
    expect(console.page.locator("tbody tr").first).to_contain_text("3F")
    console.page.unroute("**/system/posture")
    console.go("#/system")
    console.shows("Everybody is let in here")


def test_a_page_shows_what_is_told_twice(plant: Plant, open_console: Open) -> None:
    console = open_console(plant.url)

    def tell_twice(route: Route) -> None:
        told = route.fetch().json()
        route.fulfill(
            json={name: value * 2 if isinstance(value, list) else value for name, value in told.items()}
        )

    for path in ("posture", "audit*", "macros", "events*", "inputs", "outputs"):
        console.page.route(f"**/{path}", tell_twice)
    console.go("#/robot/r1")
    expect(console.page.get_by_text("Inputs 1:")).to_have_count(2)
    console.go("#/system")
    expect(console.page.get_by_role("row", name="access.mode")).to_have_count(2)
    console.go("#/events")
    console.button("Look it up").click()
    console.shows("This is all that the gateway still has.")
    console.page.unroute_all(behavior="wait")


def test_a_body_jogs_while_the_button_is_held(plant: Plant, open_console: Open) -> None:
    console = open_console(plant.url, "#/axis/line1.3F")
    jog = console.button("Jog +")
    expect(jog).to_have_attribute("aria-disabled", "false")
    jog.hover()
    console.page.mouse.down()
    until(lambda: moves(plant), "the motor moves")
    console.page.mouse.up()
    until(lambda: not moves(plant), "the motor stands still")
    until(lambda: plant.gateway.get("/bodies/3F/moves")["moves"][0]["status"] == "stopped", "it has ended")


def test_a_jog_is_slow_at_first_and_as_fast_as_was_chosen_for_the_axis(
    plant: Plant, open_console: Open
) -> None:
    plant.gateway.http.put("/bodies/3F/position", json={"value": 0, "unit": "pulse"}).raise_for_status()
    console = open_console(plant.url, "#/axis/line1.3F")
    jog = console.button("Jog +")
    expect(jog).to_contain_text("500 pulse/s")
    expect(jog).to_have_attribute("aria-disabled", "false")
    expect(console.button("Go")).to_contain_text("500 pulse/s")
    jog.hover()
    console.page.mouse.down()
    console.shows("at most to")
    until(lambda: plant.gateway.get("/bodies/3F/position")["pulses"] > 200, "the motor moves")
    console.page.mouse.up()
    until(lambda: not moves(plant), "the motor stands still")
    move = plant.gateway.get("/bodies/3F/moves")["moves"][0]
    assert move["frame"].startswith("&3F1+MA[29],")
    assert plant.gateway.get("/bodies/3F/speed-sets/29")["maximum_speed_pps"] == 500
    console.page.get_by_label("Speed by hand").select_option("2000 pulse/s")
    expect(jog).to_contain_text("2000 pulse/s")
    console.page.reload()
    expect(jog).to_contain_text("2000 pulse/s")
    console.page.get_by_label("Speed by hand").select_option("as set in the controller")
    console.page.reload()
    expect(jog).to_contain_text("2000 pulse/s")


def test_a_position_is_taught_named_and_gone_to(plant: Plant, open_console: Open) -> None:
    plant.gateway.http.put("/bodies/00/position", json={"value": 700, "unit": "pulse"}).raise_for_status()
    console = open_console(plant.url, "#/positions/line1.00")
    console.button("Read").click()
    console.button("Teach 3 here").click()
    expect(console.page.get_by_label("3 pulse", exact=True)).to_have_value("700")
    console.page.get_by_label("4 pulse", exact=True).fill("-50")
    console.page.get_by_label("Name 4", exact=True).fill("unload")
    console.button("Store 4").click()
    console.shows("Store 4: done.")
    expect(console.page.get_by_text("in RAM only")).to_have_count(2)
    console.button("Save all to flash").click()
    expect(console.page.get_by_text("in RAM only")).to_have_count(0)
    console.button("Go to 4").click()
    until(lambda: plant.gateway.get("/bodies/00/position")["pulses"] == -50, "it is at position 4")


def test_a_position_that_was_taught_over_another_can_be_put_back(plant: Plant, open_console: Open) -> None:
    stored = {"positions": [{"number": 3, "position": {"value": 1234, "unit": "pulse"}}]}
    plant.gateway.http.put("/bodies/00/positions", json=stored).raise_for_status()
    plant.gateway.http.put("/bodies/00/position", json={"value": 700, "unit": "pulse"}).raise_for_status()
    console = open_console(plant.url, "#/positions/line1.00")
    console.button("Read").click()
    console.button("Teach 3 here").click()
    expect(console.page.get_by_label("3 pulse", exact=True)).to_have_value("700")
    console.button("Put 3 back to 1234").click()
    expect(console.page.get_by_label("3 pulse", exact=True)).to_have_value("1234")
    expect(console.button("Put 3 back to 1234")).to_have_count(0)
    row = console.page.get_by_role("row").filter(has=console.button("Teach 3 here"))
    go, teach = (
        row.get_by_role("button", name=name, exact=True).bounding_box()
        for name in ("Go to 3", "Teach 3 here")
    )
    assert go
    assert teach
    assert teach["x"] > go["x"] + go["width"] + 200  # no slip of a finger leads from one to the other


def test_positions_come_from_a_file_as_excel_writes_it(plant: Plant, open_console: Open) -> None:
    console = open_console(plant.url, "#/positions/line1.00")
    console.button("Read").click()
    rows = "\ufeffnumber;pulse\r\n5;500\r\n6;-600\r\n".encode()
    console.page.get_by_label("Store from CSV").set_input_files(
        {"name": "table.csv", "mimeType": "text/csv", "buffer": rows}
    )
    console.shows("Store from CSV: done.")
    stored = plant.gateway.get("/bodies/00/positions?first=5&last=6")["positions"]
    assert [position["pulses"] for position in stored] == [500, -600]


def test_a_speed_set_is_changed_and_its_curve_drawn(plant: Plant, open_console: Open) -> None:
    console = open_console(plant.url, "#/motion/line1.01")
    console.shows("s in all")
    console.page.get_by_label("Maximum speed").fill("12000")
    console.button("Save speed set 30").click()
    console.shows("Save speed set 30: done.")
    console.shows("12000 pulse/s at most")
    assert plant.gateway.get("/bodies/01/speed-sets/30")["maximum_speed_pps"] == 12_000


def test_a_setting_is_changed_and_its_difference_to_a_backup_restored(
    plant: Plant, open_console: Open
) -> None:
    console = open_console(plant.url, "#/settings/line1.01")
    console.page.get_by_role("combobox", name="Of", exact=True).select_option("/bodies/line1.01")
    with console.page.expect_download(timeout=SCAN_MS):
        console.button("Read and download").click()
    console.button("Read all").click()
    retries = console.page.get_by_label("Homing retries")
    retries.fill("3")
    retries.press("Enter")
    console.shows("Change Homing retries: done.")
    assert plant.gateway.get("/bodies/01/settings")["settings"]["homing_retries"] == 3
    console.button("Compare").click()
    expect(console.page.get_by_text("1 differ")).to_be_visible(timeout=SCAN_MS)
    console.button("Restore").click()
    expect(console.page.get_by_text("verified, done")).to_be_visible(timeout=SCAN_MS)
    assert plant.gateway.get("/bodies/01/settings")["settings"]["homing_retries"] == 0


def test_a_move_is_drawn_over_its_plan(plant: Plant, open_console: Open) -> None:
    move = plant.gateway.moving("3F", 20_000)
    plant.gateway.ended("3F", move["id"])
    console = open_console(plant.url, "#/axis/line1.3F")
    row = console.page.get_by_role("row", name="relative").first
    row.locator("summary").click()
    row.get_by_role("button", name="Show the curve").click()
    expect(row.get_by_role("img", name="Position during the move, measured and planned")).to_be_visible()


def test_who_may_not_move_is_told_so_and_may_stop(guarded: Guarded, open_console: Open) -> None:
    console = open_console(guarded.url, key=guarded.key("visitor", "viewer"))
    console.shows("visitor")
    console.go("#/axis/line1.3F")
    console.shows("Your role is viewer, and this takes the right “operate”.")
    console.button("Step +100 pulse").click(force=True)
    console.shows("Step +100 pulse: not done.")
    assert guarded.line.executed("1+M") == []
    console.page.keyboard.press("Escape")
    console.shows("Everything stands still")
    assert "Authorization: Bearer $MOTION_GATEWAY_KEY" in console.copied_as_curl("Step +100 pulse")


def test_a_remedy_says_which_right_it_takes(guarded: Guarded, open_console: Open) -> None:
    operator, chief = guarded.key("worker", "operator"), guarded.key("boss", "admin")
    keys = {"viewer": guarded.key("guest", "viewer"), "operator": operator, "admin": chief}
    consoles = {role: open_console(guarded.url, "#/events", key=key) for role, key in keys.items()}
    far = {"kind": "relative", "direction": "cw", "distance": {"value": FAR, "unit": "pulse"}}
    header = {"Authorization": f"Bearer {operator}"}
    with httpx.Client(base_url=f"{guarded.url}/bodies/00", headers=header) as body:
        body.post("/moves", json=far).raise_for_status()
        until(lambda: body.get("/status").json()["moving"], "the motor moves")
    guarded.line.tell("PUT", "/bodies/00/sensors/ems", on=True)
    for role, console in consoles.items():
        alarm = console.page.locator(".alarm", has_text="The EMS input of line1.00 was on")
        clear = alarm.get_by_role("button", name="Clear its error status (9CS)", exact=True)
        reset = alarm.get_by_role("button", name="Reset the alarm", exact=True)
        expect(clear).to_have_attribute("aria-disabled", "true" if role == "viewer" else "false")
        expect(reset).to_have_attribute("aria-disabled", "true" if role == "viewer" else "false")
        if role == "viewer":
            why = "Your role is viewer, and this takes the right “operate”."
            expect(clear).to_have_attribute("title", why)
    guarded.line.tell("PUT", "/bodies/00/sensors/ems", on=None)
    clear.click()
    console.shows("Clear its error status (9CS): done.")


def test_a_key_for_one_body_sees_that_body_live(guarded: Guarded, open_console: Open) -> None:
    console = open_console(guarded.url, key=guarded.key("cell", "operator", "--scope", "line1.01"))
    console.shows("cell")
    expect(console.page.locator("a.tile")).to_have_count(1)
    console.go("#/axis/line1.01")
    console.button("Step +100 pulse").click()
    expect(console.page.locator(".big b")).to_have_text("100")


def test_who_signs_out_cannot_go_on(guarded: Guarded, open_console: Open) -> None:
    key = guarded.key("hanako", "operator")
    console = open_console(guarded.url, "#/axis/line1.3F", key=key)
    other = console.page.context.new_page()
    other.goto(guarded.url)
    Console(other).button("Sign out").click()
    expect(other).to_have_title("Sign in to the motion gateway")
    console.shows("You are signed out")
    console.page.get_by_role("link", name="Sign in").click()
    console.page.get_by_label("Key").fill(key)
    console.button("Sign in").click()
    expect(console.page.get_by_role("heading", level=1)).to_contain_text("line1.3F")


def test_an_administrator_ends_a_session_and_reads_it_in_the_security_log(
    guarded: Guarded, open_console: Open
) -> None:
    worker = open_console(guarded.url, key=guarded.key("shift", "operator"))
    chief = open_console(guarded.url, "#/system", key=guarded.key("head", "admin"))
    sessions = chief.page.get_by_role("region", name="Sessions", exact=True).first
    row = sessions.get_by_role("row").filter(has_text="shift")
    expect(row).to_contain_text("127.0.0.1")
    row.get_by_role("button", name="End the session of shift", exact=False).first.click()
    expect(row).to_have_count(0)
    worker.shows("You are signed out")
    chief.button("Read the log again").click()
    log = chief.page.get_by_role("region", name="Security log", exact=True).first
    ended = log.get_by_role("row").filter(has_text="session.ended").filter(has_text="shift")
    expect(ended.first).to_contain_text("head")
    assert chief.faults() == []
    chief.button("日本語").click()
    for title in ("セッション", "セキュリティログ"):
        expect(chief.page.get_by_role("heading", name=title, exact=True)).to_be_visible()


def test_two_users_have_one_lease(guarded: Guarded, open_console: Open) -> None:
    taro, jiro = (open_console(guarded.url, key=guarded.key(name, "operator")) for name in ("taro", "jiro"))
    for console in (taro, jiro):
        console.go("#/axis/line1.3F")
    taro.button("Take control").click()
    taro.shows("You have control.")
    jiro.shows("taro has control.")
    jiro.shows("taro has leased it: only they may move it.")
    taro.button("Step +100 pulse").click()
    expect(jiro.page.locator(".big b")).to_have_text("100")
    jiro.page.keyboard.press("Escape")
    jiro.shows("Everything stands still")
    taro.button("Give back control").click()
    jiro.button("Take control").click()
    jiro.shows("You have control.")


def test_what_a_reload_would_change_can_be_asked(guarded: Guarded, open_console: Open) -> None:
    console = open_console(guarded.url, key=guarded.key("chief", "admin"))
    console.go("#/system")
    console.button("What would change").click()
    console.shows("Nothing has changed.")


def test_it_can_be_looked_up_who_did_what(plant: Plant, open_console: Open) -> None:
    move = plant.gateway.moving("01", 50)
    plant.gateway.ended("01", move["id"])
    console = open_console(plant.url, "#/events")
    deeds = console.page.get_by_role("region", name="Who did what").first
    deeds.get_by_label("About").fill("line1.01")
    deeds.get_by_role("button", name="Look it up", exact=True).click()
    expect(deeds.locator("tbody tr").first).to_contain_text("&011+M50")


@pytest.mark.long
def test_who_answers_a_scan_can_be_added(tmp_path: Path, open_console: Open) -> None:
    with plant_in(tmp_path, "00,01,02,3F") as plant:
        add_a_body(plant, open_console)


def add_a_body(plant: Plant, open_console: Open) -> None:
    console = open_console(plant.url)
    console.button("Scan").click()
    expect(console.page.get_by_text("4 found")).to_be_visible(timeout=SCAN_MS)
    assert console.faults() == []
    console.page.get_by_label("Name of line1.02").fill("gripper")
    console.button("Add to the configuration").click()
    expect(console.page.get_by_role("link", name="gripper")).to_contain_text("stands still")
    assert plant.gateway.get("/bodies/line1.02")["name"] == "gripper"


@pytest.mark.long
def test_who_answers_at_a_port_can_be_added(tmp_path: Path, open_console: Open) -> None:
    anywhere = ("--listen", "tcp://127.0.0.1:0")
    with (
        plant_in(folder_in(tmp_path, "plant")) as plant,
        simulated_line(folder_in(tmp_path, "line"), "05,06", *anywhere) as line,
        simulated_robot(folder_in(tmp_path, "robot"), *anywhere) as robot,
    ):
        console = open_console(plant.url, "#/system")
        add_from_port(console, line.place, "RC-400")
        add_from_port(console, robot.place, "Fics")
        console.go("#/")
        for name in ("line2.05", "line2.06", "r2"):
            expect(console.page.get_by_role("link", name=name)).to_contain_text("stands still")


def folder_in(folder: Path, name: str) -> Path:
    made = folder / name
    made.mkdir()
    return made


def add_from_port(console: Console, place: str, kind: str) -> None:
    found = console.page.get_by_role("region", name="Find controllers")
    found.get_by_label("Port").fill(place)
    console.button("Ask who is there").click()
    add = console.button("Add to the configuration")
    expect(found.get_by_text(kind).first).to_be_visible(timeout=SCAN_MS)
    assert console.faults() == []
    add.click()
    expect(add).to_have_attribute("title", "It is added.")


def test_a_key_is_made_shown_once_and_revoked(guarded: Guarded, open_console: Open) -> None:
    console = open_console(guarded.url, key=guarded.key("keeper", "admin"))
    console.go("#/system")
    keys = console.page.get_by_role("region", name="Keys").first
    own = keys.get_by_role("row", name="keeper")
    expect(own.get_by_role("button", name="Revoke keeper", exact=True)).to_have_attribute(
        "aria-disabled", "true"
    )
    keys.get_by_label("Name").fill("mes")
    keys.get_by_label("Scope").fill("line1.3F, line1.01")
    keys.get_by_label("Good for (days)").fill("30")
    console.button("Make the key").click()
    console.shows("The key of mes. It is shown this once")
    assert console.faults() == []
    key = keys.locator("[role=status] .mono").inner_text()
    identity = httpx.get(f"{guarded.url}/system/identity", headers={"Authorization": f"Bearer {key}"}).json()
    assert (identity["role"], identity["scope"]) == ("operator", ["line1.01", "line1.3F"])
    console.button("Revoke mes").click()
    expect(keys.get_by_role("row", name="mes")).to_contain_text("revoked")
    answer = httpx.get(f"{guarded.url}/system/identity", headers={"Authorization": f"Bearer {key}"})
    assert answer.status_code == 401


def test_what_somebody_needs_who_helps_is_gathered(plant: Plant, open_console: Open) -> None:
    console = open_console(plant.url, "#/system")
    console.shows("Everybody is let in here")
    with console.page.expect_download(timeout=SCAN_MS) as download:
        console.button("Gather and download").click()
    told = json.loads(Path(download.value.path()).read_text("utf-8"))
    assert {body["body_id"] for body in told["bodies"]["bodies"]} == {"line1.00", "line1.01", "line1.3F"}
    assert told["trace of line1"]["entries"]


def test_a_pattern_with_changes_of_speed_is_drawn_while_it_is_typed(plant: Plant, open_console: Open) -> None:
    console = open_console(plant.url, "#/motion/line1.00")
    console.shows("s in all")
    console.page.get_by_label("Maximum speed").fill("7000")
    console.shows("7000 pulse/s at most")
    expect(console.button("Try it")).to_have_attribute("aria-disabled", "true")
    assert plant.gateway.get("/bodies/00/speed-sets/30")["maximum_speed_pps"] != 7_000
    values = {"start_speed_pps": 1000, "maximum_speed_pps": 9000, "acceleration_pps_s": 100_000}
    values |= {"rising_percent": 50, "falling_percent": 50}
    plant.gateway.http.put("/bodies/00/speed-sets/4", json=values).raise_for_status()
    console.page.get_by_role("combobox", name="Pattern", exact=True).select_option("5")
    console.shows("This pattern was never set")
    console.page.get_by_label("Speed set of the acceleration").select_option("4")
    console.page.get_by_label("Speed set of the deceleration").select_option("4")
    console.shows("9000 pulse/s at most")
    change_on_the_way(console, 0, 2500, 4000)
    console.shows("The last speed change ends at 4000 pps")
    change_on_the_way(console, 1, 5000, 9000)
    expect(console.page.get_by_role("alert").filter(has_text="would be refused")).to_have_count(0)
    assert console.faults() == []
    console.button("Save pattern 5").click()
    console.shows("Save pattern 5: done.")
    stored = plant.gateway.get("/bodies/00/patterns/5")["changes"]
    assert [(capture["begin"], capture["speed_pps"]) for capture in stored] == [(2500, 4000), (5000, 9000)]


def change_on_the_way(console: Console, point: int, place: int, speed: int) -> None:
    console.button("Add a change").click()
    change = console.page.get_by_role("group", name=f"Change {point}")
    change.get_by_label("pulse", exact=True).fill(str(place))
    change.get_by_label("pulse/s", exact=True).fill(str(speed))
