"""Make the animation of README: `python tests/recipes/animation.py docs/images/quadrille.webp`.

Drives the page on a simulated dance, filmed by three cameras: a person is placed by dragging joints in two views, the
search fits it, the recording is tracked, and a doubt of the run is shown. Some ten seconds, seven pictures a second.
"""

import argparse
import asyncio
import sys
import tempfile
from pathlib import Path

sys.path[:0] = [str(Path(__file__).resolve().parents[1] / "support")]

import imageio.v3 as iio
from chromium import FLAGS, chromium_path
from demo import film_dance
from page_driver import OPENED, handle_of, shows, to_client
from playwright.async_api import Page, async_playwright
from program import Program

from tracker.evaluation.references import read_joints
from tracker.footage.video_writer import AnimationWriter
from tracker.session.session import Session, load_session

PICTURES_A_SECOND = 7
WIDTH_PX = 1100
TRUNK = ("left_hip", "right_hip", "left_shoulder", "right_shoulder")
ARMS = ("left_elbow", "left_wrist", "right_elbow", "right_wrist")
N_TRACKING = 24
"""Number of pictures of the run."""


class Film:
    """The pictures of a page, one after the other."""

    def __init__(self, page: Page) -> None:
        self.page, self.pictures = page, []

    async def take(self, n: int = 1) -> None:
        """Take a picture that is shown for n of them."""
        picture = iio.imread(await self.page.screenshot(), plugin="pillow")[..., :3]
        self.pictures += [picture] * n


async def place(film: Film, session: Session) -> None:
    """Drag joints to where the truth is, in the first and the second view by turns."""
    joints = read_joints(session.folder / "truth.trc", session.fps)
    places = dict(zip(joints.names, joints.points[0], strict=True))
    places["torso"] = (
        places["left_hip"] + places["right_hip"] + places["left_shoulder"] + places["right_shoulder"]
    ) / 4
    page = film.page
    for i, point in enumerate(("torso", "torso", *TRUNK[2:], *ARMS)):
        camera = i % 2
        start = await to_client(page, camera, *await handle_of(page, camera, point))
        end = await to_client(page, camera, *session.cameras[camera].camera.pinhole.project(places[point][None])[0])
        await page.mouse.move(*start)
        await page.mouse.down()
        for share in (0.5, 1.0):
            await page.mouse.move(*(a + share * (b - a) for a, b in zip(start, end, strict=True)), steps=3)
            await page.wait_for_timeout(400)
            await film.take()
        await page.mouse.up()
        await page.wait_for_timeout(500)


async def play(page: Page, session: Session) -> list:
    """Go through placing, search, run and doubt; return the pictures."""
    film = Film(page)
    await shows(page, OPENED, 60)
    await page.wait_for_timeout(9000)
    await film.take(4)
    await place(film, session)
    await page.keyboard.press("f")
    for _ in range(8):
        await page.wait_for_timeout(250)
        await film.take()
    await shows(page, "quadrille.state.state.job.message.startsWith('done')", 120)
    await film.take(4)
    await page.keyboard.press("t")
    await shows(page, "quadrille.state.advice?.said[0]?.level === 'work'", 30)
    for _ in range(N_TRACKING):
        await page.wait_for_timeout(600)
        await film.take()
    await shows(page, "quadrille.state.advice?.said[0]?.level !== 'work'", 300)
    await page.wait_for_timeout(1500)
    await film.take(5)
    await page.mouse.move(5, 5)
    await page.keyboard.press("n")
    await page.wait_for_timeout(2500)
    await film.take(12)
    return film.pictures


async def main(out: Path) -> None:
    """Make the animation."""
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary) / "dance"
        film_dance(folder)
        program = Program(folder)
        async with async_playwright() as playwright:
            browser = await playwright.chromium.launch(executable_path=chromium_path(), args=FLAGS)
            try:
                await program.start()
                page = await browser.new_page(viewport={"width": WIDTH_PX, "height": 620}, color_scheme="dark")
                await page.goto(program.address)
                pictures = await play(page, load_session(folder))
            finally:
                await browser.close()
                await program.stop()
    with AnimationWriter(out, PICTURES_A_SECOND, WIDTH_PX) as writer:
        for picture in pictures:
            writer.write(picture)
    print(f"{len(pictures)} pictures, {out.stat().st_size / 1e6:.1f} MB")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", type=Path)
    asyncio.run(main(parser.parse_args().out))
