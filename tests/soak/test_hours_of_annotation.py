"""An hour of scripted annotation in a browser: nothing goes wrong, and neither the program nor the page grows.

A second page subscribes to all that the protocol offers, starts short tracking runs and breaks half of them off.

`QUADRILLE_SOAK=1` takes the whole hour, and only then memory is judged: caches fill in the first half. To run it alone:
`QUADRILLE_SOAK=1 python -m pytest -m slow tests/soak/test_hours_of_annotation.py`.
"""

import asyncio
import random
import shutil
import time
from contextlib import asynccontextmanager
from pathlib import Path

import aiohttp
import numpy as np
import pytest
from chromium import FLAGS, chromium_path
from memory import memory_mb
from page_driver import command, dragging, shows
from playwright.async_api import async_playwright
from program import SAMPLE, started, visited

from app.state.page_view import LAYERS
from tracker.session.session import load_session
from tracker.session.store.annotation_store import AnnotationStore

HOUR_S = 3600.0
JUDGED_S = 1800.0
"""A shorter soak is not judged by its memory."""
MOST_MB_PER_MINUTE = 0.2
MEASURED_S, REPORTED = 5.0, 12
"""Time between two measurements, and how many of them a line reports."""
KEPT_S = 60.0
"""The least of this time is what the program keeps: what a frame or a search takes and gives back is some 30 MB, which
leaves the slope of half an hour uncertain by more than what is allowed."""
POINTS = ("left_wrist", "right_wrist", "left_elbow", "right_elbow", "left_knee", "right_ankle", "head", "torso")
KEYS = (
    "g", "g", "Control+z", "Control+z", "Control+Shift+z", "]", "[", "c", *("History of edits",) * 2,
    *("Earlier sentences of the line",) * 2, "Mirror the pose left to right", "Reset the joint's limb to neutral",
)  # fmt: skip
N_FRAMES = 50
SEED = 7


async def heap_mb(devtools):
    """What the page's objects take after a collection of garbage, MB."""
    await devtools.send("HeapProfiler.collectGarbage")
    metrics = (await devtools.send("Performance.getMetrics"))["metrics"]
    return next(m["value"] for m in metrics if m["name"] == "JSHeapUsedSize") / 1e6


async def go_to(page, frame):
    # Paused within the page: a click from here may come after the end of the clip, and start it again.
    await page.evaluate("() => quadrille.state.playing && document.querySelector('#play').click()")
    await page.locator("#frame").fill(str(frame))
    await page.keyboard.press("Enter")
    await page.locator("#frame").blur()
    try:
        await shows(page, f"quadrille.state.shown.frame === {frame} && quadrille.state.overlay.frame === {frame}", 60)
    except AssertionError as error:
        at = await page.evaluate("[quadrille.state.target, quadrille.state.state.frame, quadrille.state.state.job]")
        raise AssertionError(f"{error}; target, frame and job are {at}") from None


SUBSCRIPTIONS = (
    {"type": "view", "layers": LAYERS, "reductions": [1, 1, 1, 1], "by_part": True},
    {"type": "history", "limit": 2000},
    {"type": "curves", "group": "arms"},
    {"type": "watch", "tab": "search"},
)


@asynccontextmanager
async def subscribed(address):
    """The socket of a page that is sent everything."""
    async with (
        aiohttp.ClientSession() as session,
        session.ws_connect(address.replace("http", "ws") + "ws", max_msg_size=0) as socket,
    ):

        async def hear():
            async for _ in socket:
                pass

        for message in SUBSCRIPTIONS:
            await socket.send_json(message)
        hearing = asyncio.create_task(hear())
        yield socket
        hearing.cancel()


async def track(page, socket, rng):
    """Track some frames, to the end or not."""
    frame = await page.evaluate("quadrille.state.state.frame")
    await socket.send_json({"type": "track", "action": "forward", "until": min(frame + 4, N_FRAMES - 1)})
    await asyncio.sleep(rng.uniform(0.0, 1.0))
    if rng.random() < 0.5:
        await socket.send_json({"type": "track", "action": "stop"})
    await shows(page, "quadrille.state.state.track.running === false", 120)


