"""How soon the contours follow a drag: pointer move to all panes painted, measured in Chromium on the sample.

Run by hand, on a quiet machine: `python tests/benchmarks/drag_latency.py`. Prints the median and 95th percentile over
some 300 moves at 30 per second, in a pane of the real program with the real 3-D view beside it; then the same for a
made-up program that moves a stick figure without solving anything. Its figures are the floor of browser and transport.
"""

import asyncio
import contextlib
import socket
import sys
from collections.abc import AsyncGenerator

import numpy as np
from playwright.async_api import Page
from sample_page import ROOT, drag_latencies, opened_page, sample_page

MOVES, INTERVAL_S = 300, 1 / 30


@contextlib.asynccontextmanager
async def floor_page() -> AsyncGenerator[Page, None]:
    """The page of the made-up program."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    program = await asyncio.create_subprocess_exec(
        sys.executable, str(ROOT / "tests" / "support" / "fake_endpoint.py"), str(port), stdout=asyncio.subprocess.PIPE
    )
    assert program.stdout is not None
    await program.stdout.readline()
    async with opened_page(f"http://127.0.0.1:{port}/") as page:
        yield page
    program.terminate()
    await program.wait()


async def main() -> None:
    for name, opened, joint in (("program", sample_page, "left_wrist"), ("floor", floor_page, "l_wrist")):
        async with opened() as page:
            latencies = await drag_latencies(page, joint, MOVES, INTERVAL_S)
        median, p95 = np.percentile(latencies, [50, 95])
        largest = max(latencies)
        print(f"{name}: {len(latencies)} moves, median {median:.0f} ms, p95 {p95:.0f} ms, largest {largest:.0f} ms")


if __name__ == "__main__":
    asyncio.run(main())
