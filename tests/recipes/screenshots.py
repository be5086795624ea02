"""Pictures of every state of the page: `python tests/recipes/screenshots.py OUT`, to be looked at one by one.

Runs the real program on the bundled samples and on sessions made for the purpose (one camera, eight), in dark and
light, for a laptop and for a large screen. `--only NAME` takes those whose name begins so, `--tutorial` those that
docs/tutorial.md shows, as JPEG.
"""

import argparse
import asyncio
import shutil
import sys
import tempfile
from collections.abc import Awaitable, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from stored_motions import put_poses

sys.path[:0] = [str(Path(__file__).resolve().parents[1] / "support")]

from chromium import FLAGS, chromium_path
from page_driver import command, handle_of, shows, to_client, toggle_layer
from playwright.async_api import Browser, Page, async_playwright
from program import ROOT, Program

from tracker.estimation.fitting.gauss_newton import fit_to_points
from tracker.evaluation.references import read_joints
from tracker.formats.pose_csv import read_pose_table
from tracker.session.session import Session, load_session, save_session
from tracker.session.store.annotation_store import AnnotationStore
from tracker.simulate.record import Simulation, simulate

SAMPLES = ROOT / "sample_sessions"
LAPTOP, LARGE = (1280, 720), (1920, 1080)
SETTLE_S = 3.0
"""The 3-D view draws slowly without a graphics card."""

Act = Callable[[Page], Awaitable[None]]


@dataclass(frozen=True)
class Screenshot:
    """A picture to take."""

    name: str
    session: str
    """Which of the sessions that `make_sessions` makes."""
    act: Act
    """What a user does to get there."""
    size: tuple[int, int] = LAPTOP
    scheme: str = "dark"


def by_keys(*steps: str | tuple[str, str, float]) -> Act:
    """Return an act of commands and keys; after one, it may wait so many seconds for what the page must show."""

    async def act(page: Page) -> None:
        for step in steps:
            key, *shown = (step,) if isinstance(step, str) else step
            await command(page, key)
            if shown:
                await shows(page, *shown)

    return act


async def posing(page: Page) -> None:
    """In the middle of a drag of the wrist, which goes on until the picture is taken."""
    x, y = await to_client(page, 0, *await handle_of(page, 0, "left_wrist"))
    await page.mouse.move(x, y)
    await page.mouse.down()
    for k in range(1, 6):
        await page.mouse.move(x + 5 * k, y - 7 * k)
    await shows(page, "quadrille.state.overlay.paths.some((path) => path.kind === 'epipolar')", 20)


async def pins(page: Page) -> None:
    """Two views pinned: they meet in space."""
    await page.mouse.click(*await to_client(page, 0, *await handle_of(page, 0, "left_wrist")))
    await shows(page, "quadrille.state.state.point === 'left_wrist'", 20)
    for camera in (0, 1):
        u, v = await handle_of(page, camera, "left_wrist")
        await page.keyboard.down("Control")
        await page.mouse.click(*await to_client(page, camera, u + 12, v - 8))
        await page.keyboard.up("Control")
        await shows(page, f"quadrille.state.overlay.pins.length === {camera + 1}", 20)


async def layers(page: Page) -> None:
    """Every layer in its menu, some of them on."""
    for layer in ("hidden", "parts"):
        await toggle_layer(page, layer)
    await page.keyboard.press("a")


async def searching(page: Page) -> None:
    """A search at a speed for watching."""
    await command(page, "Search panel")
    await page.select_option("select[aria-label='Expansions per second']", index=1)
    await page.keyboard.press("f")
    await shows(page, "quadrille.state.state.job.evaluations > 50", 60)


async def replaying(page: Page) -> None:
    """A finished search, looked at half way."""
    await by_keys("Search panel", ("f", "quadrille.state.state.job.message.startsWith('done')", 120))(page)
    box = await page.locator("#drawer input[type=range]").bounding_box()
    await page.mouse.click(box["x"] + box["width"] / 3, box["y"] + box["height"] / 2)


async def landscape(page: Page) -> None:
    await page.mouse.click(*await to_client(page, 0, *await handle_of(page, 0, "left_elbow")))
    await command(page, "Cost landscape")


