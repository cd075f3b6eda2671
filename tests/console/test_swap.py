"""The page of an axis where another controller answers: what differs, how long it takes, the way back."""

from collections.abc import Callable, Iterator
from datetime import date, timedelta
from pathlib import Path

import pytest
from playwright.sync_api import expect

from tests.console.browser import SCAN_MS, Console, Plant, plant_in
from tests.e2e.processes import BODIES, until

pytestmark = pytest.mark.prove
BODY = "line1.3F"
SERIAL = {"comment_number": 2, "text": "Serial No.00000152"}
COMMENT = f"/bodies/{BODY}/commands/get-information"


@pytest.fixture(scope="module")
def swapped(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Plant]:
    """A plant in which a body has lost what it held in the last night."""
    folder: Path = tmp_path_factory.mktemp("swapped")
    with plant_in(folder, BODIES, '[backups]\nnightly_at = "02:30"\n') as plant:
        http = plant.gateway.http
        for name, wanted in (("set-user-comment", SERIAL), ("set-origin-offset", {"offset": 77})):
            http.post(f"/bodies/{BODY}/commands/{name}", json=wanted).raise_for_status()
        read = http.get("/lines/line1/backup", params={"bodies": "3F"}, timeout=SCAN_MS / 1000)
        own = plant.gateway.data / "backups" / "line1"
        own.mkdir(parents=True)
        (own / f"{date.today() - timedelta(days=1)}.backup").write_text(read.raise_for_status().text, "utf-8")
        plant.line.tell("POST", "/bodies/3F/brown-outs", for_s=1.0)
        until(lambda: standing(plant), "the swap is told")
        yield plant


def standing(plant: Plant) -> bool:
    told = plant.gateway.http.get("/alarms", params={"standing": "true"}).json()["alarms"]
    return any(alarm["cause"] == "body.swapped" for alarm in told)


def comment(plant: Plant) -> str:
    told = plant.gateway.http.post(COMMENT, json={"comment_number": 2}).raise_for_status().json()
    return str(told["text"])


def test_another_controller_is_compared_and_holds_the_backup_of_the_night_in_the_end(
    swapped: Plant, open_console: Callable[..., Console]
) -> None:
    console = open_console(swapped.url, f"#/axis/{BODY}", "ja")
    console.page.set_viewport_size({"width": 390, "height": 844})
    console.shows("別のコントローラです")
    console.button("昨夜のバックアップと比較").click()
    expect(console.page.get_by_text("残り").first).to_be_visible()
    expect(console.page.get_by_text("昨夜のバックアップとの相違点：設定2件")).to_be_visible(timeout=SCAN_MS)
    console.shows("復元には")
    wide = "document.documentElement.scrollWidth <= innerWidth"
    assert console.page.evaluate(wide)
    assert comment(swapped) == ""
    console.button("昨夜のバックアップを復元").click()
    expect(console.page.get_by_text("読み戻して確認済み")).to_be_visible(timeout=SCAN_MS)
    assert comment(swapped) == SERIAL["text"]
    assert console.faults() == []
