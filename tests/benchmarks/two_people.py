"""How much a second person who plays slows the drags of the first, as a ratio within one run.

Run by hand, on a quiet machine: `python tests/benchmarks/two_people.py`. Two people have joined the sample session with
a page each. One drags a wrist while the other rests and while they play, in turns: with plain sockets, which leaves the
share of the program; in two Chromium without the 3-D view, which draw on the same cores; in two Chromium of which the
other has a core to itself, as on a machine of its own; and in two Chromium of which the other plays in a program of its
own, which shows what the machine alone costs. A word measures one of them. Browsers print the processor time of
each side, too.
"""

import asyncio
import json
import os
import shutil
import struct
import sys
import tempfile
import time
from contextlib import AsyncExitStack, suppress
from pathlib import Path

import aiohttp
import numpy as np
from playwright.async_api import Browser, Page, async_playwright
from sample_page import ROOT, drag_latencies

from chromium import FLAGS, chromium_path  # isort: skip  (found by sample_page)
from page_driver import command, shows  # isort: skip
from program import READY, WITHOUT_3D, Program  # isort: skip

ROUNDS, MOVES, INTERVAL_S = 4, 150, 1 / 30
FPS = 25
CORES = sorted(os.sched_getaffinity(0))
SIZE = {"width": 1280, "height": 720}


async def opened(browser: Browser, address: str, name: str) -> Page:
    """A page of a person, in a context of its own."""
    context = await browser.new_context(viewport=SIZE)
    await context.add_init_script(f"{WITHOUT_3D}; sessionStorage.setItem('quadrille-name', '{name}')")
    page = await context.new_page()
    await page.goto(address)
    await shows(page, READY, 120)
    return page


async def apart(address: str) -> tuple[list[float], list[float]]:
    """As `in_browsers`; the last core is the other browser's alone. The program was started on the other ones."""
    with tempfile.TemporaryDirectory() as folder:
        wrapper = Path(folder) / "chromium"
        wrapper.write_text(f'#!/bin/sh\nexec taskset -c {CORES[-1]} "{chromium_path()}" "$@"\n')
        wrapper.chmod(0o755)
        return await in_browsers(address, str(wrapper))


async def in_browsers(
    address: str, of_other: str | None = None, elsewhere: Program | None = None
) -> tuple[list[float], list[float]]:
    """Latencies while the other page rests, and while it plays, ms.

    The other's browser may be another program, and so may be what they play.
    """
    alone, beside = [], []
    async with async_playwright() as playwright, AsyncExitStack() as stack:
        # A process for each, as two people have.
        paths = (chromium_path(), of_other or chromium_path())
        browsers, roots = [], {}
        for name, path in zip(("drags", "plays"), paths, strict=True):
            before = _processes("chrom")
            browsers.append(await playwright.chromium.launch(executable_path=path, args=FLAGS))
            stack.push_async_callback(browsers[-1].close)
            now = _processes("chrom")
            roots[f"browser that {name}"] = min(p for p in now.keys() - before.keys() if now[p][0] not in now)
        there = (address, "ben") if elsewhere is None else (elsewhere.address, "")
        anna, ben = await opened(browsers[0], address, ""), await opened(browsers[1], *there)
        await command(ben, "Loop playback, within the marked range if there is one (toggle)")
        for _ in range(ROUNDS):
            spent = ProcessorTime(**roots)
            alone += await drag_latencies(anna, "left_wrist", MOVES, INTERVAL_S)
            print(f"alone, cores: {spent}")
            await ben.keyboard.press("Space")
            await asyncio.sleep(1)
            spent = ProcessorTime(**roots)
            beside += await drag_latencies(anna, "left_wrist", MOVES, INTERVAL_S)
            print(f"while the other plays, cores: {spent}")
            await ben.keyboard.press("Space")
            await asyncio.sleep(1)
    return alone, beside


class Elsewhere:
    """As `in_browsers`; the other plays the same footage in a program of their own, which shares the machine only."""

    def __init__(self, folder: Path) -> None:
        """Use a session of its own."""
        self._program = Program(folder, "--annotator", "ben")

    async def __call__(self, address: str) -> tuple[list[float], list[float]]:
        """Latencies while the other page rests, and while it plays, ms."""
        await self._program.start()
        try:
            return await in_browsers(address, elsewhere=self._program)
        finally:
            await self._program.stop()


class ProcessorTime:
    """Processor time of processes with their children, in cores: seconds a second."""

    def __init__(self, **roots: int) -> None:
        """Begin now; the names are those of the processes."""
        self._roots, self._before, self._since = roots, _processes(), time.perf_counter()

    def __str__(self) -> str:
        """Describe the time since the beginning."""
        now, elapsed = _processes(), time.perf_counter() - self._since
        words = []
        for name, root in self._roots.items():
            family, spent = {root}, 0.0
            for pid, (parent, seconds) in sorted(now.items()):
                if pid == root or parent in family:
                    family.add(pid)
                    spent += seconds - self._before.get(pid, (0, 0.0))[1]
            words.append(f"{name} {spent / elapsed:.2f}")
        return ", ".join(words)


