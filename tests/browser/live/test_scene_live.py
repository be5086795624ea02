"""The 3-D view of the real program: through a camera's eyes, and the floor.

The footage shows what the cameras would see of the body as it stands before anybody has placed it, painted white from
the camera's own projection. So the picture of the 3-D view without bodies says where the body belongs, and the picture
with bodies where it is drawn; neither knows how the view was set up.
"""

import asyncio

import cv2
import numpy as np
import pytest
import pytest_asyncio
from page_driver import command, drag_mouse, shows, state_of, to_client
from program import started
from stored_motions import store_poses

from tracker.body.model import PosedBody
from tracker.estimation.posing.default_pose import default_pose
from tracker.evidence.contours.occluding_contours import part_poses
from tracker.footage.camera_source import CameraSource
from tracker.formats.model_toml import load_model
from tracker.geometry import rigid
from tracker.geometry.cameras import Camera, viewed_point
from tracker.session.session import Person, create_session, load_session

pytestmark = pytest.mark.slow

SIZE = (640, 480)
PAINTED = 4
"""The silhouettes are painted so many times as large, then brought to size: their edges are where they belong."""


def camera(name, azimuth, roll, K, distortion):
    """A camera 5 m from the origin, turned to look near it."""
    R = rigid.so3_exp(np.array([0, 0, azimuth])) @ np.array([[0.0, 0, -1], [1, 0, 0], [0, -1, 0]])
    R = R @ rigid.so3_exp(np.array([0.0, 0.0, roll]))
    center = rigid.so3_exp(np.array([0, 0, azimuth])) @ np.array([5.0, 0.1, 0.4])
    return Camera(name, SIZE, np.array(K), np.array(distortion), rigid.transform(R, center))


CAMERAS = (
    camera("MIDDLE", 0.2, 0.0, [[680.0, 0, 319.5], [0, 680, 239.5], [0, 0, 1]], []),
    camera("OFF", 1.6, 0.15, [[690.0, 0, 236.0], [0, 650, 271], [0, 0, 1]], [-0.15, 0.05, 0.002, -0.003]),
)


N_FRAMES = 6
ALL_PIXELS = """
if (location.pathname.endsWith("/viser/") && !location.search.includes("fixedDpr")) {
  history.replaceState(null, "", `?fixedDpr=1&${location.search.slice(1)}`);
}
"""
"""JavaScript: viser draws every pixel; on a slow machine it would draw fewer in some pictures and enlarge them."""


def seen(view, model, values):
    """What a camera sees of a body, white on black, as filmed."""
    w, h = SIZE
    painted = np.zeros((h * PAINTED, w * PAINTED), np.uint8)
    for T, shape, center in zip(part_poses([PosedBody(model, values)]), model.shapes, model.centers_part, strict=True):
        mesh = shape.triangles(64, 96)
        px = view.project(rigid.apply(T, mesh.vertices + center))
        corners = np.round(((px + 0.5) * PAINTED - 0.5) * 16).astype(np.int32)
        for face in corners[mesh.faces]:
            cv2.fillConvexPoly(painted, face, 255, shift=4)
    return np.repeat(cv2.resize(painted, SIZE, interpolation=cv2.INTER_AREA)[..., None], 3, axis=-1)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A session in which the body stands still on frame 0 and has walked on a hand's breadth by each of the others."""
    home = tmp_path_factory.mktemp("scene")
    model = load_model("gavrila22")
    values = default_pose(model, CAMERAS)
    sources = []
    for view in CAMERAS:
        (home / view.name).mkdir()
        picture = seen(view, model, values)
        for frame in range(N_FRAMES):
            # The others are the same picture darker: an image that stays behind shows.
            assert cv2.imwrite(str(home / view.name / f"{frame:06d}.png"), picture if frame == 0 else picture // 2)
        sources.append(CameraSource(view, home / view.name))
    people = [Person("person", model, "#203080")]  # its light left limbs differ from white too
    session = create_session(home / "session", cameras=sources, people=people, fps=25.0)
    poses = {frame: values + np.eye(len(values))[1] * 0.1 * frame for frame in range(N_FRAMES)}
    store_poses(session, poses, source="tracked", label="walk")
    return home / "session"


@pytest_asyncio.fixture(loop_scope="session", scope="module")
async def live(browser, folder):
    async with started(folder) as program:
        context = await browser.new_context(viewport={"width": 1280, "height": 720}, color_scheme="dark")
        await context.add_init_script(ALL_PIXELS)
        page = await context.new_page()
        await page.goto(program.address, timeout=120_000)
        await shows(page, "window.quadrille?.state.overlay && quadrille.state.state.cost_px !== null", 120)
        await switch(page, "Floor grid")
        await switch(page, "Gizmos")
        yield page
        await context.close()


async def switch(page, name):
    """Tick a box of the inspector, or untick it; the inspector stays closed."""
    box = page.locator(".row", has=page.get_by_text(name, exact=True)).locator("input")
    await box.dispatch_event("click")


async def picture(page):
    """What the 3-D view shows, (H, W, 3), BGR."""
    data = await page.locator("#scene").screenshot()
    return cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)