async def act(page, socket, rng):
    """What an annotator does on a frame: look, drag some joints in some views, change their mind, search, go on."""
    # Another frame than the page shows: it would ask for none, though an undo on its way may still leave this one.
    shown = await page.evaluate("quadrille.state.target")
    await go_to(page, rng.choice([k for k in range(N_FRAMES) if k != shown]))
    for _ in range(rng.randint(1, 3)):
        offset = rng.uniform(-15, 15), rng.uniform(-15, 15)
        async with dragging(page, rng.randrange(4), rng.choice(POINTS), offset):
            await asyncio.sleep(0.1)
        await asyncio.sleep(rng.uniform(0.1, 0.4))
    for key in rng.sample(KEYS, 2):
        await command(page, key)
        await asyncio.sleep(0.1)
    await page.keyboard.press("Escape")
    if rng.random() < 0.1:
        await page.locator("#search-frame").click()
        await shows(page, "quadrille.state.state.job.running === false", 120)
    if rng.random() < 0.3:
        await track(page, socket, rng)
    if rng.random() < 0.1:
        await page.locator("#play").click()
        await asyncio.sleep(1.0)
    await shows(page, "quadrille.state.state.saved", 60)


def kept(times_s, values):
    """The least value of each span of `KEPT_S`, with the middle of the span."""
    spans = np.array(times_s) // KEPT_S
    return [(KEPT_S * (k + 0.5), min(np.array(values)[spans == k])) for k in np.unique(spans)]


def slope_per_minute(times_s, values):
    """Growth of what is kept over the second half of the measurements, per minute, and its standard error."""
    half = [(t, v) for t, v in kept(times_s, values) if t >= times_s[-1] / 2]
    if len(half) < 4:
        return float("nan"), float("nan")
    (slope, _), covariance = np.polyfit(*np.transpose(half), 1, cov=True)
    return 60 * float(slope), 60 * float(np.sqrt(covariance[0, 0]))


@pytest.mark.slow
async def test_an_hour_of_annotation_loses_nothing_and_does_not_grow(tmp_path, cases, report):
    folder = Path(shutil.copytree(SAMPLE, tmp_path / "session"))
    length_s, rng = cases(HOUR_S), random.Random(SEED)
    rows = []
    n = 0
    async with (
        async_playwright() as playwright,
        await playwright.chromium.launch(executable_path=chromium_path(), args=FLAGS) as browser,
        started(folder) as program,
        visited(browser, program.address) as page,
        subscribed(program.address) as socket,
    ):
        devtools = await page.context.new_cdp_session(page)
        await devtools.send("Performance.enable")
        begun = measured = time.monotonic()
        while time.monotonic() < begun + length_s:
            await act(page, socket, rng)
            assert not socket.closed, "the program has closed the socket of the second page"
            n += 1
            if time.monotonic() >= measured + min(MEASURED_S, length_s / 6):
                measured = time.monotonic()
                rows.append((measured - begun, memory_mb("VmRSS", program.pid), await heap_mb(devtools)))
                if len(rows) % REPORTED == 0:
                    minutes, program_mb, page_mb = rows[-1][0] / 60, *rows[-1][1:]
                    report(f"{minutes:.1f} min, {n} frames, program {program_mb:.0f} MB, page {page_mb:.1f} MB")
        await program.stop()
    times, *memory = zip(*rows, strict=True)
    growth = [slope_per_minute(times, values) for values in memory]
    slopes = " and ".join(f"{slope:+.2f} ± {error:.2f}" for slope, error in growth)
    report(f"{n} frames in {times[-1] / 60:.0f} min: {slopes} MB a minute, second half")
    store = AnnotationStore(load_session(folder).annotations_path)
    assert len(store.history(limit=1_000_000)) > n / 2
    store.close()
    if length_s >= JUDGED_S:
        assert max(slope for slope, _ in growth) < MOST_MB_PER_MINUTE
