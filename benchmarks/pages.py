"""The cost of the console's pages: how long a request holds the gateway's loop, how soon pages appear.

Every page is opened in a real browser, on a gateway whose event ring is full; then bodies are stopped while
documents are fetched flat out. The yardstick is the same gateway without clients, or its shortest answer.
"""

import asyncio
from asyncio.subprocess import Process
from contextlib import AsyncExitStack
from time import monotonic

from playwright.async_api import Page

from benchmarks.console import browser_in
from benchmarks.figures import Figure, Target
from benchmarks.http_client import Door
from benchmarks.stop_latency import clients, full_gateway, quantile_ms, stops_ms

CONSOLE = (
    *("plant", "axis/line.07", "positions/line.07", "motion/line.07", "program/line.07"),
    *("settings/line.07", "events", "wire/line", "system"),
)
DOCUMENTS = ("docs", "docs/resources", "docs/all")
FETCHED = ("documents", "commands", "metrics")
CHECK_S = 1.0
"""Seconds for which each page stays open."""
ROUNDS = 3
QUIET_SHARE = 0.25
PAINTED = """() => new Promise((done) => {
  const found = (list) => list.getEntriesByName("first-contentful-paint").forEach((it) => done(it.startTime));
  new PerformanceObserver(found).observe({ type: "paint", buffered: true });
})"""


async def run(seconds: float) -> list[Figure]:
    """Open every page; then stop bodies, first alone and then while clients fetch documents."""
    async with AsyncExitStack() as stack:
        browser = await browser_in(stack)
        watched = full_gateway(program="benchmarks.watched_loop")
        line, port, process = await stack.enter_async_context(watched)
        holds = asyncio.create_task(_holds(process))
        page = await browser.new_page(viewport={"width": 1280, "height": 900})
        begun_at = monotonic()
        await asyncio.sleep(CHECK_S)
        opened_at = monotonic()
        shown_ms = await _look_at_all(page, f"http://127.0.0.1:{port}/")
        closed_at = monotonic()
        await page.close()
        quiet = await stops_ms(line, Door(port), QUIET_SHARE * seconds)
        async with clients(port, *FETCHED):
            loud = await stops_ms(line, Door(port), (1 - QUIET_SHARE) * seconds)
        process.terminate()
        held = await holds
    alone_ms, longest_ms = (
        max((ms for at, ms in held if begin <= at < end), default=0.0)
        for begin, end in ((begun_at, opened_at), (opened_at, closed_at))
    )
    shortest, console, documents = zip(*shown_ms, strict=True)
    return [
        Figure(
            "pages: longest hold of the loop", "ms", [longest_ms], [alone_ms], Target("figure", "<=", 10.0)
        ),
        Figure("console: first paint", "ms", console, shortest, Target("figure", "<=", 1000.0)),
        Figure("/docs: all its sections", "ms", documents, shortest, Target("figure", "<=", 2000.0)),
        quantile_ms("stop while documents are fetched: p99.9", 0.999, loud, quiet, 20.0),
    ]


async def _holds(process: Process) -> list[tuple[float, float]]:
    """When the loop was held, and for how many milliseconds, until the process ends."""
    assert process.stdout is not None
    told = [line.split() async for line in process.stdout]
    return [(float(at), float(ms)) for at, ms in told]


async def _look_at_all(page: Page, url: str) -> list[tuple[float, float, float]]:
    """Open every page; in each round the milliseconds until the shortest answer, the console and `/docs`."""
    shown_ms = [
        (
            await _painted_ms(page, f"{url}livez"),
            await _painted_ms(page, url),
            await _unfolded_ms(page, f"{url}docs"),
        )
        for _ in range(ROUNDS)
    ]
    for path in (*DOCUMENTS, *(f"#/{page}" for page in CONSOLE)):
        await page.goto(url + path)
        await asyncio.sleep(CHECK_S)
    return shown_ms


async def _painted_ms(page: Page, url: str) -> float:
    await page.goto(url)
    return float(await page.evaluate(PAINTED))


async def _unfolded_ms(page: Page, url: str) -> float:
    """Until all sections of the documentation stand there."""
    await page.goto(url)
    await page.locator(".opblock-tag").last.wait_for()
    return float(await page.evaluate("performance.now()"))
