"""How soon the contours follow a drag: pointer move to all panes painted, measured in Chromium on the sample.

Run by hand, on a quiet machine: `python tests/benchmarks/drag_latency.py`. Prints the median and 95th percentile over
some 300 moves at 30 per second, in a pane of the real program with the real 3-D view beside it.
"""

import asyncio
import shutil
import sys
import tempfile
from pathlib import Path

import numpy as np
from playwright.async_api import async_playwright

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tests" / "browser")]

from chromium import FLAGS, chromium_path  # noqa: E402
from driving import handle_of, shows, to_client  # noqa: E402
from running import Program  # noqa: E402

MOVES, INTERVAL_S = 300, 1 / 30


async def measure(folder: Path) -> list[float]:
    program = Program(folder)
    await program.start()
    async with async_playwright() as playwright:
        browser = await playwright.chromium.launch(executable_path=chromium_path(), args=FLAGS)
        page = await browser.new_page(viewport={"width": 1440, "height": 900})
        await page.goto(program.address)
        await shows(page, "window.quadrille?.state.overlay && window.quadrille.state.state.cost_px", 120)
        await asyncio.sleep(6)  # the 3-D view has its first picture
        x, y = await to_client(page, 0, *await handle_of(page, 0, "left_wrist"))
        await page.mouse.move(x, y)
        await page.mouse.down()
        for k in range(MOVES):
            await page.mouse.move(x + 40 * np.sin(k / 12), y - 20 + 30 * np.cos(k / 9))
            await asyncio.sleep(INTERVAL_S)
        await page.mouse.up()
        await asyncio.sleep(1)
        latencies = await page.evaluate("quadrille.latencies")
        await browser.close()
    await program.stop()
    return latencies


def main() -> None:
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary) / "session"
        shutil.copytree(ROOT / "sample_sessions" / "elbow_rotation", folder)
        latencies = asyncio.run(measure(folder))
    median, p95 = np.percentile(latencies, [50, 95])
    print(f"{len(latencies)} drag messages: median {median:.0f} ms, p95 {p95:.0f} ms, largest {max(latencies):.0f} ms")


if __name__ == "__main__":
    main()
