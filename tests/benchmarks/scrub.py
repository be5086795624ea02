"""How soon a frame is on the screen, how soon a long session opens, and whether memory stays flat while scrubbing.

Run by hand, on a quiet machine: `python tests/benchmarks/scrub.py`. Footage is made up: a square that wanders over
noise, 640x480, the same for four cameras, as H.264 at the length of group that is said. Seek latency is from the wish
in Chromium to all panes painted, over random frames; memory is the resident memory of the server (Linux) and the
JavaScript heap of the page.
"""

import argparse
import asyncio
import os
import shutil
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import av
import numpy as np
from playwright.async_api import async_playwright

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tests" / "browser"), str(ROOT)]

from chromium import FLAGS, chromium_path  # noqa: E402
from driving import shows  # noqa: E402
from running import Program  # noqa: E402

from app.commands import Reporter  # noqa: E402
from app.indexing import index  # noqa: E402
from tracker.session import load_session, save_session  # noqa: E402

SAMPLE = ROOT / "sample_sessions" / "elbow_rotation"
GO = """async (frame) => {
  const box = document.querySelector("#frame");
  const began = performance.now();
  box.value = String(frame);
  box.dispatchEvent(new Event("change"));
  while (quadrille.state.shown.frame !== frame || quadrille.state.state.frame !== frame)
    await new Promise((resolve) => requestAnimationFrame(resolve));
  return performance.now() - began;
}"""


def film(path: Path, size: tuple[int, int], n: int, gop: int) -> None:
    """Write n frames of a bright square that wanders over noise."""
    rng = np.random.default_rng(1)
    ground = rng.integers(40, 90, (size[1], size[0], 3), dtype=np.uint8)
    with av.open(str(path), "w") as container:
        stream = container.add_stream("libx264", rate=25, options={"preset": "ultrafast", "crf": "23"})
        stream.width, stream.height, stream.pix_fmt = *size, "yuv420p"
        stream.codec_context.gop_size = gop
        for k in range(n):
            image = ground.copy()
            u, v = (7 * k) % (size[0] - 9), (3 * k) % (size[1] - 9)
            image[v : v + 9, u : u + 9] = 250
            container.mux(stream.encode(av.VideoFrame.from_ndarray(image, format="rgb24")))
        container.mux(stream.encode())


def made_up(folder: Path, n: int, gop: int, scale: float = 1.0) -> Path:
    """A session of n frames with the sample's cameras, at a share of their size; one film serves all four."""
    shutil.copytree(SAMPLE, folder)
    session = load_session(folder)
    cameras = [replace(c, camera=c.camera.scaled(scale) if scale != 1 else c.camera) for c in session.cameras]
    film(folder / "film.mp4", cameras[0].camera.size, n, gop)
    cameras = [replace(c, footage=folder / "film.mp4", background=None, masks=None) for c in cameras]
    save_session(replace(session, cameras=tuple(cameras), n_frames=n))
    return folder


def resident_mb(pid: int) -> float:
    """Resident memory of a process."""
    pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


async def opened(folder: Path, browser, work):
    """Start the program, open its page, do the work; returns seconds to the address and what the work found."""
    program = Program(folder)
    began = time.monotonic()
    await program.start()
    start_s = time.monotonic() - began
    page = await browser.new_page(viewport={"width": 1280, "height": 720})
    await page.goto(program.address)
    await shows(
        page, "window.quadrille?.state.shown?.pictures !== undefined || quadrille.state.shown?.frame === 0", 120
    )
    page_s = time.monotonic() - began
    found = await work(page, program)
    await page.close()
    await program.stop()
    return start_s, page_s, found


def seeks(n: int, n_frames: int):
    """Random frames, and how long each took, ms."""

    async def work(page, _program):
        rng = np.random.default_rng(7)
        await asyncio.sleep(3)
        return [await page.evaluate(GO, int(k)) for k in rng.integers(0, n_frames, n)]

    return work


def scrubbing(n: int, n_frames: int, poses: bool):
    """Memory of server and page after the first 200 changes, and at the end."""

    async def work(page, program):
        rng = np.random.default_rng(7)
        session = await page.context.new_cdp_session(page)
        figures = []
        for i in range(n):
            if poses:
                await page.keyboard.press("k" if i % 2 else "Control+z")
            else:
                await page.evaluate(GO, int(rng.integers(0, n_frames)))
            if i + 1 in (200, n):
                await asyncio.sleep(2)
                await session.send("HeapProfiler.collectGarbage")
                heap = (await session.send("Runtime.getHeapUsage"))["usedSize"] / 1e6
                figures.append((resident_mb(program._process.pid), heap))
        return figures

    return work


def told(name: str, latencies_ms: list[float]) -> None:
    median, p95 = np.percentile(latencies_ms, [50, 95])
    print(f"{name}: {len(latencies_ms)} random frames, median {median:.0f} ms, p95 {p95:.0f} ms", flush=True)


async def measure(words: argparse.Namespace, folder: Path) -> None:
    async with async_playwright() as playwright:
        browser = await playwright.chromium.launch(executable_path=chromium_path(), args=FLAGS)
        for gop in (12, 250):
            path = made_up(folder / f"gop{gop}", 1500, gop)
            told(f"GOP {gop}", (await opened(path, browser, seeks(words.seeks, 1500)))[2])
        made = index(load_session(path), Reporter(silent=True))
        told(
            f"proxy ({made['bytes'] / 6000 / 1e3:.0f} KB a frame)",
            (await opened(path, browser, seeks(words.seeks, 1500)))[2],
        )
        for what, poses in (("frame", False), ("pose", True)):
            figures = (await opened(path, browser, scrubbing(words.changes, 1500, poses)))[2]
            (server, heap), (server_end, heap_end) = figures
            print(
                f"{words.changes} {what} changes: server {server:.0f} -> {server_end:.0f} MB "
                f"({100 * (server_end / server - 1):+.1f}%), page {heap:.1f} -> {heap_end:.1f} MB "
                f"({100 * (heap_end / heap - 1):+.1f}%)",
                flush=True,
            )
        long = made_up(folder / "long", words.frames, 250)

        async def nothing(_page, _program):
            return None

        for when in ("first", "second"):
            start_s, page_s, _ = await opened(long, browser, nothing)
            print(
                f"{words.frames} frames, {when} opening: {start_s:.2f} s to the address, {page_s:.2f} s to the picture"
            )
        await browser.close()


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeks", type=int, default=100)
    parser.add_argument("--changes", type=int, default=2000)
    parser.add_argument("--frames", type=int, default=100_000)
    words = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        asyncio.run(measure(words, Path(name)))


if __name__ == "__main__":
    main()
