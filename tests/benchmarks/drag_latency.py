"""How soon the contours follow a drag: pointer move to all panes painted, measured in Chromium on the sample.

Run by hand, on a quiet machine: `python tests/benchmarks/drag_latency.py`. Prints the median and 95th percentile over
some 300 moves at 30 per second, in a pane of the real program with the real 3-D view beside it.
"""

import asyncio

import numpy as np
from sample_page import sample_page

from page_driver import handle_of, to_client  # isort: skip  (found by sample_page)

MOVES, INTERVAL_S = 300, 1 / 30


async def measure() -> list[float]:
    async with sample_page() as page:
        x, y = await to_client(page, 0, *await handle_of(page, 0, "left_wrist"))
        await page.mouse.move(x, y)
        await page.mouse.down()
        for k in range(MOVES):
            await page.mouse.move(x + 40 * np.sin(k / 12), y - 20 + 30 * np.cos(k / 9))
            await asyncio.sleep(INTERVAL_S)
        await page.mouse.up()
        await asyncio.sleep(1)
        return await page.evaluate("quadrille.latencies")


def main() -> None:
    latencies = asyncio.run(measure())
    median, p95 = np.percentile(latencies, [50, 95])
    print(f"{len(latencies)} drag messages: median {median:.0f} ms, p95 {p95:.0f} ms, largest {max(latencies):.0f} ms")


if __name__ == "__main__":
    main()
