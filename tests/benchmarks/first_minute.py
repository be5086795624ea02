"""Time the start of the program in Chromium: `python tests/benchmarks/first_minute.py [--runs 3]`.

For a machine without compiled kernels, then for later starts with all of them: seconds from the launch to words, to
four pictures with a body that can be dragged, and to the first cost. Nothing else may run meanwhile.
"""

import argparse
import asyncio
import os
import socket
import subprocess
import sys
import tempfile
import time
from contextlib import suppress
from pathlib import Path

sys.path[:0] = [str(Path(__file__).resolve().parents[1] / "support")]

from chromium import FLAGS, chromium_path
from page_driver import OPENED
from playwright.async_api import Browser, Error, async_playwright
from program import READY, ROOT

MARKS = {
    "words": "performance.getEntriesByName('first-contentful-paint').length",
    "pictures": OPENED,
    "cost": READY,
}
"""What is timed, with the JavaScript that holds from then on."""
TIMEOUT_S = 180.0


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


async def start(browser: Browser, environment: dict[str, str]) -> dict[str, float]:
    """Start the program with its sample once; return the seconds after which each mark was seen."""
    page = await (await browser.new_context(viewport={"width": 1280, "height": 720})).new_page()
    port, seen = free_port(), dict[str, float]()
    words = [sys.executable, "-m", "app", "open", "--sample", "elbow_rotation", "--port", str(port)]
    began = time.perf_counter()
    program = subprocess.Popen(
        [*words, "--no-browser", "--no-token"], cwd=ROOT, env=environment, stdout=subprocess.DEVNULL
    )
    try:
        async with asyncio.timeout(TIMEOUT_S):
            while True:
                with suppress(Error):
                    await page.goto(f"http://127.0.0.1:{port}/", wait_until="commit")
                    break
                await asyncio.sleep(0.05)
            while len(seen) < len(MARKS):
                for name in MARKS.keys() - seen.keys():
                    with suppress(Error):  # the page loads another one meanwhile
                        if await page.evaluate(f"Boolean({MARKS[name]})"):
                            seen[name] = time.perf_counter() - began
                await asyncio.sleep(0.05)
    finally:
        program.terminate()
        program.wait()
        await page.context.close()
    return seen


async def main(runs: int) -> None:
    async with async_playwright() as playwright:
        browser = await playwright.chromium.launch(executable_path=chromium_path(), args=FLAGS)
        with tempfile.TemporaryDirectory() as home:
            clean = {k: v for k, v in os.environ.items() if not k.startswith(("XDG_", "NUMBA_"))}
            environment = clean | {"HOME": home}
            print(f"{'':12}" + "".join(f"{name:>10}" for name in MARKS))
            for run in range(runs + 1):
                seen = await start(browser, environment)
                times = "".join(f"{seen[name]:10.1f}" for name in MARKS)
                print(f"{'later' if run else 'first':12}{times}", flush=True)
                if run == 0:
                    subprocess.run([sys.executable, "-m", "app.bench.compile_kernels"], env=environment, check=True)
        await browser.close()


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=3, help="later starts")
    asyncio.run(main(parser.parse_args().runs))
