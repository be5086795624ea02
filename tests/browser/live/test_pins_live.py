"""Pins on the bundled sample, by mouse and keys: lines, triangulation against the true joints, Fit, undo, removal."""

import shutil

import numpy as np
import pytest
import pytest_asyncio
from page_driver import handle_of, shows, state_of, to_client
from program import SAMPLE, started, visited
from stored_motions import store_poses

from tracker.evaluation.references import read_joints
from tracker.formats.pose_csv import read_pose_table
from tracker.session.session import load_session

FRAME = 0
FRONT, RIGHT, BACK, LEFT = range(4)
PINS = "quadrille.state.overlay.pins"
MEETING = "quadrille.state.overlay.triangulation"


class Truth:
    """Where each view truly shows a joint, undistorted px; the body that is posed has other bones."""

    def __init__(self, session):
        joints = read_joints(SAMPLE / "truth.trc", session.fps)
        self.places = dict(zip(joints.names, joints.points[FRAME], strict=True))
        self.cameras = [c.camera.pinhole for c in session.cameras]

    def px(self, joint, camera):
        return self.cameras[camera].project(self.places[joint])


@pytest_asyncio.fixture(loop_scope="session", scope="module")
async def opened(browser, tmp_path_factory):
    """One program for all tests, on a body whose arms are some 10 cm off; gives the page and the truth."""
    folder = shutil.copytree(SAMPLE, tmp_path_factory.mktemp("pins") / "session")
    session = load_session(folder)
    model = session.people[0].model
    values = read_pose_table(folder / "truth.csv").values[FRAME].copy()
    for name in ("left_shoulder.abduction", "right_shoulder.elevation"):
        values[model.value_names.index(name)] += 0.2
    store_poses(session, {FRAME: model.clip(values)}, label="place", keyframe=True)
    async with started(folder) as program, visited(browser, program.address) as page:
        yield page, Truth(session)


@pytest_asyncio.fixture(loop_scope="session")
async def pinned(opened):
    """The page without pins and with the left wrist selected; what a test does is taken back after it."""
    page, truth = opened
    before = (await state_of(page))["state"]["undo"]
    await page.mouse.click(*await to_client(page, FRONT, *await handle_of(page, FRONT, "left_wrist")))
    await shows(page, "quadrille.state.state.point === 'left_wrist'", 30)
    yield page, truth
    await page.keyboard.press("Escape")
    while (await state_of(page))["state"]["undo"] != before:
        now = (await state_of(page))["state"]["undo"]
        await page.keyboard.press("Control+z")
        await shows(page, f"quadrille.state.state.undo !== {now!r}", 30)
    await shows(page, f"{PINS}.length === 0 && !quadrille.state.pinning", 30)


async def pin(page, place, camera, count):
    """Click where a pin is to be, and wait until the program has it; px of the view."""
    await page.mouse.click(*await to_client(page, camera, *place))
    await shows(page, f"{PINS}.length === {count} && !quadrille.state.heldPin", 30)


def distance_from_line(at, segment):
    start, end = np.reshape(segment, (2, 2))
    across = np.array([start[1] - end[1], end[0] - start[0]]) / np.linalg.norm(end - start)
    return abs((at - start) @ across)


async def lines(page):
    """Segments of the epipolar lines by view."""
    found = await page.evaluate("""(() => {
      const { paths, segments } = quadrille.state.overlay;
      return paths.filter(({ kind }) => kind === "epipolar")
        .map(({ camera, first }) => [camera, [...segments.slice(4 * first, 4 * first + 4)]]);
    })()""")
    return {camera: [s for c, s in found if c == camera] for camera, _ in found}