async def palette(page: Page) -> None:
    """What can be done, found by typing."""
    await page.keyboard.press("Control+k")
    await page.keyboard.type("track")


async def history(page: Page) -> None:
    """A few edits, and the list of them."""
    for key in ("ArrowRight", "Mirror the pose left to right", "ArrowUp"):
        await command(page, key)
        await asyncio.sleep(1.2)
    await command(page, "History of edits")


async def before_fit(page: Page) -> None:
    """A fit, with the pose before it and the costs of each view."""
    compared, before = "quadrille.state.state.compared", "Show the pose before the last fit or search, or its result"
    await by_keys(("g", f"{compared}?.work === 'fit'", 60), (before, f"{compared}.is_before_shown", 20))(page)
    await page.click("#show-comparison")


async def inspector(page: Page) -> None:
    """Other sizes that are not applied yet, and the settings below them."""
    await command(page, "Inspector: sizes, settings (toggle)")
    upper_arm = page.get_by_label("Upper arm: length between its joints, cm")
    await upper_arm.fill("36")
    await page.keyboard.press("Enter")
    await shows(page, "quadrille.state.bodySizes.edited", 20)


async def settings(page: Page) -> None:
    """Settings of tracker, search and view."""
    await command(page, "Inspector: sizes, settings (toggle)")
    for section in ("body", "track", "search", "view"):
        await page.click(f"[data-section={section}] summary")


async def new_session(page: Page) -> None:
    """The form of a new session, with the first check that fails."""
    await page.keyboard.press("Control+k")
    await page.keyboard.type("new session")
    await page.keyboard.press("Enter")
    for name, value in {"footage": SAMPLES / "tango", "calibration": SAMPLES / "tango" / "calibration.toml"}.items():
        await page.fill(f"#new-{name}", str(value))
    await page.fill("#new-folder", str(SAMPLES))
    await page.keyboard.press("Enter")
    await page.locator("#new-session-checks .is-failed").wait_for()


TRACK = "t", "quadrille.state.state.track.message.startsWith('done')", 300
THUMBNAILS = "[...document.querySelectorAll('.doubt img')].slice(0, 3).every((one) => one.naturalWidth > 0)"
NOTHING, TRACKED = by_keys(), by_keys(TRACK, "c")
NEXT = ("Next doubtful or lost pose by severity", THUMBNAILS, 60)
DOUBTS = by_keys(TRACK, "Doubtful and lost poses, most severe first", NEXT)
FAULT = "document.querySelector('#advice').dataset.level === 'fault'"
SCREENS = [
    Screenshot("empty", "fresh", NOTHING),
    Screenshot("empty-light", "fresh", NOTHING, scheme="light"),
    Screenshot("posing", "placed", posing),
    Screenshot("posing-large", "placed", posing, LARGE),
    Screenshot("filled", "placed", by_keys("1")),
    Screenshot("pins", "placed", pins),
    Screenshot("pins-light", "placed", pins, scheme="light"),
    Screenshot("layers", "placed", layers),
    Screenshot("search-running", "near", searching),
    Screenshot("search-replay", "near", replaying),
    Screenshot("search-replay-large", "near", replaying, LARGE, "light"),
    Screenshot("landscape", "placed", landscape),
    Screenshot(
        "tracking", "placed", by_keys(("t", "quadrille.state.state.track.done > 3", 120), "Pause or continue tracking")
    ),
    Screenshot("curves", "placed", TRACKED),
    Screenshot("curves-light-large", "placed", TRACKED, LARGE, "light"),
    Screenshot("notice", "fresh", by_keys(("t", FAULT, 20))),
    Screenshot("keys", "placed", by_keys("?")),
    Screenshot("palette", "placed", palette),
    Screenshot("history", "placed", history),
    Screenshot("one-camera", "one", NOTHING),
    Screenshot("eight-cameras", "eight", NOTHING),
    Screenshot("eight-cameras-large-light", "eight", NOTHING, LARGE, "light"),
    Screenshot("before-fit", "near", before_fit),
    Screenshot("doubts", "tango", DOUBTS),
    Screenshot("doubts-light-large", "tango", DOUBTS, LARGE, "light"),
    Screenshot("inspector", "placed", inspector),
    Screenshot("inspector-light-large", "tango", inspector, LARGE, "light"),
    Screenshot("settings", "tango", settings),
    Screenshot("settings-light-large", "placed", settings, LARGE, "light"),
    Screenshot("sessions", "placed", by_keys("Open another session")),
    Screenshot("new-session", "fresh", new_session),
    Screenshot("two-people", "tango", NOTHING),
    Screenshot("page", "tango", by_keys(("g", "/fit/i.test(quadrille.state.state.undo ?? '')", 60)), (1600, 900)),
]

