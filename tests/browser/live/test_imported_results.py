"""Results of another program: imported by the form, judged, mended by the mouse, and sent back in their own files."""

import asyncio
import io
import shutil
import zipfile

import numpy as np
import pytest
import pytest_asyncio
from observed_people import BODY_25, write_openpose
from page_driver import command, handle_of, shows, to_client
from program import SAMPLE, started, visited

from tracker.evaluation.references import read_joints
from tracker.formats.keypoints.detections import read_openpose
from tracker.session.session import load_session

pytestmark = pytest.mark.slow

N_FRAMES, WRONG = 8, 3
WRIST = BODY_25.points.index("LWrist")
OFF_M = np.array([0.0, 0.0, 0.25])
"""How far the detector puts the wrist from its place on one frame: out of the arm."""
VIEWS = "FRONT", "RIGHT"
"""The views in which the wrist is dragged to its place."""


@pytest.fixture(scope="module")
def session(tmp_path_factory):
    """The first frames of the sample."""
    folder = shutil.copytree(SAMPLE, tmp_path_factory.mktemp("imported") / "session")
    toml = folder / "session.toml"
    toml.write_text(toml.read_text("utf-8").replace("n_frames = 50", f"n_frames = {N_FRAMES}"), "utf-8")
    return load_session(folder)


@pytest.fixture(scope="module")
def truth(session):
    """True places of the points that the reference has, (n_frames, n_points, 3), metres; NaN for the others."""
    found = read_joints(SAMPLE / "truth.trc", session.fps)
    points = np.full((N_FRAMES, len(BODY_25.points), 3), np.nan)
    for i, joints in enumerate(BODY_25.counterparts(BODY_25.points).values()):
        if joints and set(joints) <= set(found.names):
            points[:, i] = np.mean([found.points[:N_FRAMES, found.names.index(j)] for j in joints], axis=0)
    return points


@pytest.fixture(scope="module")
def files(session, truth, tmp_path_factory):
    """OpenPose's files of these points; the wrist is off on one frame."""
    wrong = truth.copy()
    wrong[WRONG, WRIST] += OFF_M
    is_known = np.isfinite(wrong).all(axis=-1)
    seen = np.full((N_FRAMES, len(session.cameras), 1, len(BODY_25.points), 3), np.nan)
    for v, source in enumerate(session.cameras):
        seen[:, v, 0, :, 2] = np.where(is_known, 0.9, np.nan)
        seen[:, v, 0, :, :2][is_known] = source.camera.project(wrong[is_known])
    return write_openpose(tmp_path_factory.mktemp("detector") / "net", session.camera_names, seen)


@pytest_asyncio.fixture(loop_scope="session", scope="module")
async def page(browser, session, tmp_path_factory):
    with pytest.MonkeyPatch.context() as monkeypatch:
        monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path_factory.mktemp("state")))
        # A page names files only where the program asks for its token.
        async with started(session.folder, has_token=True) as program, visited(browser, program.address) as page:
            yield page


async def imported(page, files):
    await command(page, "Observations of other programs")
    section = page.locator("[data-section=observations]")
    await section.get_by_text("Import…").click()
    await page.fill("#import-paths", str(files))
    await page.fill("#import-name", "net")
    await section.get_by_role("button", name="Check", exact=True).click()
    await section.get_by_text("The views show these points. Nothing was stored yet.").wait_for()
    await section.get_by_role("button", name="Import", exact=True).click()
    await shows(page, "quadrille.state.observations.shown === 'net' && !quadrille.state.observations.is_previewed")
    return section


async def worked(page, section, button):
    await section.get_by_role("button", name=button, exact=True).click()
    await shows(page, "quadrille.state.observations.running")
    await shows(page, "!quadrille.state.observations.running", 180)
    assert not await page.evaluate("quadrille.state.observations.failed")


async def drag_to(page, view, point_px):
    """Drag the wrist to a place in a view, undistorted px, and wait until that is stored."""
    start = await to_client(page, view, *await handle_of(page, view, "left_wrist"))
    end = await to_client(page, view, *point_px)
    await page.mouse.move(*start)
    await page.mouse.down()
    for share in np.linspace(0.1, 1, 10):
        await page.mouse.move(*(np.array(start) + share * (np.array(end) - start)))
    await page.mouse.up()
    await shows(page, "quadrille.state.state.undo?.startsWith('drag left wrist') && !quadrille.state.dragging")
    before = None
    while before != (now := await page.evaluate("JSON.stringify(quadrille.state.overlay.handles)")):
        before = now
        await asyncio.sleep(0.3)


async def sent_back(page):
    """Export the set as it came; return the content of the archive."""
    await page.click("#show-export")
    await shows(page, "document.querySelector('#export-panel').matches(':popover-open')")
    await page.select_option("#export-format", "like/net")
    async with page.expect_download() as download:
        await page.click("#export-start")
    path = await (await download.value).path()
    archive = zipfile.ZipFile(io.BytesIO(path.read_bytes()))
    return {name.removeprefix("net/"): archive.read(name) for name in archive.namelist()}


async def test_the_worst_is_mended_and_the_files_differ_there_alone(page, session, truth, files, tmp_path):
    section = await imported(page, files)
    await worked(page, section, "Judge")
    worst = await page.evaluate("quadrille.state.observations.worst[0]")
    assert (worst["frame"], worst["limb"], worst["joint"]) == (WRONG, "left arm", "left_wrist")
    await worked(page, section, "Take as poses")
    came = {p.relative_to(files).as_posix(): p.read_bytes() for p in files.rglob("*.json")}
    assert await sent_back(page) == came
    await page.keyboard.press("Escape")
    await command(page, "Next imported limb that is off")
    await shows(page, f"quadrille.state.overlay.frame === {WRONG} && quadrille.state.state.point === 'left_wrist'")
    names = session.camera_names
    for name in VIEWS:
        view = names.index(name)
        await drag_to(page, view, session.cameras[view].camera.pinhole.project(truth[WRONG, WRIST]))
    back = await sent_back(page)
    assert back.keys() == came.keys()
    changed = {name for name in came if back[name] != came[name]}
    assert changed == {f"{c}/{c}_{WRONG:012d}_keypoints.json" for c in names}
    for source in session.cameras:
        name = f"{source.camera.name}/{source.camera.name}_{WRONG:012d}_keypoints.json"
        (tmp_path / "mended.json").write_bytes(back[name])
        read = [read_openpose(path) for path in (files / name, tmp_path / "mended.json")]
        before, after = (people[0].points for people in read)
        differ = {p for p, a, b in zip(BODY_25.points, before, after, strict=True) if not np.array_equal(a, b, True)}
        assert "LWrist" in differ
        assert differ <= {"LWrist", "LElbow", "LShoulder"}  # the arm of the drag
        true_px = source.camera.project(truth[WRONG, WRIST])
        off = [np.linalg.norm(one[WRIST, :2] - true_px) for one in (before, after)]
        assert off[1] < 0.2 * off[0], off
