"""How many steps of a search at work the page draws per second, and whether updates pile up on the way.

Run by hand, on a quiet machine: `python tests/benchmarks/live_search.py`. Searches of the sample go at 30 expansions a
second, then as fast as they can, with panes, the drawer of searches and the real 3-D view in sight. Counted are the
pictures of the page in which the contours had changed, while a search was at work. What piles up shows as a growing
wait of an event for its turn (a port that is asked at every picture), in the first half and in the second.
"""

import argparse
import asyncio

import numpy as np
from sample_page import sample_page

from page_driver import shows  # isort: skip  (found by sample_page)

WATCH = """() => {
  const seen = { spans: [], waits: [] };
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
    last = quadrille.state.overlay;
    port2.postMessage(now);
    requestAnimationFrame(look);
  };
  requestAnimationFrame(look);
}"""


async def watched(page, speed: str, seconds: float) -> None:
    """Search one frame after another at a speed, and print what the page drew of it, in its two halves."""
    await page.get_by_label("Expansions per second").select_option(speed)
    await page.evaluate(WATCH)
    left, frame = seconds, 4
    while left > 0:
        frame = (frame + 7) % 50
        await page.locator("#frame").fill(str(frame))
        await page.keyboard.press("Enter")
        await shows(page, f"quadrille.state.shown?.frame === {frame} && quadrille.state.state.cost_px", 60)
        await page.keyboard.press("m")  # mirrored, the body is far from its edges: there is something to search
        known = await page.evaluate("seen.spans.length")
        await page.keyboard.press("f")
        # Asking whether it runs may come too late: at full speed a search takes a quarter of a second.
        await shows(page, f"seen.spans.length > {known} && !quadrille.state.state.job.running", 120)
        left = seconds - sum(await page.evaluate("seen.spans.map((s) => s.to - s.from)")) / 1e3
    spans, waits = await page.evaluate("[seen.spans, seen.waits]")
    spent_s = sum(s["to"] - s["from"] for s in spans) / 1e3
    lags = [np.percentile(part, 95) for part in np.array_split(waits, 2)]
    print(
        f"{'as fast as it can' if speed == '0' else f'{speed} expansions a second'}: {len(spans)} searches of "
        f"{spent_s:.1f} s; drawn {sum(s['drawn'] for s in spans) / spent_s:.1f} times a second; wait of an event p95 "
        f"{lags[0]:.0f} ms in the first half, {lags[1]:.0f} ms in the second",
        flush=True,
    )


async def measure(seconds: float) -> None:
    async with sample_page() as page:
        await page.keyboard.press("b")
        for speed in ("30", "0"):
            await watched(page, speed, seconds)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=12.0)
    words = parser.parse_args()
    asyncio.run(measure(words.seconds))


if __name__ == "__main__":
    main()
