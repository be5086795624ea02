"""Shared pages in Chromium, opened from a file with the network off: they draw, step, play, and ask for nothing."""

from contextlib import asynccontextmanager
from dataclasses import replace

import cv2
import numpy as np
import pytest
from page_driver import drag_mouse, shows
from true_poses import sample_with_poses

from app.share.content import SharedComment
from app.share.folder import share
from tracker.footage.recording import Recording
from tracker.interchange.exports.motion import read_motion
from tracker.session.session import Person

EVIL = "</script><script>globalThis.hacked = 1</script><img src=x onerror='globalThis.hacked = 1'>"
N = 5
FRAME = "document.querySelector('#frame').textContent"
PIXELS = "(id) => document.querySelector(id).toDataURL()"
"""JavaScript: what a canvas shows. Pictures from files cannot be read back: one file has them as data."""


COMMENTS = [
    SharedComment(EVIL, 4, "left arm", f"too far out {EVIL}", "ben", False),
    SharedComment(EVIL, 4, "", "fine", "", True),
    SharedComment("nobody", 4, "", "of another", "ben", False),
]


@pytest.fixture(scope="module")
def shared(tmp_path_factory, kernels):
    """A folder and a file of a few frames, whose session and person have names with markup."""
    folder = tmp_path_factory.mktemp("shared")
    motion = read_motion(sample_with_poses(folder / "session", N), (0,))
    people = tuple(replace(p, person=Person(EVIL, p.person.model, "#f2a33a")) for p in motion.people)
    motion = replace(motion, session=replace(motion.session, name=EVIL), people=people)
    for name in ("review", "review.html"):
        share(motion, folder / name, 30e6, comments=COMMENTS)
    return {"folder": folder / "review" / "index.html", "file": folder / "review.html"}


@asynccontextmanager
async def opened(browser, path, **options):
    """The page of a path, offline, with what it asked for and what went wrong."""
    context = await browser.new_context(offline=True, viewport={"width": 1280, "height": 720}, **options)
    try:
        page = await context.new_page()
        page.asked, page.errors = [], []
        page.on("request", lambda request: page.asked.append(request.url))
        page.on("pageerror", lambda error: page.errors.append(str(error)))
        page.on("console", lambda message: page.errors.append(message.text))
        page.on("requestfailed", lambda request: page.errors.append(request.url))
        await page.goto(path.as_uri())
        await shows(page, f"{FRAME} === 'frame 0'")
        yield page
        assert page.errors == []
        assert {url.partition(":")[0] for url in page.asked} <= {"file", "data"}
        assert await page.evaluate("globalThis.hacked") is None
    finally:
        await context.close()


@pytest.mark.parametrize("kind", ["folder", "file"])
async def test_it_opens_steps_plays_and_changes_its_scheme(browser, shared, kind):
    async with opened(browser, shared[kind], color_scheme="light") as page:
        assert await page.inner_text("#session") == EVIL
        assert await page.locator(".view").count() == 4
        await page.keyboard.press("ArrowRight")
        await shows(page, f"{FRAME} === 'frame 1'")
        await page.keyboard.press("End")
        await page.keyboard.press("ArrowLeft")
        await shows(page, f"{FRAME} === 'frame {N - 2}'")
        await page.keyboard.press("Home")
        await page.keyboard.press(" ")
        await shows(page, f"{FRAME} === 'frame {N - 1}' && document.querySelector('#play').textContent === 'Play'")
        dark = "document.documentElement.dataset.theme === 'dark'"
        assert not await page.evaluate(dark)
        await page.click("#theme")
        assert await page.evaluate(dark)
        await page.keyboard.press("2")
        await shows(page, "document.querySelectorAll('.view:not([hidden])').length === 1")
        await page.locator("#remarks button").first.click()
        await shows(page, f"{FRAME} === 'frame 2'")
        assert "doubtful, tracked" in await page.inner_text("#details")
        listed = await page.locator("#remarks li").all_inner_texts()
        assert listed == ["2–3: left arm uncertain", f"4: ben, left arm: “too far out {EVIL}”", "4: “fine”, resolved"]
        await page.locator("#remarks button").last.click()
        await shows(page, f"{FRAME} === 'frame 4'")


async def test_views_3d_and_curves_are_drawn(browser, shared):
    """Each canvas changes with what it shows, and a view without bones and contours is the picture alone."""
    async with opened(browser, shared["file"]) as page:
        await page.wait_for_timeout(300)  # pictures are decoded
        canvases = ["#views .view:nth-child(1) canvas", "#scene", "#curves", "#timeline"]
        first = [await page.evaluate(PIXELS, canvas) for canvas in canvases]
        await page.keyboard.press("End")
        await shows(page, f"{FRAME} === 'frame {N - 1}'")
        await page.wait_for_timeout(300)
        last = [await page.evaluate(PIXELS, canvas) for canvas in canvases]
        assert all(a != b for a, b in zip(first, last, strict=True))
        sums = {last[0]}
        for key in ("c", "b"):  # bones, then neither
            await page.keyboard.press(key)
            await page.wait_for_timeout(100)
            sums.add(await page.evaluate(PIXELS, canvases[0]))
        assert len(sums) == 3
        box = await page.locator("#scene").bounding_box()
        await drag_mouse(page, (box["x"] + 100, box["y"] + 100), (box["x"] + 160, box["y"] + 110), steps=1)
        await page.wait_for_timeout(100)
        assert await page.evaluate(PIXELS, "#scene") != last[1]


async def test_the_whole_page_fits_the_window(browser, shared):
    async with opened(browser, shared["folder"]) as page:
        for width, height in ((1280, 720), (1920, 1080)):
            await page.set_viewport_size({"width": width, "height": height})
            assert await page.evaluate("[document.body.scrollWidth, document.body.scrollHeight]") == [width, height]
            edges = "['header', 'main', 'footer'].map((e) => document.querySelector(e).getBoundingClientRect().bottom)"
            assert (await page.evaluate(edges))[2] <= height
            notes = await page.evaluate("document.querySelector('#notes').getBoundingClientRect().toJSON()")
            footer = await page.evaluate("document.querySelector('footer').getBoundingClientRect().top")
            assert notes["height"] > 100
            assert notes["bottom"] <= footer


@pytest.mark.slow
async def test_300_frames_of_four_views_take_at_most_30_mb(browser, tmp_path):
    session = sample_with_poses(tmp_path / "session", 300)
    cameras = []
    with Recording(session.cameras) as recording:  # 50 frames forth and back, each with its own noise
        for view, source in enumerate(session.cameras):
            shots = tmp_path / source.camera.name
            shots.mkdir()
            rng = np.random.default_rng(view)
            for k in range(300):
                image = recording.read_view(view, k % 50).astype(int) + rng.integers(
                    -6, 7, (source.camera.height, 1, 1)
                )
                picture = np.clip(image, 0, 255).astype(np.uint8)[:, :, ::-1]
                cv2.imwrite(str(shots / f"{k:03d}.jpg"), picture, [cv2.IMWRITE_JPEG_QUALITY, 95])
            cameras.append(replace(source, footage=shots, offset=0, footage_frames=None))
    long = replace(session, cameras=tuple(cameras), n_frames=300)
    size = share(read_motion(long, (0,)), tmp_path / "review", 30e6)
    assert 15e6 < size <= 30e6
    async with opened(browser, tmp_path / "review" / "index.html") as page:
        await page.keyboard.press("End")
        await shows(page, f"{FRAME} === 'frame 299'")