def _processes(name: str = "") -> dict[int, tuple[int, float]]:
    """Parent and processor time, s, of each process by its number; of those with a name that begins so."""
    found = {}
    for path in Path("/proc").glob("[0-9]*/stat"):
        with suppress(OSError):
            called, _, rest = path.read_text().partition("(")[2].rpartition(")")
            if not called.startswith(name):
                continue
            fields = rest.split()
            spent = (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
            found[int(path.parent.name)] = int(fields[1]), spent
    return found


class Hand:
    """Drags through a plain socket, and times each move until its contours arrive."""

    def __init__(self, socket: aiohttp.ClientWebSocketResponse) -> None:
        """Use an open socket."""
        self._socket, self._sent, self._seq = socket, dict[int, float](), 0
        self.latencies: list[float] = []
        self.handle: tuple[float, float] | None = None

    async def listen(self) -> None:
        """Note when the contours of a move arrive."""
        with suppress(asyncio.CancelledError):
            async for message in self._socket:
                if message.type is not aiohttp.WSMsgType.BINARY:
                    continue
                (length,) = struct.unpack_from("<I", message.data)
                header = json.loads(message.data[4 : 4 + length])
                if header["type"] != "overlay":
                    continue
                at = time.perf_counter()
                for one in header["handles"]:
                    if one["camera"] == 0 and one["point"] == "left_wrist":
                        self.handle = (one["u"], one["v"])
                seq = header["seq"]
                if seq in self._sent:
                    self.latencies.append(1000 * (at - self._sent.pop(seq)))

    async def drag(self) -> list[float]:
        """Latencies of the moves of a drag, ms."""
        self.latencies = []
        assert self.handle is not None
        u, v = self.handle
        for k in range(MOVES):
            self._seq += 1
            self._sent[self._seq] = time.perf_counter()
            place = {"u": u + 20 * np.sin(k / 12), "v": v - 10 + 10 * np.cos(k / 9)}
            phase = "start" if k == 0 else "end" if k == MOVES - 1 else "move"
            fields = {"camera": 0, "person": 0, "point": "left_wrist", "mode": "move", "frame": 0}
            await self._socket.send_json({"type": "drag", "phase": phase, "seq": self._seq, **fields, **place})
            await asyncio.sleep(INTERVAL_S)
        await asyncio.sleep(1)
        return self.latencies


async def play(socket: aiohttp.ClientWebSocketResponse, plays: asyncio.Event) -> None:
    """Ask for one frame after the other while that is wanted."""
    frame = 0
    while True:
        await plays.wait()
        frame = (frame + 1) % 50
        await socket.send_json({"type": "seek", "frame": frame})
        await asyncio.sleep(1 / FPS)


async def drain(socket: aiohttp.ClientWebSocketResponse) -> None:
    """Read all that comes."""
    async for _ in socket:
        pass


async def by_sockets(address: str) -> tuple[list[float], list[float]]:
    """As `in_browsers`, without browsers."""
    alone, beside = [], []
    url = address.replace("http", "ws") + "ws"
    async with (
        aiohttp.ClientSession() as client,
        client.ws_connect(url, max_msg_size=0) as anna,
        client.ws_connect(f"{url}?name=cleo", max_msg_size=0) as ben,
    ):
        view = {"type": "view", "layers": ["image", "contours", "joints"], "reductions": [1] * 4, "by_part": False}
        await anna.send_json(view)
        await ben.send_json(view)
        hand, plays = Hand(anna), asyncio.Event()
        work = [asyncio.create_task(c) for c in (hand.listen(), play(ben, plays), drain(ben))]
        while hand.handle is None:
            await asyncio.sleep(1)
        await asyncio.sleep(3)
        for _ in range(ROUNDS):
            alone += await hand.drag()
            plays.set()
            await asyncio.sleep(1)
            beside += await hand.drag()
            plays.clear()
            await asyncio.sleep(1)
        for task in work:
            task.cancel()
        await asyncio.gather(*work, return_exceptions=True)
    return alone, beside


async def main() -> None:
    """Print medians, 95th percentiles and their ratio."""
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary) / "session"
        shutil.copytree(ROOT / "sample_sessions" / "elbow_rotation", folder)
        other = Path(temporary) / "other"
        shutil.copytree(folder, other)
        ways = {"sockets": by_sockets, "browsers": in_browsers, "apart": apart, "elsewhere": Elsewhere(other)}
        for name, measure in ways.items():
            if sys.argv[1:] and name not in sys.argv[1:]:
                continue
            if measure is apart:
                os.sched_setaffinity(0, CORES[:-1])
            program = Program(folder, "--annotator", "anna")
            await program.start()
            alone, beside = await measure(program.address)
            await program.stop()
            (a50, a95), (b50, b95) = np.percentile(alone, [50, 95]), np.percentile(beside, [50, 95])
            print(
                f"{name}: {len(alone)} and {len(beside)} moves; alone median {a50:.0f} ms, p95 {a95:.0f} ms; while the "
                f"other plays {b50:.0f} and {b95:.0f} ms; ratio of p95 {b95 / a95:.2f}"
            )


if __name__ == "__main__":
    asyncio.run(main())
