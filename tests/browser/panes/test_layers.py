"""Layers, image tones and the grid against `fake_endpoint`: what is on the canvases, what the program is asked for."""

import asyncio
import itertools

import pytest
from fake_endpoint import COLORS, HIDDEN_LINE, FakeEndpoint
from page_driver import command, handle_of, reloaded, shows, state_of, to_client, toggle_layer, turn_wheel, until

ROW = """([camera, from, to, v]) => {
  const canvas = document.querySelectorAll(".pane-overlay")[camera];
  const box = canvas.getBoundingClientRect();
  const context = canvas.getContext("2d");
  return Array.from({ length: to - from }, (_, k) => {
    const { x, y } = quadrille.toClient(camera, from + k, v);
    const at = [(x - box.left) * devicePixelRatio, (y - box.top) * devicePixelRatio].map(Math.floor);
    return [...context.getImageData(...at, 1, 1).data].slice(0, 3);
  });
}"""
"""JavaScript: the colours along a row of undistorted pixels of a camera; the page draws all on one canvas here."""
PLACE = (0, 60, 61, 330)
"""A pixel of the first camera that has nothing but the room in it."""
PICTURES = {"silhouette": (74, 224, 140), "distance": (252, 255, 164), "parts": (250, 30, 30)}
"""The even colours that the endpoint gives the layers."""


async def color_at(page, place=PLACE):
    ((color),) = await page.evaluate(ROW, list(place))
    return color


async def set_slider(page, selector, value):
    await page.locator(selector).fill(str(value))


@pytest.mark.slow
async def test_a_picture_shows_vanishes_and_is_as_strong_as_its_slider_says(page):
    plain = await color_at(page)
    await page.keyboard.press("a")
    for layer, color in PICTURES.items():
        await page.locator(f"[data-layer={layer}]").check()
        await shows(page, f"'{layer} 0' in quadrille.state.shown.pictures")
        for percent in (100, 40):
            await set_slider(page, f"[data-opacity={layer}]", percent)
            await shows(page, f"quadrille.state.layers.opacity.{layer} === {percent / 100}")
            mixed = [a + percent / 100 * (b - a) for a, b in zip(plain, color, strict=True)]
            assert await color_at(page) == pytest.approx(mixed, abs=6)
        await page.locator(f"[data-layer={layer}]").uncheck()
        await shows(page, f"!('{layer} 0' in quadrille.state.shown.pictures)")
        assert await color_at(page) == plain


@pytest.mark.slow
async def test_the_image_fades_into_black_in_either_theme(page):
    plain = await color_at(page)
    await page.emulate_media(color_scheme="light")
    await page.keyboard.press("a")
    await set_slider(page, "[data-opacity=image]", 50)
    await shows(page, "quadrille.state.layers.opacity.image === 0.5")
    assert await color_at(page) == pytest.approx([c / 2 for c in plain], abs=3)
    await toggle_layer(page, "image")
    await shows(page, "!quadrille.state.layers.shown.image")
    assert await color_at(page) == [0, 0, 0]


@pytest.mark.slow
async def test_without_any_pictures_frames_are_shown_all_the_same(page):
    await toggle_layer(page, "image")
    await shows(page, "!quadrille.state.layers.shown.image")
    await page.keyboard.press(".")
    await shows(page, "quadrille.state.shown.frame === 13 && quadrille.state.overlay.frame === 13")
    await reloaded(page, "window.quadrille?.state.overlay?.frame === 13 && !quadrille.state.layers.shown.image")
    await toggle_layer(page, "image")
    await shows(page, "'image 0' in quadrille.state.shown.pictures")


async def test_hidden_contours_are_dashed(page):
    await toggle_layer(page, "hidden")
    await shows(page, "quadrille.state.overlay.paths.some((path) => path.kind === 'hidden')")
    u, v = HIDDEN_LINE[:, 0], HIDDEN_LINE[0, 1]
    row = await page.evaluate(ROW, [0, int(u[2]), int(u[-2]), int(v)])
    red, blue = int(COLORS[0][1:3], 16), int(COLORS[0][5:7], 16)
    is_line = [(r - b) > 0.4 * (red - blue) for r, _, b in row]
    changes = sum(a != b for a, b in itertools.pairwise(is_line))
    assert changes > 15
    assert 0.25 < sum(is_line) / len(is_line) < 0.75


async def test_lines_fade_with_their_layer(page, endpoint):
    segment = endpoint.outline(0, 0, 0.0)[8]
    place = [0, round(segment[0]), round(segment[0]) + 1, round(segment[1])]
    full = await color_at(page, place)
    await page.keyboard.press("a")
    await set_slider(page, "[data-opacity=contours]", 20)
    await shows(page, "quadrille.state.layers.opacity.contours === 0.2")
    faint = await color_at(page, place)
    assert faint[0] < full[0] - 30


