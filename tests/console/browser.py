"""The console in a browser, and the plant behind it."""

import shlex
import shutil
import subprocess
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import httpx
from playwright.sync_api import Locator, Page, expect

from benchmarks.processes import free_port
from tests.console.console import CONSOLE
from tests.e2e.processes import (
    BODIES,
    MOTION_GATEWAY,
    PATIENT_S,
    Gateway,
    Program,
    SimulatedLine,
    SimulatedRobot,
    group_of,
    simulated_line,
    until,
    write_config,
)
from tests.open_access import OPEN

CHROMIUM: Final = shutil.which("chromium") or shutil.which("chromium-browser")
PATIENCE_MS: Final = 60_000
"""Milliseconds after which, on a busy machine too, a thing that has not happened never will."""
SCAN_MS: Final = 240_000
"""The silence of each of 120 body numbers is waited for; backups and restores ask as much."""
AFTER_A_DOUBLE_CLICK_MS: Final = 600
TRIES: Final = 5
PATIENTLY: Final = r"""
    const real = fetch;
    window.fetch = async (asked, ...more) => {
        const moves = asked instanceof Request && asked.method === "POST"
            && /\/(bodies|groups|units)\/[^/]+\/moves$/.test(asked.url);
        const body = moves && JSON.stringify({ start_within_s: 60, ...(await asked.clone().json()) });
        return real(moves ? new Request(asked, { body }) : asked, ...more);
    };"""
"""Script by which moves wait longer for their turn than an operator would: the machine may be busy."""
AXE: Final = CONSOLE / "node_modules" / "axe-core" / "axe.min.js"

expect.set_options(timeout=PATIENCE_MS)


@dataclass
class Plant:
    """A gateway with a line of three bodies, two of them a group, and a robot."""

    line: SimulatedLine
    robot: SimulatedRobot
    gateway: Gateway

    @property
    def url(self) -> str:
        return self.gateway.url


@contextmanager
def plant_in(folder: Path, bodies: str = BODIES, more: str = "") -> Iterator[Plant]:
    """Run a plant, and end it with the block; on its line answer `bodies`."""
    with simulated_line(folder, bodies) as line:
        robot = SimulatedRobot(folder)
        config = write_config(line, "gateway", groups=group_of("00", "01"), reply_timeout_s=PATIENT_S)
        cell = f'[[lines]]\nid = "cell"\nprotocol = "fics"\naddress = "serial://{robot.place}?baud=115200"\n'
        cell += 'robot = { id = "r1", units = [{ number = 1, axes = ["X", "Y", "Z"] }] }\n'
        text = config.read_text().replace("port = 0", f"port = {free_port()}")
        config.write_text(text.replace("\n[access]", f"\n{cell}{more}\n[access]"))
        gateway = Gateway(config).wait_until_ready()
        try:
            yield Plant(line, robot, gateway)
        finally:
            gateway.end()
            robot.program.end()


@contextmanager
def demo_in(folder: Path) -> Iterator[str]:
    """Run the demo, and end it with the block; give where it is."""
    url = f"http://127.0.0.1:{free_port()}"
    program = Program(
        folder / "demo.log", "serve", "--demo", "--port", url.rpartition(":")[2], "--data", str(folder)
    )
    try:
        program.said("running on http")
        until(lambda: httpx.get(f"{url}/readyz").is_success, "the demo is ready")
        yield url
    finally:
        program.end()


@dataclass
class Guarded:
    """A gateway that needs keys."""

    line: SimulatedLine
    url: str
    data: Path

    def key(self, name: str, *words: str) -> str:
        """Make a key; the first word is its role."""
        made = subprocess.run(  # noqa: S603
            [MOTION_GATEWAY, "keys", "create", name, "--role", *words, "--data", self.data],
            capture_output=True,
            text=True,
            check=True,
        )
        return made.stdout.strip()


@contextmanager
def guarded_in(folder: Path) -> Iterator[Guarded]:
    """Run a gateway that needs keys, and end it with the block."""
    with simulated_line(folder) as line:
        config = write_config(line, "guarded", reply_timeout_s=PATIENT_S)
        config.write_text(config.read_text().replace(OPEN, ""))
        data = folder / "data"  # not beside the line's link: the gateway takes no links there
        data.mkdir(mode=0o700)
        program = Program(folder / "gateway.log", "serve", "--config", str(config), "--data", str(data))
        url = program.said(r"running on (http://[0-9.]+:\d+)")[1]
        until(lambda: httpx.get(f"{url}/readyz").is_success, "the gateway is ready")
        try:
            yield Guarded(line, url, data)
        finally:
            program.end()


class Console:
    """A console in a browser."""

    def __init__(self, page: Page) -> None:
        self.page = page
        expect(page.locator(".connection .good")).to_be_visible()

    def button(self, name: str) -> Locator:
        """The button of a name, which is all of it."""
        return self.page.get_by_role("button", name=name, exact=True)

    def again(self, name: str) -> None:
        """Click a button once more, later than for a double click."""
        self.page.wait_for_timeout(AFTER_A_DOUBLE_CLICK_MS)
        self.button(name).click()

    def go(self, path: str) -> None:
        """Follow a link within the console."""
        self.page.evaluate("(path) => { location.hash = path }", path)

    def shows(self, text: str) -> None:
        """Wait until the page says something."""
        expect(self.page.get_by_text(text).filter(visible=True).first).to_be_visible()

    def show_calls(self) -> None:
        """Let each button have its request beside it."""
        switch = self.button("Show calls")
        if switch.get_attribute("aria-pressed") == "false":
            switch.click()

    def copied_as_curl(self, action: str) -> list[str]:
        """Copy an action as curl, and give the words of the command in the clipboard.

        The browser copies some time after the click, and the clipboard keeps what was copied before.
        """
        self.show_calls()
        notice = self.page.locator(".notices", has_text="Copied")
        expect(notice).to_have_count(0)
        self.button(f"Copy as curl: {action}").click()
        expect(notice).to_have_count(1)
        return shlex.split(self.page.evaluate("navigator.clipboard.readText()"))

    def hold(self, key: str, moves: Callable[[], bool]) -> None:
        """Hold a key; a line that a busy machine does not let have its turn in two seconds refuses a jog."""
        bad = self.page.locator(".notices .bad")
        for _ in range(TRIES):
            expect(self.button(key)).to_have_attribute("aria-disabled", "false")
            self.button(key).hover()
            self.page.mouse.down()
            if until(lambda: moves() or bad.count(), "it moves, or says why not") is True:
                return
            expect(bad).to_contain_text("in time; nothing was sent")
            self.page.mouse.up()
            self.button("Close").click()
        raise AssertionError("it never moved")

    def faults(self) -> list[str]:
        """Give what axe finds serious."""
        self.page.evaluate(AXE.read_text("utf-8"))
        found: dict[str, Any] = self.page.evaluate("axe.run()")
        return [
            f"{violation['id']}: {violation['nodes'][0]['target']} {violation['nodes'][0]['failureSummary']}"
            for violation in found["violations"]
            if violation["impact"] in ("serious", "critical")
        ]
