"""A camera that was turned, and one that started late: checked, previewed, corrected, tracked again and undone."""

import shutil
import subprocess
import sys
from dataclasses import replace

import cv2
import numpy as np
import pytest
from page_driver import go_to, reloaded, shows, state_of
from program import ROOT, SAMPLE, started, visited
from stored_motions import store_poses

from tracker.footage.recording import Recording
from tracker.formats.anipose import write_calibration
from tracker.formats.pose_csv import read_pose_table
from tracker.geometry.camera_correction import N_CORRECTIONS, ROTATION, corrected
from tracker.session.session import load_session, save_camera_files

pytestmark = pytest.mark.slow

FRONT, LEFT = 0, 3
FRAME = 12
"""The arms move fastest."""
SECTION = "localStorage.setItem('quadrille.inspector', JSON.stringify({ open: true, sections: ['calibration'] }))"
OUTLINE = """([camera, kind]) => {
  const { paths, segments } = quadrille.state.overlay;
  return paths.filter((path) => path.camera === camera && path.kind === kind)
    .flatMap(({ first, count }) => [...segments.slice(4 * first, 4 * (first + count))]);
}"""
"""JavaScript: the drawn lines of one kind in one view."""


def tracked_copy(folder, changed):
    """Copy the sample, change its cameras, and track it from the true first pose."""
    shutil.copytree(SAMPLE, folder)
    session = changed(load_session(folder))
    session = save_camera_files(session, session.cameras)
    write_calibration(folder / "calibration.toml", [c.camera for c in session.cameras])
    truth = read_pose_table(SAMPLE / "truth.csv")
    store_poses(session, {0: truth.values[0]}, label="place", keyframe=True)
    words = [sys.executable, "-m", "quadrille", "track", str(folder), "--no-whole-run"]
    subprocess.run(words, cwd=ROOT, check=True, capture_output=True)
    return session


def turned(session):
    correction = np.zeros(N_CORRECTIONS)
    correction[ROTATION] = np.radians([0.0, 1.2, 0.0])
    return with_camera(session, LEFT, camera=corrected(session.cameras[LEFT].camera, correction))


def late(session):
    """FRONT shows the frame after. The last frame has no picture there."""
    return replace(with_camera(session, FRONT, offset=1), n_frames=session.n_frames - 1)


def with_camera(session, index, **changes):
    cameras = [replace(c, **changes) if i == index else c for i, c in enumerate(session.cameras)]
    return replace(session, cameras=tuple(cameras))


def poses_of(folder):
    return np.array([c.camera.T_world_camera for c in load_session(folder).cameras])