@pytest.mark.slow
async def test_layers_are_remembered_and_reset(page, endpoint):
    await page.keyboard.press("a")
    await page.locator("[data-layer=silhouette]").check()
    await set_slider(page, "[data-opacity=silhouette]", 80)
    await page.get_by_text("by part", exact=True).click()
    await page.locator("[data-layer=joints]").uncheck()
    await until(lambda: endpoint.views[-1]["by_part"] and "joints" not in endpoint.views[-1]["layers"])
    await reloaded(page, "window.quadrille?.state.shown.pictures['silhouette 0']")
    layers = (await state_of(page))["layers"]
    assert layers["opacity"]["silhouette"] == 0.8
    assert layers["colors"] == "part"
    assert not layers["shown"]["joints"]
    await page.keyboard.press("a")
    await page.get_by_role("button", name="Reset layers").click()
    await until(
        lambda: (
            endpoint.views[-1]["layers"]
            == ["image", "contours", "joints", "alternatives", "epipolar", "imported", "axes"]
        )
    )
    assert (await state_of(page))["layers"]["opacity"]["silhouette"] == 0.45


async def test_the_menu_closes_by_its_key_by_escape_and_by_a_click_elsewhere(page, endpoint):
    menu = page.locator("#layers-menu")
    for close in ("a", "Escape"):
        await page.keyboard.press("a")
        await menu.wait_for()
        await page.keyboard.press(close)
        await menu.wait_for(state="hidden")
    await page.locator("#show-layers").click()
    await menu.wait_for()
    await page.locator("#show-layers").click()
    await menu.wait_for(state="hidden")
    assert not endpoint.received  # Esc stopped nothing


async def test_brightness_belongs_to_one_camera_and_is_remembered(page):
    plain, other = await color_at(page), await color_at(page, (1, *PLACE[1:]))
    pane = await page.locator(".pane").first.bounding_box()
    await page.mouse.move(pane["x"] + 60, pane["y"] + 200)
    await command(page, "Brightness and contrast of a pane")
    await set_slider(page, "[data-tone=brightness]", 30)
    await shows(page, "quadrille.state.imageTones[0].brightness === 30")
    assert await color_at(page) == pytest.approx([c + 0.3 * 255 for c in plain], abs=3)
    assert await color_at(page, (1, *PLACE[1:])) == other
    await set_slider(page, "[data-tone=contrast]", -50)
    await shows(page, "quadrille.state.imageTones[0].contrast === -50")
    assert await color_at(page) == pytest.approx([(c + 127.5) / 2 + 0.3 * 255 for c in plain], abs=3)
    await reloaded(page, "window.quadrille?.state.shown.pictures['image 0'] && quadrille.state.overlay")
    assert (await color_at(page))[0] > plain[0] + 60
    await page.mouse.move(pane["x"] + 60, pane["y"] + 200)
    await command(page, "Brightness and contrast of a pane")
    await page.locator("#image-tone-menu").get_by_role("button", name="Reset").click()
    await shows(page, "quadrille.state.imageTones[0].brightness === 0")
    assert await color_at(page) == plain


@pytest.mark.slow
async def test_gamma_lifts_the_shadows_and_leaves_black_and_white(page):
    curve = await page.evaluate(
        """async () => {
          const { toneCurve } = await import("/static/model/image_tone.js");
          const curve = toneCurve({ brightness: 0, contrast: 0, gamma: 2 });
          return [curve[0], curve[64], curve[255]];
        }"""
    )
    assert curve == [0, 128, 255]


@pytest.mark.slow
async def test_the_corner_tells_how_the_selected_joint_is_seen(page, endpoint):
    assert await page.locator(".pane-joint:visible").count() == 0
    await page.mouse.click(*await to_client(page, 0, *await handle_of(page, 0, "l_wrist")))
    await shows(page, "document.querySelector('.pane-joint').textContent.includes('visible')")
    texts = await page.locator(".pane-joint").all_inner_texts()
    assert [t.split()[-1] for t in texts] == ["visible", "hidden", "visible", "hidden"]
    endpoint.pose[0, "l_wrist"][1] = 9.0
    await endpoint.send_overlay()
    await shows(page, "document.querySelector('.pane-joint').textContent.includes('outside')")


