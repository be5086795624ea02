"""A real run on the bundled sample: track forward and back while the panes follow, pause, look around, undo."""

import asyncio
import shutil

import numpy as np
import pytest
import pytest_asyncio
from page_driver import command, frame_place, go_to, handle_of, shows, state_of
from program import SAMPLE, visited
from stored_motions import store_poses

from tracker.formats.pose_csv import read_pose_table
from tracker.session.session import load_session

START = 8
"""The arms are on their way up."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A copy of the sample whose body a person has put in place on one frame."""
    folder = shutil.copytree(SAMPLE, tmp_path_factory.mktemp("tracking") / "session")
    truth = read_pose_table(folder / "truth.csv")
    store_poses(load_session(folder), {START: truth.values[START]}, label="place", keyframe=True)
    return folder


@pytest_asyncio.fixture(loop_scope="session")
async def live(browser, program):
    async with visited(browser, program.address, (1440, 900)) as page:
        await go_to(page, START)
        yield page


PAUSED_AFTER = """async (done) => {
  while (!(quadrille.state.state.track.done > done)) await new Promise((resolve) => setTimeout(resolve, 2));
  quadrille.command("Pause or continue tracking");
}"""
"""Pauses from within the page: a quick tracker is through before a driver outside has heard of it."""
THUMBNAIL = """async (frame) => {
  const answer = await fetch(`thumbnail/0/${frame}?limb=0`);
  if (!answer.ok) return [answer.status];
  const { width, height } = await createImageBitmap(await answer.blob());
  return [answer.status, answer.headers.get("Content-Type"), width, height];
}"""
FOLLOWED = "quadrille.state.shown.frame === {0} && quadrille.state.overlay.frame === {0}"


async def said(page, expression, timeout_s=60.0):
    """Wait until the program has said something, drawn or not: a quick tracker does not wait for a slow browser."""
    async with asyncio.timeout(timeout_s):
        while not await page.evaluate(expression):
            await asyncio.sleep(0.005)


async def test_a_run_is_watched_paused_looked_at_and_taken_back(live):
    await live.keyboard.press("c")
    before = await handle_of(live, 0, "left_wrist")
    await live.keyboard.press("t")
    await live.evaluate(PAUSED_AFTER, 2)
    await said(live, "!quadrille.state.state.track.running")
    at = (await state_of(live))["state"]["track"]["at"]
    assert START + 3 <= at < 49
    await shows(live, FOLLOWED.format(at), 60)
    after = await handle_of(live, 0, "left_wrist")
    assert 0 < np.hypot(*np.subtract(after, before)) < 12 * (at - START)  # it follows the arm
    state = (await state_of(live))["state"]
    assert state["status"] in ("good", "doubtful", "lost")
    assert len(state["part_costs_px"]) == 10

    # All of it is in the timeline and in the curves, and a click on a curve leads there.
    await shows(live, f"Number.isFinite(quadrille.state.curves.series[0].values[{at}])", 20)
    timeline = (await state_of(live))["timeline"]
    assert {timeline[str(f)]["source"] for f in range(START + 1, at + 1)} == {"tracked"}
    assert timeline[str(START)]["keyframe"]
    await live.mouse.click(*await frame_place(live, START + 2, 0.01, "#curves"))
    await shows(live, FOLLOWED.format(START + 2), 60)

    # Beside the socket, the program draws any of the poses.
    thumbnail = await live.evaluate(THUMBNAIL, START + 1)
    assert thumbnail == [200, "image/jpeg", 160, 160]
    assert (await live.evaluate(THUMBNAIL, at + 5))[0] == 404  # not tracked yet

    await command(live, "Pause or continue tracking")
    await said(live, f"quadrille.state.state.track.at > {at}", 120)
    await live.keyboard.press("Escape")
    await shows(live, "quadrille.state.state.track.first === null", 60)
    await shows(live, f"quadrille.state.timeline[{at + 1}]?.source === 'tracked'", 20)
    assert (await state_of(live))["state"]["undo"] == f"track forward from frame {START + 1}"  # one entry for all of it
    await live.keyboard.press("Control+z")
    await shows(live, f"Object.keys(quadrille.state.timeline).join() === '{START}'", 20)


@pytest.mark.slow
async def test_backward_to_the_first_frame_is_seen_frame_by_frame(live):
    await go_to(live, START)
    await live.locator("#track-backward").click()
    seen, message = [], ""
    async with asyncio.timeout(120):
        while not message:
            image, vectors, message = await live.evaluate(
                "(({ shown, overlay, state }) => [shown.frame, overlay.frame, state.track.message])(quadrille.state)"
            )
            if image == vectors and image not in seen:
                seen.append(image)
    await shows(live, FOLLOWED.format(0), 60)
    assert len(seen) >= 3
    assert seen == sorted(seen, reverse=True)
    assert {int(f) for f in (await state_of(live))["timeline"]} == set(range(START + 1))
    await live.keyboard.press("Control+z")
    await shows(live, f"Object.keys(quadrille.state.timeline).join() === '{START}'", 20)
