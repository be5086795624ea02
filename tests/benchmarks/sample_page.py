"""The program on a copy of the sample, and its page in Chromium, for benchmarks of the page."""

import asyncio
import contextlib
import shutil
import sys
import tempfile
from collections.abc import AsyncGenerator
from pathlib import Path

import numpy as np
from playwright.async_api import Page, async_playwright

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tests" / "support")]

from chromium import FLAGS, chromium_path
from page_driver import handle_of, shows, to_client
from program import Program


@contextlib.asynccontextmanager
async def sample_page() -> AsyncGenerator[Page, None]:
    """The page, at rest with the real 3-D view beside its panes."""
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary) / "session"
        shutil.copytree(ROOT / "sample_sessions" / "elbow_rotation", folder)
        program = Program(folder)
        await program.start()
        async with opened_page(program.address) as page:
            yield page
        await program.stop()


@contextlib.asynccontextmanager
async def opened_page(address: str) -> AsyncGenerator[Page, None]:
    """The page at an address, at rest."""
    async with async_playwright() as playwright:
        browser = await playwright.chromium.launch(executable_path=chromium_path(), args=FLAGS)
        page = await browser.new_page(viewport={"width": 1440, "height": 900})
        await page.goto(address)
        await shows(page, "window.quadrille?.state.overlay && window.quadrille.state.state.cost_px", 120)
        await asyncio.sleep(9)  # the 3-D view has faded in
        yield page
        await browser.close()


async def drag_latencies(page: Page, joint: str, moves: int, interval_s: float) -> list[float]:
    """Latencies of the moves of a drag of a joint, ms."""
    await page.evaluate("quadrille.latencies.length = 0")
    x, y = await to_client(page, 0, *await handle_of(page, 0, joint))
    await page.mouse.move(x, y)
    await page.mouse.down()
    for k in range(moves):
        await page.mouse.move(x + 30 * np.sin(k / 12), y - 20 + 20 * np.cos(k / 9))
        await asyncio.sleep(interval_s)
    await page.mouse.up()
    await asyncio.sleep(1)
    latencies: list[float] = await page.evaluate("quadrille.latencies")
    return latencies
