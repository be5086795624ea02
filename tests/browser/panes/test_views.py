"""Views and the people in them: zoomed views follow, panes keep their places, images use the window."""

import numpy as np
import pytest
from page_driver import OPENED, command, handle_of, reloaded, shows, state_of, to_client, turn_wheel, until

PORTRAIT = ((1080, 1920),)
STEPPED = "quadrille.state.shown.frame === {0} && quadrille.state.overlay.frame === {0}"


async def place_in_pane(page, camera, point):
    """Place of a joint in its pane, as shares of the pane's width and height."""
    box = await page.locator(".pane").nth(camera).bounding_box()
    x, y = await to_client(page, camera, *await handle_of(page, camera, point))
    return np.array([(x - box["x"]) / box["width"], (y - box["y"]) / box["height"]])


async def tracks_of(page):
    """Left and upper edges of all panes: panes of a row or column share one."""
    boxes = [await pane.bounding_box() for pane in await page.locator(".pane:visible").all()]
    return len({box["y"] for box in boxes}), len({box["x"] for box in boxes})


async def step(page, frame):
    await page.keyboard.press("Period" if frame > (await state_of(page))["target"] else "Comma")
    await shows(page, STEPPED.format(frame))


@pytest.mark.slow
@pytest.mark.endpoint(walk_m=0.1)
async def test_a_zoomed_view_follows_the_person_from_frame_to_frame(page, endpoint):
    await turn_wheel(page, await to_client(page, 0, *await handle_of(page, 0, "head")), -700)
    await shows(page, "quadrille.state.views[0].zoom > 2")
    before = await place_in_pane(page, 0, "head")
    zoom = (await state_of(page))["views"][0]["zoom"]
    whole = (await state_of(page))["views"][2]
    for frame in (13, 14, 15):
        await step(page, frame)
    assert await place_in_pane(page, 0, "head") == pytest.approx(before, abs=0.01)
    assert (await state_of(page))["views"][0]["zoom"] == zoom
    assert (await state_of(page))["views"][2] == whole  # the whole image stays
    # Far beyond the image and back: the view is where it was.
    for target in (100, 12):
        await page.locator("#frame").fill(str(target))
        await page.keyboard.press("Enter")
        await shows(page, STEPPED.format(target))
    assert await place_in_pane(page, 0, "head") == pytest.approx(before, abs=0.01)
    endpoint.walk_m = 0.02  # a slow machine skips frames, and the person must not leave the image meanwhile
    await page.keyboard.press("Space")
    await shows(page, "quadrille.state.overlay.frame > 16")
    await page.keyboard.press("Space")
    await shows(page, "!quadrille.state.playing && quadrille.state.overlay.frame === quadrille.state.target")
    assert await place_in_pane(page, 0, "head") == pytest.approx(before, abs=0.01)
    # On request it stays.
    await command(page, "Zoomed views follow the people from frame to frame (toggle)")
    frame = (await state_of(page))["target"]
    origin = (await state_of(page))["views"][0]["origin"]
    await step(page, frame + 1)
    assert (await state_of(page))["views"][0]["origin"] == origin


@pytest.mark.endpoint(walk_m=0.1)
async def test_a_view_follows_although_the_state_comes_after_the_picture(page, endpoint, monkeypatch):
    """Else it would follow with the next overlay: that of a drag, under the hand."""
    await turn_wheel(page, await to_client(page, 0, *await handle_of(page, 0, "head")), -700)
    await shows(page, "quadrille.state.views[0].zoom > 2")
    before = await place_in_pane(page, 0, "head")

    async def nothing(_):
        pass

    with monkeypatch.context() as late:
        late.setattr(endpoint, "broadcast", nothing)
        await step(page, 13)
    assert (await state_of(page))["state"]["frame"] == 12
    await endpoint.broadcast(endpoint.state)
    await shows(page, "quadrille.state.state.frame === 13")
    assert await place_in_pane(page, 0, "head") == pytest.approx(before, abs=0.01)


@pytest.mark.slow
async def test_a_hidden_tab_asks_for_no_view(page, endpoint):
    hide = """(hidden) => {
      Object.defineProperty(document, "hidden", { get: () => hidden, configurable: true });
      document.dispatchEvent(new Event("visibilitychange"));
    }"""
    before = endpoint.views[-1]
    assert all(before["reductions"])
    await page.evaluate(hide, True)
    await until(lambda: endpoint.views[-1] == before | {"reductions": [0, 0, 0, 0]})
    await page.evaluate(hide, False)
    await until(lambda: endpoint.views[-1] == before)