async def rested(page, condition=lambda _: True):
    """The picture once it changes no more and a condition holds."""
    before = await picture(page)
    async with asyncio.timeout(60):
        while True:
            await asyncio.sleep(0.4)
            now = await picture(page)
            if now.shape == before.shape and np.abs(now.astype(int) - before).max() < 3 and condition(now):
                return now
            before = now


async def snap(page, index, through=True):
    """Look through a camera, or no longer."""
    async with asyncio.timeout(30):
        while (await state_of(page))["active"] != index:  # the panes may just be finding their places
            pane = await page.locator(".pane").nth(index).bounding_box()
            await page.mouse.move(pane["x"] + 20, pane["y"] + pane["height"] / 2)
            await asyncio.sleep(0.1)
            await page.mouse.move(pane["x"] + 24, pane["y"] + pane["height"] / 2)
    await command(page, "3-D view: look through the active camera (toggle)")
    await shows(page, f"quadrille.state.state.snapped === {index if through else 'null'}", 30)


def outline_of(mask):
    return np.argwhere(mask & ~cv2.erode(mask.astype(np.uint8), np.ones((3, 3))).astype(bool))


def edge_distances(a, b):
    """Distances of the outline of one silhouette from that of another, px."""
    to_b = np.ones(b.shape, np.uint8)
    to_b[tuple(outline_of(b).T)] = 0
    return cv2.distanceTransform(to_b, cv2.DIST_L2, 5)[tuple(outline_of(a).T)]


def shift_px(a, b):
    """Distance by which one silhouette is shifted against another, px; one may be wider than the other all round.

    Their centroids would not do: the border of light limbs is found farther inside than that of the dark trunk. Thinner
    legs alone move the centroid by most of a pixel.
    """
    outside, inside = (cv2.distanceTransform(m.astype(np.uint8), cv2.DIST_L2, 5) for m in (~a, a))
    signed = outside - inside
    at = tuple(outline_of(b).T)
    normals = np.stack(np.gradient(cv2.GaussianBlur(signed, (0, 0), 1.0)), axis=-1)[at]
    (rows, columns, _), *_ = np.linalg.lstsq(np.column_stack([normals, np.ones(len(normals))]), signed[at])
    return np.hypot(rows, columns)


def is_white(image):
    return image.min(axis=-1) > 200


