"""How many steps of a search at work the page draws per second, and whether updates pile up on the way.

Run by hand, on a quiet machine: `python tests/benchmarks/live_search.py`. Searches of the sample go at 30 expansions a
second, then as fast as they can, with panes, the drawer of searches and the real 3-D view in sight. Counted are the
pictures of the page in which the contours had changed, while a search was at work. What piles up shows as a growing
wait of an event for its turn (a port that is asked at every picture), in the first half and in the second.
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
  const seen = { spans: [], waits: [], ended: [] };
  globalThis.seen = seen;
  let last = quadrille.state.overlay;
  let span = null;
  const { port1, port2 } = new MessageChannel();
  port1.onmessage = ({ data }) => { if (span) seen.waits.push(performance.now() - data); };
  const look = () => {
    const now = performance.now();
    const isRunning = quadrille.state.state.job.running;
    if (isRunning && !span) seen.spans.push((span = { from: now, to: now, drawn: 0 }));
    if (!isRunning) span = null;
    if (span) span.to = now;
    if (span && quadrille.state.overlay !== last) span.drawn += 1;
    if (!span && quadrille.state.overlay !== last) seen.ended.push(now);
    last = quadrille.state.overlay;
    port2.postMessage(now);
    requestAnimationFrame(look);
  };
  requestAnimationFrame(look);
}"""


async def watched(page, speed: str, seconds: float) -> None:
    """Search one frame after another at a speed, and print what the page drew of it, in its two halves."""
    await page.get_by_label("Expansions a second").select_option(speed)
    await page.evaluate(WATCH)
    left, frame = seconds, 4
    while left > 0:
        frame = (frame + 7) % 50
        await page.locator("#frame").fill(str(frame))
        await page.keyboard.press("Enter")
        await shows(page, f"quadrille.state.shown?.frame === {frame} && quadrille.state.state.cost_px", 60)
        await page.keyboard.press("m")  # mirrored, the body is far from its edges: there is something to search
        await page.keyboard.press("f")
        await shows(page, "quadrille.state.state.job.running", 20)
        await shows(page, "!quadrille.state.state.job.running", 120)
        left = seconds - sum(await page.evaluate("seen.spans.map((s) => s.to - s.from)")) / 1e3
    await asyncio.sleep(1)
    spans, waits, ended = await page.evaluate("[seen.spans, seen.waits, seen.ended]")
    halves = [spans[: len(spans) // 2 + 1], spans[len(spans) // 2 :]]
    rates = [1e3 * sum(s["drawn"] for s in half) / sum(s["to"] - s["from"] for s in half) for half in halves]
    late = [min((t - s["to"] for t in reversed(ended) if t > s["to"]), default=0.0) for s in spans]
    lags = [np.percentile(part, 95) for part in np.array_split(waits, 2)]
    print(
        f"{'as fast as it can' if speed == '0' else f'{speed} expansions a second'}: {len(spans)} searches of "
        f"{sum(s['to'] - s['from'] for s in spans) / 1e3:.1f} s; drawn {rates[0]:.1f} and {rates[1]:.1f} times a "
        f"second; wait of an event p95 {lags[0]:.0f} and {lags[1]:.0f} ms; "
        f"{np.median(late):.0f} ms from a search's end to the next change drawn",
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
        for speed in ("30", "0"):
            await watched(page, speed, seconds)
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
