"""The cost, to the gateway and to a browser, of showing 120 moving bodies in the console."""

import asyncio
import shutil
from asyncio.subprocess import Process
from contextlib import AsyncExitStack
from pathlib import Path

import httpx
from playwright.async_api import Browser, Page, async_playwright

from benchmarks.figures import Figure, Target
from benchmarks.gateways import SWEEP_GROUPS, gateway_on_line
from benchmarks.live_values import BODIES, SETTLE_S, percent
from benchmarks.processes import set_apart

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
ROUNDS = 3
LOADS_S = 2.0
"""The page has read all that it shows once."""
FAR = {"value": 900_000, "unit": "pulse"}
"""The limit sensors are a little farther; each round goes the other way."""
LINE = "reply_timeout_s = 3.0\n"
"""The simulator shares its processor with the browser."""
Watched = tuple[float, float, float]
"""Percent of a processor, frames a second and MiB."""
FRAMES = """(seconds) => new Promise((done) => {
  let frames = 0;
  const begun = performance.now();
  const count = (now) => {
    if (now - begun >= seconds * 1000) return done((1000 * frames) / (now - begun));
    frames += 1;
    requestAnimationFrame(count);
  };
  requestAnimationFrame(count);
})"""


async def run(seconds: float) -> list[Figure]:
    """Look at an empty page and at the console, in turn."""
    share = seconds / ROUNDS / 2
    rounds = await _rounds(share)
    empty, shown = zip(*rounds, strict=True)
    (idle, bare_frames, bare_mib), (cpu, frames, mib) = (
        zip(*rounds, strict=True) for rounds in (empty, shown)
    )
    return [
        Figure("console of 120 bodies: a processor", "%", cpu, idle, Target("figure", "<=", 10.0)),
        Figure("console of 120 bodies: frames", "a s", frames, bare_frames, Target("ratio", ">=", 0.95)),
        Figure("console of 120 bodies: its memory", "MiB", mib, bare_mib, Target("figure", "<=", 150.0)),
    ]


async def _rounds(seconds: float) -> list[tuple[Watched, Watched]]:
    async with AsyncExitStack() as stack:
        browser = await browser_in(stack)
        apart = stack.enter_context(set_apart())
        ours = gateway_on_line(BODIES, apart, f"{LINE}{SWEEP_GROUPS}")
        process, web = await stack.enter_async_context(ours)
        await asyncio.sleep(SETTLE_S)
        return [
            await _round(browser, process, f"http://127.0.0.1:{web}/", seconds, "ccw" if number % 2 else "cw")
            for number in range(ROUNDS)
        ]


async def _let_all_move(url: str, direction: str) -> None:
    """Let every body move one way, half a minute long, once the last round's moves are over."""
    async with httpx.AsyncClient(base_url=url, timeout=60, trust_env=False) as client:
        for body in BODIES:
            earlier = (await client.get(f"/bodies/{body:02X}/moves")).json()["moves"]
            if earlier:
                await client.get(f"/bodies/{body:02X}/moves/{earlier[0]['id']}", params={"wait": 60})
        for body in BODIES:
            move = {"kind": "relative", "direction": direction, "distance": FAR}
            (await client.post(f"/bodies/{body:02X}/moves", json=move)).raise_for_status()


async def browser_in(stack: AsyncExitStack) -> Browser:
    """Start a browser, which ends with the stack."""
    playwright = await stack.enter_async_context(async_playwright())
    browser = await playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
    stack.push_async_callback(browser.close)
    return browser


async def _round(
    browser: Browser, process: Process, url: str, seconds: float, direction: str
) -> tuple[Watched, Watched]:
    page = await browser.new_page(viewport={"width": 1280, "height": 900})
    empty = await _watched(browser, page, process, seconds)
    await _let_all_move(url, direction)
    await page.goto(url)
    await page.locator("a.tile").nth(len(BODIES) - 1).wait_for()
    await asyncio.sleep(LOADS_S)
    shown = await _watched(browser, page, process, seconds)
    await page.close()
    return empty, shown


async def _watched(browser: Browser, page: Page, process: Process, seconds: float) -> Watched:
    cpu, frames = await asyncio.gather(percent(process, seconds), page.evaluate(FRAMES, seconds))
    return cpu, frames, await _memory_mib(browser)


async def _memory_mib(browser: Browser) -> float:
    """Memory of the pages' largest process; what it shares with others is divided among them."""
    session = await browser.new_browser_cdp_session()
    told = await session.send("SystemInfo.getProcessInfo")
    pages = [process["id"] for process in told["processInfo"] if process["type"] == "renderer"]
    return max(_proportional_kib(page) for page in pages) / 1024


def _proportional_kib(process_id: int) -> int:
    lines = Path(f"/proc/{process_id}/smaps_rollup").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith("Pss:"))
