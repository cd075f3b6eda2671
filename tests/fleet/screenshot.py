"""The picture of a plant of thirty gateways, taken anew: `GATEWAYS=29 python -m tests.fleet.screenshot`."""

import asyncio
from contextlib import AsyncExitStack
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

import uvloop
from playwright.async_api import async_playwright

from benchmarks.plant import all_are_online, engine_in, gateways_in, plant_in
from tests.console.browser import CHROMIUM, PATIENCE_MS

PICTURE: Final = Path(__file__).parents[2] / "docs" / "screenshots" / "plant-of-gateways.png"
LOST_S: Final = 16.0
"""Seconds after which a gateway is called unheard."""


async def main() -> None:
    """Take it of a plant in which one gateway has just been lost."""
    async with AsyncExitStack() as stack:
        folder = Path(stack.enter_context(TemporaryDirectory()))
        engine = await stack.enter_async_context(engine_in(folder))
        plant = await plant_in(stack, folder, engine)
        lost = await stack.enter_async_context(AsyncExitStack())
        _, urls = await gateways_in(stack, folder, engine)
        await gateways_in(lost, folder, engine, numbers=[len(urls) + 1])
        await all_are_online(plant, len(urls) + 1)
        async with async_playwright() as playwright:
            browser = await playwright.chromium.launch(
                executable_path=CHROMIUM, args=["--no-sandbox"], timeout=PATIENCE_MS
            )
            page = await browser.new_page(viewport={"width": 1280, "height": 1000}, locale="en-GB")
            await page.goto(plant)
            await page.wait_for_selector("#bodies tr")
            await lost.aclose()
            await asyncio.sleep(LOST_S)
            await page.fill("#search", f"stocker{len(urls) + 1} line1.0")
            await asyncio.sleep(2.0)
            await page.evaluate("scrollTo(0, 0)")
            await page.screenshot(path=PICTURE)
            await browser.close()


if __name__ == "__main__":
    uvloop.run(main())
