"""The pictures of the documents, taken anew: `python -m tests.console.screenshots`."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final, NamedTuple

import httpx
from playwright.sync_api import Browser, Page, sync_playwright

from tests.console.browser import CHROMIUM, PATIENCE_MS, Console, demo_in
from tests.console.console import ROOT

FOLDER: Final = ROOT / "docs" / "screenshots"
SETTLED_MS: Final = 2_500
"""Curves are drawn, and values read, by then."""
DESK, TABLET, PHONE = (1280, 900), (820, 1000), (390, 844)
LIFT: Final = "line1.3F"
MM: Final = {"unit": "mm"}


class Picture(NamedTuple):
    """A page as a user sees it; `pressed` are the buttons that are pressed before."""

    name: str
    path: str
    size: tuple[int, int] = DESK
    language: str = "en"
    colours: str = "light"
    pressed: tuple[str, ...] = ()


AT_WORK: Final = (
    Picture("plant", "#/plant"),
    Picture("axis", f"#/axis/{LIFT}"),
    Picture("axis-phone-ja", f"#/axis/{LIFT}", PHONE, "ja"),
    Picture("robot", "#/robot/r1", TABLET),
    Picture("scara-ja-dark", "#/scara/wafer", TABLET, "ja", "dark"),
    Picture("positions", f"#/positions/{LIFT}"),
    Picture("motion", f"#/motion/{LIFT}"),
    Picture("program", f"#/program/{LIFT}"),
    Picture("settings-ja", f"#/settings/{LIFT}", language="ja", pressed=("すべて読み出し",)),
    Picture("wire", "#/wire/line1"),
    Picture("system", "#/system"),
    Picture("pendant-phone-ja-dark", f"#/pendant/{LIFT}", PHONE, "ja", "dark"),
)
BROKEN: Final = (
    Picture("events", "#/events"),
    Picture("events-phone-ja", "#/events", PHONE, "ja"),
    Picture("break-phone-ja", "#/system", PHONE, "ja"),
)


def main() -> None:
    """Take all of them, of a demo of its own that has worked a little, and of the same with a fault."""
    with TemporaryDirectory() as folder, demo_in(Path(folder)) as url, chromium() as browser:
        work(url)
        for picture in AT_WORK:
            take(picture, url, browser)
        failed = break_something(url)
        for picture in (*BROKEN, Picture("why", f"#/why/{LIFT}/{failed}")):
            take(picture, url, browser)


@contextmanager
def chromium() -> Iterator[Browser]:
    """The browser, which ends with the block."""
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        yield browser
        browser.close()


def work(url: str) -> None:
    """Home what is there, and let each go somewhere."""
    with httpx.Client(base_url=url, params={"wait": "30"}, timeout=90) as to:
        for body in httpx.get(f"{url}/bodies").raise_for_status().json()["bodies"]:
            to.post(f"/bodies/{body['body_id']}/moves", json={"kind": "home"}).raise_for_status()
        for place in (60, 400):
            there = {"kind": "absolute", "position": {"value": place, **MM}}
            to.post(f"/bodies/{LIFT}/moves", json=there).raise_for_status()
        to.post("/robots/r1/units/1/moves", json={"kind": "home"}).raise_for_status()


def break_something(url: str) -> str:
    """Open the stop circuit in the middle of a move, and give the move's id."""
    far = {"kind": "relative", "direction": "cw", "distance": {"value": 800, **MM}}
    move = httpx.post(f"{url}/bodies/{LIFT}/moves", json=far).raise_for_status().json()
    httpx.post(f"{url}/demo/faults", json={"kind": "ems", "target": LIFT}).raise_for_status()
    return str(
        httpx.get(f"{url}/bodies/{LIFT}/moves/{move['id']}", params={"wait": "30"}, timeout=90).json()["id"]
    )


def take(picture: Picture, url: str, browser: Browser) -> None:
    """Open the page, press what is to be pressed, and write the picture."""
    width, height = picture.size
    page = browser.new_page(
        locale={"en": "en-GB", "ja": "ja-JP"}[picture.language],
        color_scheme="dark" if picture.colours == "dark" else "light",
        viewport={"width": width, "height": height},
        has_touch=picture.size != DESK,
    )
    page.set_default_timeout(PATIENCE_MS)
    page.goto(f"{url}/{picture.path}")
    Console(page)
    page.wait_for_timeout(SETTLED_MS)
    press(page, picture.pressed)
    page.screenshot(path=FOLDER / f"{picture.name}.png")
    page.close()


def press(page: Page, names: tuple[str, ...]) -> None:
    for name in names:
        page.get_by_role("button", name=name, exact=True).first.click()
        page.wait_for_timeout(SETTLED_MS)


if __name__ == "__main__":
    main()