@pytest.mark.slow
@pytest.mark.endpoint(walk_m=0.1)
async def test_framed_people_stay_framed_and_an_edit_moves_no_view(page, endpoint):
    await command(page, "Zoom all views to the people")
    await shows(page, "quadrille.state.views[0].zoom > 1.05")
    before = (await state_of(page))["views"][0]
    u, _ = await handle_of(page, 0, "torso")
    endpoint.pose = {key: np.add(at, (0.4, 0, 0)) for key, at in endpoint.pose.items()}
    await endpoint.send_overlay()
    await shows(page, f"quadrille.state.overlay.handles[0].u > {u} + 50")
    assert (await state_of(page))["views"][0] == before
    for frame in (13, 14, 15):
        await step(page, frame)
    place = await place_in_pane(page, 0, "head")
    assert place[0] == pytest.approx(0.5, abs=0.05)
    assert (await state_of(page))["views"][0]["zoom"] == before["zoom"]


@pytest.mark.slow
@pytest.mark.endpoint(walk_m=0.1)
async def test_a_session_opens_framed_on_the_people_where_they_are_now(page, endpoint):
    await command(page, "Zoom all views to the people")
    await shows(page, "(localStorage.getItem('quadrille.views.elbow_rotation') ?? '').includes('framed')")
    endpoint.state["frame"] = 24
    await reloaded(page, f"{OPENED} && quadrille.state.views[0].zoom > 1.05")
    place = await place_in_pane(page, 0, "head")
    assert place[0] == pytest.approx(0.5, abs=0.05)
    # A view of a place that people have left shows them, too.
    await turn_wheel(page, await to_client(page, 0, *await handle_of(page, 0, "l_wrist")), -1500)
    await shows(page, "quadrille.state.views[0].zoom > 8")
    endpoint.state["frame"] = 12
    await reloaded(page, f"{OPENED} && quadrille.state.views[0].zoom < 8")
    assert (await place_in_pane(page, 0, "head") > 0).all()
    assert (await place_in_pane(page, 0, "head") < 1).all()


@pytest.mark.slow
async def test_people_who_are_found_are_framed(page, endpoint):
    finding = {
        "type": "finding", "running": True, "stage": "tracking", "share": 1.0, "notes": [], "message": "",
        "failed": False, "frame": None, "axes": [],
    }  # fmt: skip
    endpoint.state["people"][0]["source"] = None
    await endpoint.broadcast(endpoint.state)
    await endpoint.broadcast(finding)
    await shows(page, "quadrille.state.finding?.running")
    endpoint.state["people"][0]["source"] = "searched"
    await endpoint.broadcast(endpoint.state)
    await endpoint.broadcast(finding | {"frame": 12})
    await endpoint.send_overlay()
    await shows(page, "quadrille.state.views.every((view) => view.zoom > 1.05)")


FOOTAGE = {"portrait": {"sizes": PORTRAIT}, "4:3": {}, "8 cameras": {"n_cameras": 8}}


@pytest.mark.slow
@pytest.mark.parametrize("endpoint", FOOTAGE.values(), indirect=True, ids=FOOTAGE)
@pytest.mark.parametrize("size", [(1280, 720), (1920, 1080)])
async def test_a_drawer_keeps_the_arrangement_of_the_panes(page, endpoint, size):
    await page.set_viewport_size({"width": size[0], "height": size[1]})
    await shows(page, f"document.querySelector('#workspace').clientWidth === {size[0]}")
    before, width = await tracks_of(page), await page.locator("#panes").evaluate("(panes) => panes.clientWidth")
    for key in ("Search panel", "c", "Doubtful and lost poses, most severe first"):
        await command(page, key)
        await shows(page, "quadrille.state.drawer !== null && document.querySelector('#drawer').offsetHeight > 100")
        assert await tracks_of(page) == before
        assert await page.locator("#panes").evaluate("(panes) => panes.clientWidth") == width
    await page.locator("#close-drawer").click()
    await shows(page, "document.querySelector('#drawer').offsetHeight === 0")
    assert await tracks_of(page) == before


@pytest.mark.slow
@pytest.mark.endpoint(sizes=PORTRAIT)
@pytest.mark.parametrize("size", [(1280, 720), (1920, 1080)])
async def test_portrait_footage_uses_the_window(page, endpoint, size):
    await page.set_viewport_size({"width": size[0], "height": size[1]})
    await shows(page, f"document.querySelector('#workspace').clientWidth === {size[0]}")
    pane = await page.locator(".pane").first.bounding_box()
    assert pane["width"] > 0.18 * size[0]  # four took 0.155 of the window each
    scene = await page.locator("#scene").bounding_box()
    assert scene["width"] >= 300
    # A place that the user has chosen stays.
    await page.locator("#split").focus()
    for _ in range(5):
        await page.keyboard.press("ArrowLeft")
    chosen = await page.locator("#panes").evaluate("(panes) => panes.clientWidth")
    await reloaded(page)
    assert abs(await page.locator("#panes").evaluate("(panes) => panes.clientWidth") - chosen) <= 1