def silhouette_px(session, camera, frame):
    """The border of the person in a picture, (N, 2), undistorted px: where it differs from the empty scene."""
    source = session.cameras[camera]
    with Recording(session.cameras) as recording:
        image = recording.read_view(camera, frame).astype(int)
    empty = cv2.cvtColor(cv2.imread(str(source.background)), cv2.COLOR_BGR2RGB)
    differs = (np.abs(image - empty).max(axis=2) > 40).astype(np.uint8)
    differs = cv2.morphologyEx(differs, cv2.MORPH_OPEN, np.ones((3, 3), np.uint8))
    contours, _ = cv2.findContours(differs, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    border = max(contours, key=cv2.contourArea).reshape(-1, 2).astype(float)
    return source.camera.undistort_points(border)


async def gap_px(page, border, camera, kind="model"):
    """Median distance from the border of the person to the drawn outline of the body, px; the body has no hands."""
    segments = np.reshape(await page.evaluate(OUTLINE, [camera, kind]), (-1, 4))
    assert len(segments)
    steps = np.linspace(0, 1, 5)[:, None, None]
    drawn = (segments[:, :2] + steps * (segments[:, 2:] - segments[:, :2])).reshape(-1, 2)
    return float(np.median(np.linalg.norm(border[:, None] - drawn, axis=2).min(axis=1)))


async def checked(page):
    """Open the panel on a frame and check the cameras."""
    await page.evaluate(SECTION)
    await reloaded(page, "window.quadrille?.state.overlay", 60)
    await go_to(page, FRAME)
    await page.get_by_role("button", name="Check the cameras").click()
    await shows(page, "quadrille.state.calibration.is_checked", 120)


async def previewed(page):
    await page.get_by_role("button", name="Preview").click()
    await shows(page, f"quadrille.state.calibration.preview_frame === {FRAME}", 60)
    await shows(page, "quadrille.state.overlay.paths.some(({ kind, count }) => kind === 'preview' && count)", 20)


async def tracked_again(page):
    await page.locator("#advice").get_by_role("button", name="Track again").click()
    await shows(page, "!quadrille.state.state.track.running && quadrille.state.state.undo.startsWith('track')", 120)
    await go_to(page, FRAME)
    await shows(page, f"quadrille.state.timeline[{FRAME}].source === 'tracked'", 20)


async def undone(page, label):
    await page.evaluate("document.activeElement?.blur()")
    await page.keyboard.press("Control+z")
    await shows(page, f"quadrille.state.state.redo === {label!r}", 30)


async def healthy_gap_px(browser, folder):
    """Track with the cameras of the sample; return what the outline is off by in LEFT with the generic body, px."""
    session = tracked_copy(folder, lambda s: s)
    async with started(folder) as program, visited(browser, program.address) as page:
        await shows(page, "window.quadrille?.state.overlay", 60)
        await go_to(page, FRAME)
        return await gap_px(page, silhouette_px(session, LEFT, FRAME), LEFT)


async def test_a_turned_camera_is_named_corrected_and_given_back(browser, tmp_path):
    healthy = await healthy_gap_px(browser, tmp_path / "healthy")
    folder = tmp_path / "session"
    session = tracked_copy(folder, turned)
    before = poses_of(folder)
    border = silhouette_px(session, LEFT, FRAME)
    async with started(folder) as program, visited(browser, program.address) as page:
        await checked(page)
        off = page.locator(".calibration-cameras tr.is-off")
        assert await off.count() == 1
        said = await off.inner_text()
        assert said.startswith("LEFT")
        assert "yaw" in said
        off_px = await gap_px(page, border, LEFT)
        assert off_px > healthy + 1.5
        await previewed(page)
        assert await gap_px(page, border, LEFT, "preview") < healthy + 0.1
        await page.get_by_role("button", name="Apply", exact=True).last.click()
        await shows(page, "quadrille.state.calibration.outdated[0].join() === '0,49'", 30)
        assert np.abs(poses_of(folder) - before).max() > 0.01
        await tracked_again(page)
        await shows(page, "quadrille.state.calibration.outdated[0].join() === '0,0'", 20)  # the keyframe
        assert await gap_px(page, border, LEFT) == pytest.approx(healthy, abs=0.1)

        label = (await state_of(page))["state"]["undo"]
        await undone(page, label)
        await undone(page, "calibration of LEFT corrected")
        await shows(page, "quadrille.state.calibration.outdated[0].length === 0", 20)
        assert poses_of(folder) == pytest.approx(before, abs=1e-9)
        for _ in range(100):  # outlines follow the cameras after the counts
            gap = await gap_px(page, border, LEFT)
            if abs(gap - off_px) < 0.01:
                break
            await page.wait_for_timeout(100)
        assert gap == pytest.approx(off_px, abs=0.01)


async def test_a_late_camera_is_named_and_moved_in_time(browser, tmp_path):
    folder = tmp_path / "session"
    session = tracked_copy(folder, late)
    border = silhouette_px(session, FRONT, FRAME)
    async with started(folder) as program, visited(browser, program.address) as page:
        await checked(page)
        said = await page.locator(".calibration-cameras tr.is-off").inner_text()
        assert said.startswith("FRONT")
        assert "time" in said
        row = (await state_of(page))["calibration"]["cameras"][FRONT]
        assert row["time_ms"] == pytest.approx(40, abs=6)
        gaps = [await gap_px(page, border, FRONT)]
        await previewed(page)
        gaps.append(await gap_px(page, border, FRONT, "preview"))
        await page.get_by_role("button", name="Apply", exact=True).last.click()
        await shows(page, "quadrille.state.calibration.outdated[0].join() === '0,48'", 30)
        (clock,) = [c.clock for c in load_session(folder).cameras if c.clock.ahead_frames]
        assert clock.ahead_frames == pytest.approx(1, abs=0.15)
        await tracked_again(page)
        gaps.append(await gap_px(page, border, FRONT))
        assert max(gaps[1:]) < 0.95 * gaps[0]
        await undone(page, (await state_of(page))["state"]["undo"])
        await undone(page, "calibration of FRONT corrected")
        assert not any(c.clock.ahead_frames for c in load_session(folder).cameras)


async def test_a_late_camera_is_estimated_taken_nudged_while_playing_and_given_back(browser, tmp_path):
    folder = tmp_path / "session"
    tracked_copy(folder, late)
    frames = "quadrille.state.clocks.cameras.map((c) => c.offset_frames).join()"
    async with started(folder) as program, visited(browser, program.address) as page:
        await page.evaluate(SECTION.replace("'calibration'", "'clocks'"))
        await reloaded(page, "window.quadrille?.state.overlay", 60)
        section = page.locator("[data-section=clocks]")
        await section.get_by_role("button", name="Fast moment").click()
        await shows(page, "quadrille.state.clocks.moment?.frame === quadrille.state.shown.frame", 30)
        await section.get_by_role("button", name="Estimate").click()
        await shows(page, "quadrille.state.clocks.cameras[0].found", 120)
        await section.get_by_role("button", name="Take").click()
        await shows(page, f"Math.abs({frames.replace('.join()', '[0]')}) < 0.15", 20)
        await undone(page, "clock of FRONT by motion")
        await page.locator("#loop").click()
        await page.locator("#play").click()
        for name in ("− frame", "+ ms", "+ ms"):
            await section.get_by_role("button", name=name, exact=True).click()
        await shows(page, f"{frames} === '0.05,0,0,0'", 20)
        assert await page.evaluate("quadrille.state.playing")
        await page.locator("#play").click()
        await undone(page, "clock of FRONT")
        await shows(page, f"{frames} === '1,0,0,0'", 20)
        assert load_session(folder).cameras[FRONT].offset == 1
