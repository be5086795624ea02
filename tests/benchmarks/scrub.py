"""How soon a frame is on the screen, how soon a long session opens, and whether memory stays flat while scrubbing.

Run by hand, on a quiet machine: `python tests/benchmarks/scrub.py`. Footage is made up: a square that wanders over
noise, 640x480, the same for four cameras, as H.264 at the length of group that is said. Seek latency is from the wish
in Chromium to all panes painted, over random frames, and to the nearest frame standing in, marked; beside it stands the
processor time that each step of making the pictures takes, which other programs on the machine hardly change. Memory is
the resident memory of the server (Linux) and the JavaScript heap of the page.
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
import cv2
import numpy as np
from playwright.async_api import async_playwright

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tests" / "support"), str(ROOT)]

from chromium import FLAGS, chromium_path
from page_driver import shows
from program import Program

from app.drawing import pictures
from app.runtime.progress import Reporter
from app.session.proxies import index
from tracker.evidence.images.working_view import WorkingView
from tracker.footage.recording import Recording
from tracker.session.session import load_session, save_session

REDUCTION = 1.7
"""Pixels of the footage, along either side, for one of a pane, with four of them in a window of 1280x720."""
SAMPLE = ROOT / "sample_sessions" / "elbow_rotation"
GO = """async (frame) => {
  const box = document.querySelector("#frame");
  const began = performance.now();
  box.value = String(frame);
  box.dispatchEvent(new Event("change"));
  const mark = document.querySelector(".pane-stand-in");
  let marked = null;
  const loads = new RegExp(`while ${frame} loads`);
  while (quadrille.state.shown.frame !== frame || quadrille.state.state.frame !== frame) {
    await new Promise((resolve) => requestAnimationFrame(resolve));
    if (marked === null && !mark.hidden && loads.test(mark.textContent)) marked = performance.now() - began;
  }
  const there = performance.now() - began;
  return [there, Math.min(marked ?? there, there)];
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


def repeated(source: Path, path: Path, times: int) -> None:
    """Repeat a film in one file, without encoding it again."""
    with av.open(str(path), "w") as out:
        stream, shift = None, 0
        for _ in range(times):
            with av.open(str(source)) as film_:
                if stream is None:
                    stream = out.add_stream_from_template(film_.streams.video[0])
                end = shift
                for packet in film_.demux(video=0):
                    if packet.dts is None:
                        continue
                    packet.pts, packet.dts = packet.pts + shift, packet.dts + shift
                    end = max(end, packet.pts + packet.duration)
                    packet.stream = stream
                    out.mux(packet)
                shift = end


def made_up(folder: Path, n: int, gop: int, times: int = 1) -> Path:
    """A session of n frames with the sample's cameras, as many times over as is said; one film serves all four."""
    shutil.copytree(SAMPLE, folder)
    session = load_session(folder)
    film(folder / "once.mp4", session.cameras[0].camera.size, n, gop)
    repeated(folder / "once.mp4", folder / "film.mp4", times)
    cameras = [replace(c, footage=folder / "film.mp4", background=None, masks=None) for c in session.cameras]
    save_session(replace(session, cameras=tuple(cameras), n_frames=n * times))
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
    await shows(page, "window.quadrille?.state.shown.frame === 0 && quadrille.state.overlay", 120)
    page_s = time.monotonic() - began
    found = await work(page, program)
    await page.close()
    await program.stop()
    return start_s, page_s, found


def seeks(n: int, n_frames: int):
    """Random frames, and how long each took until it, and until what stood in for it, was there, ms."""

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
                await page.keyboard.press("m")  # the pose mirrored
                await asyncio.sleep(0.03)
            else:
                await page.evaluate(GO, int(rng.integers(0, n_frames)))
            if i + 1 in (200, n):
                await asyncio.sleep(2)
                await session.send("HeapProfiler.collectGarbage")
                heap = (await session.send("Runtime.getHeapUsage"))["usedSize"] / 1e6
                figures.append((resident_mb(program._process.pid), heap))
        return figures

    return work


def told(name: str, latencies_ms: list[tuple[float, float]]) -> None:
    there, marked = np.percentile(latencies_ms, [50, 95], axis=0).T
    print(
        f"{name}: {len(latencies_ms)} random frames, median {there[0]:.0f} ms, p95 {there[1]:.0f} ms; "
        f"that or a marked stand-in: median {marked[0]:.0f} ms, p95 {marked[1]:.0f} ms",
        flush=True,
    )


def steps(folder: Path, n: int) -> None:
    """Print what making the pictures of a frame takes on its thread, step by step, of all four views together."""
    session = load_session(folder)
    rng, spent = np.random.default_rng(7), {"decode": 0.0, "undistort": 0.0, "JPEG": 0.0}
    ways = [WorkingView(c.camera, 1 / REDUCTION, cv2.BORDER_CONSTANT) for c in session.cameras]
    with Recording(session.cameras) as recording:
        for k in rng.integers(0, recording.n_frames, n):
            for i, source in enumerate(session.cameras):
                times = [time.process_time()]  # the decoder has threads of its own
                image = recording.read_view(i, int(k))
                times.append(time.process_time())
                undistorted = ways[i].image(image, ways[i].whole)
                times.append(time.process_time())
                pictures.footage(undistorted, source.camera.size)
                times.append(time.process_time())
                for name, span in zip(spent, np.diff(times), strict=True):
                    spent[name] += 1000 * span / n
    print("  processor time a frame: " + ", ".join(f"{name} {ms:.0f} ms" for name, ms in spent.items()), flush=True)


async def measure(words: argparse.Namespace, folder: Path) -> None:
    async with async_playwright() as playwright:
        browser = await playwright.chromium.launch(executable_path=chromium_path(), args=FLAGS)
        for gop in (12, 250):
            path = made_up(folder / f"gop{gop}", 1500, gop)
            told(f"GOP {gop}", (await opened(path, browser, seeks(words.seeks, 1500)))[2])
            steps(path, 20)
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
        long = made_up(folder / "long", 1000, 250, words.frames // 1000)

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