@pytest.mark.parametrize("n_cameras", [3, 16, *(pytest.param(n, marks=pytest.mark.slow) for n in (1, 2, 5, 8))])
class TestGrid:
    @pytest.fixture
    def endpoint(self, n_cameras):
        return FakeEndpoint(n_cameras=n_cameras, sizes=((640, 480), (640, 480), (480, 640), (960, 540)))

    @pytest.mark.slow
    async def test_all_cameras_fit_and_each_fills_the_grid(self, page, endpoint, n_cameras):
        await self.fit(page, endpoint, n_cameras)
        await self.fill(page, endpoint, n_cameras)

    async def fit(self, page, endpoint, n_cameras):
        """Side by side, as large as there is room for, in pictures as fine as they are shown."""
        await page.set_viewport_size({"width": 1280, "height": 720})
        await shows(page, "document.querySelector('#workspace').clientWidth === 1280")
        whole = await page.locator("#panes").bounding_box()
        boxes = [await pane.bounding_box() for pane in await page.locator(".pane:visible").all()]
        assert len(boxes) == n_cameras
        for box in boxes:
            assert box["x"] >= whole["x"] - 0.5
            assert box["x"] + box["width"] <= whole["x"] + whole["width"] + 0.5
            assert box["y"] + box["height"] <= whole["y"] + whole["height"] + 0.5
        for a in boxes:
            for b in boxes:
                apart = a["x"] + a["width"] <= b["x"] or a["y"] + a["height"] <= b["y"]
                assert a is b or apart or b["x"] + b["width"] <= a["x"] or b["y"] + b["height"] <= a["y"]
        sizes = [endpoint.sizes[c % 4] for c in range(n_cameras)]
        shown = [min(b["width"] / w, b["height"] / h) ** 2 * w * h for b, (w, h) in zip(boxes, sizes, strict=True)]
        assert sum(shown) > (0.45 if n_cameras > 2 else 0.3) * whole["width"] * whole["height"]
        views = (await state_of(page))["views"]
        reductions = (await state_of(page))["reductions"]
        await until(lambda: endpoint.views[-1]["reductions"] == reductions)
        for view, reduction in zip(views, reductions, strict=True):
            share = 1 / (reduction * view["scale"])  # of the pixels that are shown
            assert reduction >= 1
            assert 0.95 <= share <= 1.25 or (reduction == 1 and share < 1.06)

    async def fill(self, page, endpoint, n_cameras):
        """The last by its number, the first as the next; what is not seen is not asked for."""
        for digit in str(n_cameras):
            await page.keyboard.press(digit)
        await shows(page, f"quadrille.state.filled === {n_cameras - 1}")
        assert await page.locator(".pane:visible").count() == 1
        await until(lambda: [r > 0 for r in endpoint.views[-1]["reductions"]] == [False] * (n_cameras - 1) + [True])
        await command(page, "Fill the grid with the next camera")
        await shows(page, "quadrille.state.filled === 0")
        await page.keyboard.press("Escape")
        await shows(page, "quadrille.state.filled === null")
        await until(lambda: all(endpoint.views[-1]["reductions"]))


@pytest.mark.endpoint(n_cameras=16)
class TestZoom:
    @pytest.mark.slow
    async def test_zooming_in_asks_for_finer_pictures_of_that_camera(self, page, endpoint):
        before = endpoint.views[-1]["reductions"]
        assert min(before) > 1
        box = await page.locator(".pane").nth(5).bounding_box()
        await turn_wheel(page, (box["x"] + 80, box["y"] + 60), -1500)
        await until(lambda: endpoint.views[-1]["reductions"][5] == 1)
        assert endpoint.views[-1]["reductions"][:5] == before[:5]

    @pytest.mark.slow
    async def test_the_next_frame_comes_as_coarse_as_a_pane_that_is_zoomed_out_again_can_use(self, page, endpoint):
        before = endpoint.views[-1]["reductions"]
        box = await page.locator(".pane").nth(5).bounding_box()
        await turn_wheel(page, (box["x"] + 80, box["y"] + 60), -1500)
        await until(lambda: endpoint.views[-1]["reductions"][5] == 1)
        await page.keyboard.press("0")
        await shows(page, "quadrille.state.views[5].zoom === 1")
        assert endpoint.views[-1]["reductions"][5] == 1  # what is there is fine enough
        await page.keyboard.press(".")
        await until(lambda: endpoint.views[-1]["reductions"] == pytest.approx(before, rel=0.02))


async def test_the_axes_of_the_silhouettes_are_drawn_on_their_frame_alone(page, endpoint):
    plain = await color_at(page)
    camera, u, _, v = PLACE
    line = [u, v - 40, u, v + 40]
    found = {
        "type": "finding", "running": False, "stage": "", "share": 1.0, "notes": [], "message": "Done.",
        "failed": False,
        "axes": [{"camera": camera, "people": [[[u + 30, v - 40, u + 30, v + 40], line]]}],
    }  # fmt: skip
    frame = await page.evaluate("quadrille.state.state.frame")
    await endpoint.broadcast(found | {"frame": frame + 1})
    await shows(page, "quadrille.state.finding !== null")
    assert await color_at(page) == plain
    await endpoint.broadcast(found | {"frame": frame})
    await shows(page, f"quadrille.state.finding.frame === {frame}")
    await until_async(lambda: color_at(page), lambda color: color != plain)
    await page.keyboard.press("a")
    await page.locator("[data-layer=axes]").uncheck()
    await until_async(lambda: color_at(page), lambda color: color == plain)


async def until_async(read, holds):
    for _ in range(100):
        if holds(await read()):
            return
        await asyncio.sleep(0.05)
    raise AssertionError(await read())