@pytest.mark.parametrize(
    ("index", "sizes"), [(1, ((1280, 720), (1600, 640), (1100, 900))), (0, ((1280, 720),))], ids=["off", "middle"]
)
async def test_bodies_lie_on_their_images_at_any_size_of_the_canvas(live, index, sizes):
    await snap(live, index)
    found = []
    for width, height in sizes:
        await live.set_viewport_size({"width": width, "height": height})
        await switch(live, "Bodies")
        filmed = await rested(live, lambda image: is_white(image).sum() > 600)
        await switch(live, "Bodies")
        drawn = await rested(live, lambda image: is_white(image).sum() < 400)
        belongs = cv2.cvtColor(filmed, cv2.COLOR_BGR2GRAY) > 127
        is_drawn = np.abs(drawn.astype(int) - filmed).max(axis=-1) > 40
        distances = np.concatenate([edge_distances(belongs, is_drawn), edge_distances(is_drawn, belongs)])
        found.append((shift_px(belongs, is_drawn), np.mean(distances), np.percentile(distances, 95)))
    print(*(f"off by {m:.2f} px, outlines {d:.2f} px apart, 95% within {p:.2f};" for m, d, p in found))
    offsets, means, nearly_all = zip(*found, strict=True)
    assert max(offsets) < 0.5
    assert max(means) < 0.6  # outlines of whole pixels
    assert max(nearly_all) <= 1.5
    await live.set_viewport_size({"width": 1280, "height": 720})
    await snap(live, index, through=False)


async def test_a_click_on_a_part_works_on_its_joint(live):
    await snap(live, 0)
    await switch(live, "Bodies")
    filmed = await rested(live, lambda image: is_white(image).sum() > 600)
    await switch(live, "Bodies")
    await rested(live, lambda image: is_white(image).sum() < 400)
    scene = await live.locator("#scene").bounding_box()
    rows, columns = np.nonzero(is_white(filmed))
    in_head = rows < rows.min() + 12
    model = load_model("gavrila22")
    for part, chosen in (("head", in_head), ("torso", slice(None))):
        x, y = columns[chosen].mean(), rows[chosen].mean()
        await live.mouse.click(scene["x"] + x, scene["y"] + y - 6 * (part == "torso"))
        await shows(live, f"quadrille.state.state.point === '{model.point_names[model.part_index[part]]}'", 30)
    await snap(live, 0, through=False)


async def test_the_image_follows_the_frame_and_a_turn_leaves_the_camera(live):
    await snap(live, 0)
    await switch(live, "Bodies")
    await rested(live, lambda image: is_white(image).sum() > 600)
    await live.keyboard.press(".")
    await rested(live, lambda image: 100 < np.percentile(image, 99.9) < 150)
    scene = await live.locator("#scene").bounding_box()
    await drag_mouse(live, (scene["x"] + 60, scene["y"] + 300), (scene["x"] + 110, scene["y"] + 290), steps=4)
    await shows(live, "quadrille.state.state.snapped === null", 30)
    assert await live.locator(".pane.is-snapped").count() == 0
    await live.keyboard.press(",")
    await rested(live, lambda image: not is_white(image).any())


async def test_the_floor_from_three_points_lies_where_it_was_clicked(live, folder):
    up = rigid.so3_exp(np.array([0.04, -0.03, 0.0]))[:, 2]
    height_m = float(up @ viewed_point(CAMERAS)) - 0.9
    await command(live, "Set the floor from three clicked points (toggle)")
    await shows(live, "quadrille.state.state.floor !== null", 30)
    for number, (x, y) in enumerate(((-0.5, -0.5), (0.6, -0.4), (0.0, 0.6)), 1):
        place = np.array([x, y, (height_m - up[0] * x - up[1] * y) / up[2]])
        for index, view in enumerate(CAMERAS):
            await live.mouse.click(*await to_client(live, index, *view.pinhole.project(place)))
            await shows(live, f"quadrille.state.state.floor.views === {index + 1}", 30)
        if number == 1:
            assert "2 views agree" in await live.locator("#floor-text").inner_text()
        if number < 3:
            await live.keyboard.press("Enter")
            await shows(live, f"quadrille.state.state.floor.point === {number + 1}", 30)
    await shows(live, "quadrille.state.overlay.paths.some((p) => p.kind === 'floor' && p.count > 100)", 30)
    assert (await state_of(live))["state"]["undo"].startswith("walk"), "no joint was dragged by a click"
    await live.get_by_role("button", name="Apply").click()
    await shows(live, "quadrille.state.state.floor === null", 30)
    floor = load_session(folder).floor
    assert np.degrees(np.arccos(min(1.0, floor.normal @ up))) < 0.3
    assert floor.offset_m == pytest.approx(height_m, abs=0.005)