async def test_a_pin_is_a_line_in_the_others_and_two_meet_in_the_joint(pinned):
    page, truth = pinned
    await page.keyboard.press("x")
    await shows(page, "quadrille.state.pinning && !document.querySelector('#pin-hint').hidden")
    cursor = "getComputedStyle(document.querySelector('.pane-overlay')).cursor"
    assert await page.evaluate(cursor) == "crosshair"
    await pin(page, truth.px("left_wrist", FRONT), FRONT, 1)
    found = await lines(page)
    assert set(found) == {RIGHT, BACK, LEFT}
    for camera, (segment,) in found.items():
        assert distance_from_line(truth.px("left_wrist", camera), segment) < 0.5
    meeting = await page.evaluate(MEETING)
    assert (meeting["pins"], meeting["error_px"]) == (1, None)
    assert "another view" in meeting["why"]
    assert await page.locator("#pin-figures").inner_text() == "1 pin"

    # The second one 3 px beside its line: the point lies between, and the error is shown.
    (line,) = found[RIGHT]
    start, end = np.reshape(line, (2, 2))
    across = np.array([start[1] - end[1], end[0] - start[0]]) / np.linalg.norm(end - start)
    await pin(page, truth.px("left_wrist", RIGHT) + 3 * across, RIGHT, 2)
    meeting = await page.evaluate(MEETING)
    errors = {m["camera"]: m["error_px"] for m in meeting["marks"]}
    assert {c for c, e in errors.items() if e is not None} == {FRONT, RIGHT}
    assert np.hypot(errors[FRONT], errors[RIGHT]) == pytest.approx(3 / np.sqrt(2), abs=0.4)
    for mark in meeting["marks"]:
        assert np.hypot(*(truth.px("left_wrist", mark["camera"]) - (mark["u"], mark["v"]))) < 4
    assert await page.locator("#pin-figures").inner_text() == f"2 pins, {meeting['error_px']:.1f} px"
    assert {c: len(s) for c, s in (await lines(page)).items()} == {FRONT: 1, RIGHT: 1, BACK: 2, LEFT: 2}

    # Not yet fitted: the model is off, and each pin says how far.
    model = await page.evaluate(f"{PINS}.map((p) => Math.hypot(p.model_u - p.u, p.model_v - p.v))")
    assert max(model) > 5
    await page.keyboard.press("Escape")
    await shows(page, "!quadrille.state.pinning")


async def test_fit_brings_the_joints_onto_their_pins_and_history_takes_it_back(pinned):
    page, truth = pinned
    count = 0
    for joint in ("left_wrist", "right_wrist"):
        await page.mouse.click(*await to_client(page, FRONT, *await handle_of(page, FRONT, joint)))
        await shows(page, f"quadrille.state.state.point === '{joint}'", 30)
        await page.keyboard.down("Control")
        for camera in (FRONT, RIGHT):
            count += 1
            await pin(page, truth.px(joint, camera), camera, count)
        await page.keyboard.up("Control")
    off = f"Math.max(...{PINS}.map((p) => Math.hypot(p.model_u - p.u, p.model_v - p.v)))"
    before = await page.evaluate(off)
    assert before > 8
    await page.keyboard.press("g")
    await shows(page, "quadrille.state.state.undo === 'fit to pins and edges, frame 0'", 60)
    await shows(page, f"{off} < 4", 10)
    assert (await state_of(page))["state"]["source"] == "pinned"
    for joint in ("left_wrist", "right_wrist"):  # in a view without pins too
        assert np.hypot(*(truth.px(joint, BACK) - await handle_of(page, BACK, joint))) < 8
    await page.keyboard.press("Control+z")
    await shows(page, f"Math.abs({off} - {before}) < 0.01 && {PINS}.length === 4", 30)
    await page.keyboard.press("Control+z")
    await shows(page, f"{PINS}.length === 3", 30)
    await page.keyboard.press("Control+Shift+Z")
    await shows(page, f"{PINS}.length === 4", 30)