TUTORIAL = ("empty", "inspector", "posing", "pins", "search-replay", "landscape", "curves", "palette")


def make_sessions(folder: Path, wanted: set[str]) -> dict[str, Path]:
    """Make the sessions that pictures are taken of."""
    made = {name: folder / name for name in wanted}
    for name, at in made.items():
        if name == "eight":
            simulate(at, Simulation("exercise", n_cameras=8, n_frames=4, size=(320, 240)))
        else:
            shutil.copytree(SAMPLES / ("tango" if name == "tango" else "elbow_rotation"), at)
        session = load_session(at)
        if name == "one":
            save_session(replace(session, cameras=session.cameras[:1]))
        if name != "fresh":
            place(load_session(at), near=name == "near")
    return made


def place(session: Session, near: bool) -> None:
    """Put everybody on frame 0, where the true joints are or a hand has put the dancers; near: arms a little off."""
    joints = None if len(session.people) > 1 else read_joints(session.folder / "truth.trc", session.fps)
    with AnnotationStore(session.annotations_path) as store:
        for person in session.people:
            model = person.model
            if joints is None:
                values = read_pose_table(session.folder / f"first_pose_{person.name}.csv").values_for(model)[0]
            else:
                places = dict(zip(joints.names, joints.points[0], strict=True))
                values = fit_to_points(model, {n: p for n, p in places.items() if n in model.point_names}).pose
            if near:
                values = model.retract(values, np.where(np.arange(model.n_dofs) >= 6, 0.12, 0.02))
                values = model.clip(values)
            put_poses(store, person, {0: values}, label="place", keyframe=True)


@asynccontextmanager
async def opened(browser: Browser, folder: Path, screen: Screenshot):
    """The page of a session, with its first frame and its cost on the screen."""
    with tempfile.TemporaryDirectory() as name:
        program = Program(shutil.copytree(folder, Path(name) / folder.name), has_token=True)
        await program.start()
        context = await browser.new_context(
            viewport={"width": screen.size[0], "height": screen.size[1]}, color_scheme=screen.scheme
        )
        try:
            page = await context.new_page()
            await page.goto(program.address, timeout=120_000)
            await page.wait_for_url(lambda url: "token" not in url)  # the page goes on to an address without it
            await shows(page, "window.quadrille?.state.overlay && quadrille.state.state.cost_px !== null", 180)
            yield page
        finally:
            await context.close()
            await program.kill()


async def take(out: Path, only: str, tutorial: bool) -> None:
    """Take the pictures, one after the other."""
    out.mkdir(parents=True, exist_ok=True)
    screens = [s for s in SCREENS if s.name.startswith(only) and (s.name in TUTORIAL or not tutorial)]
    with tempfile.TemporaryDirectory() as name:
        sessions = make_sessions(Path(name), {s.session for s in screens})
        async with async_playwright() as playwright:
            browser = await playwright.chromium.launch(executable_path=chromium_path(), args=FLAGS)
            for screen in screens:
                path = out / f"{screen.name}.{'jpg' if tutorial else 'png'}"
                async with opened(browser, sessions[screen.session], screen) as page:
                    await screen.act(page)
                    await asyncio.sleep(SETTLE_S)
                    await page.screenshot(path=path, timeout=120_000, **({"quality": 80} if tutorial else {}))
                print(path, flush=True)
            await browser.close()


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", type=Path, help="folder for the pictures")
    parser.add_argument("--only", default="", help="those whose name begins so")
    parser.add_argument("--tutorial", action="store_true", help="those of docs/tutorial.md, as JPEG")
    words = parser.parse_args()
    asyncio.run(take(words.out, words.only, words.tutorial))
