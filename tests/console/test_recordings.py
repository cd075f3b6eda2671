"""The page of recordings: taken, looked at on a time line, downloaded, and replayed to the console."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import httpx
import pytest
from playwright.sync_api import expect

from benchmarks.processes import free_port
from recordings.form import opened
from tests.console.browser import Console, Plant
from tests.e2e.processes import LONGEST_WAIT_S, Program, until

pytestmark = pytest.mark.prove

Open = Callable[..., Console]
FAR = 2_000_000


def work(plant: Plant) -> Any:
    """Move a body, and stop it on the way."""
    move = plant.gateway.moving("3F", FAR)
    plant.gateway.http.post("/stop").raise_for_status()
    return plant.gateway.ended("3F", move["id"])


def recordings(plant: Plant) -> Any:
    return plant.gateway.get("/recordings")["recordings"]


@pytest.mark.parametrize(("language", "stop"), [("en", "Stop: "), ("ja", "停止: ")])
def test_a_recording_is_taken_and_its_time_line_leads_to_the_frames(
    plant: Plant, open_console: Open, language: str, stop: str
) -> None:
    move = work(plant)
    console = open_console(plant.url, "#/events", language)
    console.page.locator("main a[href='#/recordings']").click()
    before = len(recordings(plant))
    console.button({"en": "Record", "ja": "記録する"}[language]).click()
    until(lambda: len(recordings(plant)) > before, "another is taken")
    console.page.locator(f"a[href='#/recordings/{recordings(plant)[0]['id']}']").click()
    mark = console.page.locator(".mark.move").last
    mark.click()
    expect(mark).to_have_attribute("aria-pressed", "true")
    frames = console.page.locator(".frames")
    row = frames.locator("tr.own", has_text=move["frame"])
    expect(row).to_contain_text(move["request_id"])
    expect(row).to_be_in_viewport()
    console.page.get_by_role("button", name=stop).last.click()
    expect(frames.locator("tr.own", has_text="3F")).not_to_have_count(0)
    assert console.faults() == []


def test_it_is_downloaded_as_the_gateway_has_it_and_deleted(
    plant: Plant, open_console: Open, tmp_path: Path
) -> None:
    console = open_console(plant.url, "#/recordings")
    console.page.get_by_label("and from now on").select_option("3600")
    console.button("Record").click()
    console.button("Finish").click()
    with console.page.expect_download() as download:
        console.button("Download").first.click()
    download.value.save_as(tmp_path / "a.mgrec")
    with opened(tmp_path / "a.mgrec") as recording:
        assert "line1" in recording.manifest.lines
    rows = len(recordings(plant))
    console.button("Delete").first.click()
    until(lambda: len(recordings(plant)) == rows - 1, "it is deleted")


def test_a_replay_is_paused_sought_and_hastened_and_nobody_takes_it_for_now(
    plant: Plant, open_console: Open, tmp_path: Path
) -> None:
    move = work(plant)
    taken = plant.gateway.http.post(
        f"/recordings?wait={LONGEST_WAIT_S}", json={"last_s": 10}, timeout=90
    ).json()
    path = tmp_path / "a.mgrec"
    path.write_bytes(plant.gateway.http.get(f"/recordings/{taken['id']}/content").content)
    url = f"http://127.0.0.1:{free_port()}"
    port = url.rpartition(":")[2]
    program = Program(tmp_path / "replay.log", "replay", str(path), "--serve", "--port", port)
    program.said("is replayed on")
    until(lambda: httpx.get(f"{url}/replay").is_success, "it is served")
    try:
        console = open_console(url, "#/recordings/a")
        banner = console.page.locator(".banner.replay")
        expect(banner).to_contain_text("nothing here is of now")
        console.page.locator(".mark.move").last.click()
        until(lambda: httpx.get(f"{url}/replay").json()["paused"], "it is paused")
        now = httpx.get(f"{url}/replay").json()["now"]
        assert now[:22] == move["sent_at"][:22]
        expect(console.page.locator("tr.own", has_text=move["frame"])).to_be_visible()
        time_line = console.page.get_by_role("region", name="Time line")
        time_line.get_by_label("Speed").select_option("0.1")
        console.button("Play").click()
        until(lambda: httpx.get(f"{url}/replay").json()["speed"] == 0.1, "it is slower")
        until(lambda: httpx.get(f"{url}/replay").json()["now"] > now, "it goes on")
        console.page.get_by_label("Place in the recording").press("End")
        until(lambda: httpx.get(f"{url}/replay").json()["now"] >= taken["until"][:19], "it is at its end")
        console.go("#/axis/line1.3F")
        expect(banner).to_be_visible()
        expect(console.button("Jog +")).to_have_attribute(
            "title", "This is a recording: nothing can be sent."
        )
        console.page.keyboard.press("Escape")
        console.shows("THE STOP DID NOT GET THROUGH. Use the hardware stop.")
    finally:
        program.end()