async def test_a_pin_is_dragged_by_its_head_and_the_body_follows(pinned):
    page, _ = pinned
    u, v = await handle_of(page, FRONT, "left_wrist")
    await page.keyboard.down("Control")
    await pin(page, (u, v), FRONT, 1)
    await page.keyboard.up("Control")
    x, y = await to_client(page, FRONT, u, v)
    await page.mouse.move(x, y - 15)
    await shows(page, "quadrille.state.pinHover?.point === 'left_wrist' && !quadrille.state.hover")
    await page.mouse.down()
    await page.mouse.move(x + 12, y - 25, steps=3)
    await shows(page, "quadrille.state.heldPin && quadrille.state.dragging")
    scale = (await state_of(page))["views"][FRONT]["scale"]
    target = np.array([u + 12 / scale, v - 10 / scale])
    await page.mouse.up()
    await shows(page, "quadrille.state.state.undo === 'move pin left wrist in FRONT, frame 0'", 60)
    await shows(page, "!quadrille.state.heldPin")
    assert [[p["u"], p["v"]] for p in await page.evaluate(PINS)] == [pytest.approx(target, abs=1.0)]
    assert np.hypot(*(target - await handle_of(page, FRONT, "left_wrist"))) < 0.5 * np.hypot(*(target - (u, v)))


async def test_escape_puts_a_dragged_pin_and_the_body_back(pinned):
    page, _ = pinned
    u, v = await handle_of(page, FRONT, "left_wrist")
    x, y = await to_client(page, FRONT, u, v)
    await page.keyboard.press("x")
    await page.mouse.move(x, y)
    await page.mouse.down()
    await page.mouse.move(x + 20, y, steps=3)
    await shows(page, f"{PINS}.length === 1", 30)
    await page.keyboard.press("Escape")
    await shows(page, f"{PINS}.length === 0 && !quadrille.state.dragging", 30)
    await page.mouse.up()
    assert await handle_of(page, FRONT, "left_wrist") == pytest.approx((u, v), abs=0.01)
    assert (await state_of(page))["pinning"]  # only the drag is over


async def test_pins_are_removed_by_right_click_by_key_and_all(pinned):
    page, _ = pinned
    places = [(c, await handle_of(page, c, "left_wrist")) for c in (FRONT, RIGHT, BACK)]
    await page.keyboard.press("x")
    for count, (camera, at) in enumerate(places, 1):
        await pin(page, at, camera, count)
    await page.keyboard.press("x")
    x, y = await to_client(page, FRONT, *places[0][1])
    await page.mouse.move(x, y - 15)
    await page.mouse.click(x, y - 15, button="right")
    await shows(page, f"{PINS}.map((p) => p.camera).join() === '1,2'", 30)
    x, y = await to_client(page, RIGHT, *places[1][1])
    await page.mouse.move(x, y - 15)
    await shows(page, "quadrille.state.pinHover?.camera === 1")
    await page.keyboard.press("Delete")
    await shows(page, f"{PINS}.map((p) => p.camera).join() === '2'", 30)
    await page.locator("#pin-clear").click()
    await shows(page, f"{PINS}.length === 0 && document.querySelector('#pin-clear').disabled", 30)
    await page.keyboard.press("Control+z")
    await shows(page, f"{PINS}.length === 1", 30)
    await page.mouse.move(640, 5)
    await page.keyboard.press("Delete")  # nothing under the pointer: the pins of the selected joint
    await shows(page, f"{PINS}.length === 0", 30)


async def test_a_pin_outside_of_the_image_is_refused_and_panes_keep_their_size(pinned):
    page, _ = pinned
    await page.mouse.move(0, 0)
    await page.keyboard.press("0")
    await shows(page, f"quadrille.state.views[{FRONT}].zoom === 1")
    await page.keyboard.press("x")
    box = await page.locator(".pane").first.bounding_box()
    await page.mouse.dblclick(box["x"] + 5, box["y"] + 150)  # beside the image
    await shows(
        page, "document.querySelector('#advice-text')?.textContent.includes('within the 640x480 px of FRONT')", 30
    )
    assert await page.evaluate(f"{PINS}.length") == 0
    assert (await state_of(page))["filled"] is None


async def test_pins_are_there_after_a_reload_in_another_tab(pinned, browser):
    page, truth = pinned
    await page.keyboard.press("x")
    await pin(page, truth.px("left_wrist", FRONT), FRONT, 1)
    await page.keyboard.press("x")
    context = await browser.new_context(viewport={"width": 1280, "height": 720})
    other = await context.new_page()
    await other.goto(page.url, timeout=60_000)
    await shows(other, "window.quadrille?.state.overlay?.pins.length === 1", 60)
    await context.close()
