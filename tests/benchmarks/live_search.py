"""How many steps of a search at work the page draws per second, and whether updates pile up on the way.

Run by hand, on a quiet machine: `python tests/benchmarks/live_search.py`. Searches of the sample go at 30 expansions a
second, then as fast as they can, with panes, the drawer of searches and the real 3-D view in sight. Counted are the
pictures of the page in which the contours had changed, while a search was at work. What piles up shows in the delay:
from a message's arrival in the page's queue of events (a port that is asked at every picture) to its turn, and from the
wish to end the search to the last change that is drawn.
"""

import argparse
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
from driving import shows  # noqa: E402
from running import Program  # noqa: E402

WATCH = """() => {
  const seen = { drawn: [], waits: [] };
  globalThis.seen = seen;
  let last = quadrille.state.overlay;
  const { port1, port2 } = new MessageChannel();
  port1.onmessage = ({ data }) => seen.waits.push(performance.now() - data);
  const look = () => {
    if (quadrille.state.overlay !== last) seen.drawn.push(performance.now());
    last = quadrille.state.overlay;
    port2.postMessage(performance.now());
    requestAnimationFrame(look);
  };
  requestAnimationFrame(look);
}"""


async def watched(page, seconds: float) -> None:
    """Let the search go on and print what the page drew of it, third by third."""
    before = await page.evaluate("(seen.drawn.length = seen.waits.length = 0, performance.now())")
    expanded = await page.evaluate("quadrille.state.state.job.evaluations")
    await asyncio.sleep(seconds)
    drawn, waits, now, scored = await page.evaluate(
        "[seen.drawn, seen.waits, performance.now(), quadrille.state.state.job.evaluations]"
    )
    edges = np.linspace(before, now, 4)
    rates = np.histogram(drawn, edges)[0] / np.diff(edges) * 1e3
    lags = [np.percentile(part, 95) for part in np.array_split(waits, 3)]
    print(
        f"  {(scored - expanded) / (now - before) * 1e3:.0f} poses a second scored, drawn {len(drawn)} times in "
        f"{(now - before) / 1e3:.1f} s; by thirds {', '.join(f'{r:.1f}' for r in rates)} a second; "
        f"wait of an event p95 {', '.join(f'{x:.0f}' for x in lags)} ms",
        flush=True,
    )


async def measure(folder: Path, seconds: float) -> None:
    program = Program(folder)
    await program.start()
    async with async_playwright() as playwright:
        browser = await playwright.chromium.launch(executable_path=chromium_path(), args=FLAGS)
        page = await browser.new_page(viewport={"width": 1440, "height": 900})
        await page.goto(program.address)
        await shows(page, "window.quadrille?.state.overlay && window.quadrille.state.state.cost_px", 120)
        await page.keyboard.press("b")
        await asyncio.sleep(6)  # the 3-D view has its first picture
        await page.evaluate(WATCH)
        await page.get_by_label("Expansions a second").select_option("30")
        await page.keyboard.press("f")
        await shows(page, "quadrille.state.state.job.running", 20)
        await asyncio.sleep(1)
        print("30 expansions a second:")
        await watched(page, seconds)
        asked = await page.evaluate("performance.now()")
        await page.keyboard.press("Escape")
        await shows(page, "!quadrille.state.state.job.running", 20)
        await asyncio.sleep(1)
        after = max([t - asked for t in await page.evaluate("seen.drawn")] + [0.0])
        print(f"  last change drawn {after:.0f} ms after the wish to end it")
        await browser.close()
    await program.stop()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=12.0)
    words = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary) / "session"
        shutil.copytree(ROOT / "sample_sessions" / "elbow_rotation", folder)
        asyncio.run(measure(folder, words.seconds))


if __name__ == "__main__":
    main()
