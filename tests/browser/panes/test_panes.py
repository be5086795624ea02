"""Panes against `fake_endpoint`: what is drawn where, and what a hand in a pane sends."""

import asyncio

import numpy as np
import pytest
from fake_endpoint import project
from page_driver import (
    DRAWN,
    OPENED,
    command,
    drag_mouse,
    dragging,
    handle_of,
    reloaded,
    shows,
    state_of,
    to_client,
    turn_wheel,
    until,
)

PIXEL = """([x, y]) => {
  const canvas = document.querySelector(".pane-overlay");
  const box = canvas.getBoundingClientRect();
  const at = [Math.round((x - box.left) * devicePixelRatio), Math.round((y - box.top) * devicePixelRatio)];
  return [...canvas.getContext("2d").getImageData(...at, 1, 1).data];
}"""
"""JavaScript: the colour of the first pane at a place of the window."""


async def test_all_cameras_are_shown_with_names_and_costs(page):
    assert await page.locator(".pane").count() == 4
    assert await page.locator(".pane-name").all_inner_texts() == ["FRONT", "RIGHT", "BACK", "LEFT"]
    assert await page.locator(".pane-cost").all_inner_texts() == ["0.84 px", "1.10 px", "2.31 px", "–"]
    assert await page.locator("#cost").inner_text() == "1.47"
    assert await page.locator("#session-name").inner_text() == "elbow_rotation"
    assert await page.locator("#people-group").is_hidden()


async def test_image_and_vectors_are_drawn_where_the_maths_says(page, endpoint):
    # A model contour's colour lies where the view puts its first segment.
    segment = endpoint.outline(0, 0, 0.0)[8]
    x, y = await to_client(page, 0, *segment[:2])
    found = await page.evaluate(PIXEL, [x, y])
    assert found[3] > 200
    assert found[0] > found[2] + 60  # orange


@pytest.mark.parametrize("zoomed", [False, True])
async def test_a_drag_sends_undistorted_pixels_within_half_a_pixel(page, endpoint, zoomed):
    if zoomed:
        at = await to_client(page, 0, *await handle_of(page, 0, "l_wrist"))
        await turn_wheel(page, (at[0] - 40, at[1] + 25), -700)
        await page.mouse.down(button="middle")
        await page.mouse.move(at[0] - 90, at[1] + 60, steps=4)
        await page.mouse.up(button="middle")
        view = (await state_of(page))["views"][0]
        assert view["zoom"] == pytest.approx(2.857, rel=0.01)
    async with dragging(page, 0, "l_wrist", (2, -3), (10.25, -20.5), (17.5, -31.25)) as (u, v):
        await until(lambda: any(m["u"] == pytest.approx(u + 17.5, abs=0.5) for m in endpoint.heard("drag")))
    await until(lambda: endpoint.heard("drag")[-1]["phase"] == "end")
    first, *moves, last = endpoint.heard("drag")
    assert (first["phase"], first["camera"], first["point"]) == ("start", 0, "l_wrist")
    assert (first["u"], first["v"]) == (pytest.approx(u), pytest.approx(v))
    assert {m["phase"] for m in moves} == {"move"}
    assert last["u"] == pytest.approx(u + 17.5, abs=0.5)
    assert last["v"] == pytest.approx(v - 31.25, abs=0.5)
    numbers = [m["seq"] for m in endpoint.heard("drag")]
    assert numbers == sorted(set(numbers))
    # The figure follows in every view: what was dragged is drawn where it was dropped.
    await shows(page, f"quadrille.state.overlay.seq === {numbers[-1]}")
    assert await handle_of(page, 0, "l_wrist") == pytest.approx((u + 17.5, v - 31.25), abs=0.5)
    ((u2, v2),) = project(endpoint.pose[0, "l_wrist"][None], 2)
    assert await handle_of(page, 2, "l_wrist") == pytest.approx((u2, v2), abs=0.01)


async def test_a_move_is_told_before_the_browser_gets_to_the_next_frame(page, endpoint):
    """The browser tells each move at once by an event of its own; the one that all know waits for a frame."""
    told = """([x, y]) => {
      const at = { pointerId: 1, clientX: x, clientY: y };
      document.querySelectorAll(".pane-overlay")[1].dispatchEvent(new PointerEvent("pointerrawupdate", at));
    }"""
    async with dragging(page, 1, "l_wrist", (5, 5), (10, 10)) as (u, v):
        await asyncio.sleep(0.1)
        await page.evaluate(told, list(await to_client(page, 1, u + 33, v - 21)))
        await until(lambda: endpoint.heard("drag")[-1]["u"] == pytest.approx(u + 33, abs=0.01))
        assert endpoint.heard("drag")[-1]["v"] == pytest.approx(v - 21, abs=0.01)


@pytest.mark.slow
async def test_a_grab_beside_the_joint_keeps_the_distance(page, endpoint):
    u, v = await handle_of(page, 1, "head")
    x, y = await to_client(page, 1, u, v)
    await drag_mouse(page, (x + 7, y - 5), (x + 7, y + 30))
    await until(lambda: endpoint.heard("drag")[-1]["phase"] == "end")
    scale = (await state_of(page))["views"][1]["scale"]
    last = endpoint.heard("drag")[-1]
    assert (last["u"], last["v"]) == (pytest.approx(u, abs=0.5), pytest.approx(v + 35 / scale, abs=0.5))


@pytest.mark.slow
async def test_beyond_twelve_pixels_nothing_is_grabbed_and_the_view_moves(page, endpoint):
    u, v = await handle_of(page, 0, "head")
    x, y = await to_client(page, 0, u, v)
    await drag_mouse(page, (x, y - 14), (x + 40, y - 14))
    assert await to_client(page, 0, u, v) == pytest.approx((x + 40, y), abs=0.01)
    assert not endpoint.heard("drag")
    assert not endpoint.heard("select")


async def test_a_click_selects_without_editing(page, endpoint):
    x, y = await to_client(page, 0, *await handle_of(page, 0, "l_elbow"))
    await drag_mouse(page, (x, y), (x + 1, y + 2), steps=1)  # a hand is never quite still
    await until(lambda: endpoint.heard("select"))
    assert endpoint.heard("select") == [{"type": "select", "person": 0, "point": "l_elbow"}]
    assert not endpoint.heard("drag")


async def test_escape_takes_a_drag_back(page, endpoint):
    async with dragging(page, 0, "l_wrist", (5, 5), (30, 30)) as (u, v):
        await until(lambda: len(endpoint.heard("drag")) >= 2)
        await page.keyboard.press("Escape")
        await until(lambda: endpoint.heard("drag")[-1]["phase"] == "cancel")
        await page.mouse.move(*await to_client(page, 0, u + 60, v + 60))
    await shows(page, f"quadrille.state.overlay.seq === {endpoint.heard('drag')[-1]['seq']}")
    assert [m["phase"] for m in endpoint.heard("drag")][-1] == "cancel"
    assert await handle_of(page, 0, "l_wrist") == pytest.approx((u, v), abs=0.01)


async def test_dragging_shows_epipolar_lines_elsewhere_and_measures_itself(page):
    async with dragging(page, 0, "torso", *[(2 * k, -k) for k in range(1, 12)]):
        await shows(page, "quadrille.state.overlay.paths.some((path) => path.kind === 'epipolar')")
        paths = (await state_of(page))["overlay"]["paths"]
        assert {path["camera"] for path in paths if path["kind"] == "epipolar"} == {1, 2, 3}
    await shows(page, "!quadrille.state.overlay.paths.some((path) => path.kind === 'epipolar')")
    latencies = await page.evaluate("quadrille.latencies")
    assert 5 <= len(latencies) <= 12
    assert all(0 < ms < 1000 for ms in latencies)


@pytest.mark.slow
async def test_hover_names_the_joint_in_all_panes(page):
    await page.mouse.move(*await to_client(page, 3, *await handle_of(page, 3, "head")))
    await shows(page, "quadrille.state.hover?.point === 'head'")
    await page.mouse.move(5, 5)
    await shows(page, "quadrille.state.hover === null")


async def test_a_pane_fills_the_grid_by_key_and_double_click(page):
    await page.keyboard.press("3")
    await shows(page, "quadrille.state.filled === 2")
    assert [await p.is_visible() for p in await page.locator(".pane").all()] == [False, False, True, False]
    box = await page.locator(".pane:visible").bounding_box()
    await page.mouse.dblclick(box["x"] + 60, box["y"] + 200)
    await shows(page, "quadrille.state.filled === null")
    assert await page.locator(".pane:visible").count() == 4


@pytest.mark.slow
async def test_zoom_stays_at_the_pointer_and_zero_resets_it(page):
    # The wheel reports whole pixels: what must stay is what lies under one.
    x, y = map(round, await to_client(page, 1, 100, 100))
    pane = await page.locator(".pane").nth(1).bounding_box()
    view = (await state_of(page))["views"][1]
    u = (x - pane["x"] - view["origin"]["x"]) / view["scale"]
    v = (y - pane["y"] - view["origin"]["y"]) / view["scale"]
    await turn_wheel(page, (x, y), -500)
    await shows(page, "quadrille.state.views[1].zoom > 2")
    assert await to_client(page, 1, u, v) == pytest.approx((x, y), abs=0.01)
    views = (await state_of(page))["views"]
    assert views[1]["zoom"] > 2
    assert views[0]["zoom"] == 1
    await page.keyboard.press("0")
    assert await to_client(page, 1, u, v) == pytest.approx((x, y), abs=0.01)
    assert (await state_of(page))["views"][1]["zoom"] == 1


@pytest.mark.slow
async def test_layers_are_asked_for_and_shown_at_once(page, endpoint):
    (first,) = endpoint.views
    assert first["layers"] == ["image", "contours", "joints", "alternatives", "epipolar", "imported", "axes"]
    scales = [view["scale"] for view in (await state_of(page))["views"]]
    assert first["reductions"] == pytest.approx([1 / scale for scale in scales], rel=0.02)  # the timeline was to come
    await page.locator("#quick-layers").get_by_text("Distance").click()
    await shows(page, "'distance 3' in quadrille.state.shown.pictures")
    await page.locator("#quick-layers").get_by_text("Contours").click()
    await page.locator("#quick-layers").get_by_text("Joints").click()
    await shows(page, f"({DRAWN}) === 0")
    others = {"alternatives", "epipolar", "imported", "axes"}
    await until(lambda: set(endpoint.views[-1]["layers"]) == {"image", "distance"} | others)


async def test_contours_and_joints_are_drawn_in_the_persons_colour(page):
    await shows(page, f"({DRAWN}) > 200")


async def test_layers_change_before_the_program_answers(page, endpoint):
    async def silence(_message):
        pass

    endpoint.answer = silence
    await page.locator("#quick-layers").get_by_text("Contours").click()
    await page.locator("#quick-layers").get_by_text("Joints").click()
    await shows(page, f"({DRAWN}) === 0")


async def test_hidden_joints_cannot_be_grabbed(page, endpoint):
    await page.locator("#quick-layers").get_by_text("Joints").click()
    async with dragging(page, 0, "head", (10, 10), (20, 20)):
        pass
    assert not endpoint.heard("drag")


async def test_a_minor_joint_gives_way_to_a_neighbour_until_one_zooms_in(page, endpoint):
    waist = await handle_of(page, 0, "waist")
    x, y = await to_client(page, 0, *waist)
    await page.mouse.move(x, y)
    await shows(page, "quadrille.state.hover?.point === 'torso'")
    await page.mouse.wheel(0, -1400)
    await shows(page, "quadrille.state.views[0].zoom > 5")
    async with dragging(page, 0, "waist", (1, 1), (4, 6)):
        await until(lambda: any(m["phase"] == "move" for m in endpoint.heard("drag")))
    assert {m["point"] for m in endpoint.heard("drag")} == {"waist"}


@pytest.mark.slow
async def test_a_minor_joint_in_the_hand_stays_there_as_it_meets_another(page, endpoint):
    await turn_wheel(page, await to_client(page, 0, *await handle_of(page, 0, "waist")), -1400)
    await shows(page, "quadrille.state.views[0].zoom > 5")
    u, v = await handle_of(page, 0, "torso")
    x, y = await to_client(page, 0, u, v)
    beside = [x + 15, y - 7]  # where the name of a joint that lies at x, y is written
    before = await page.evaluate(PIXEL, beside)
    async with dragging(page, 0, "waist", (1, 1)):
        await page.mouse.move(x, y)
        await until(lambda: endpoint.heard("drag")[-1]["v"] == pytest.approx(v, abs=0.5))
        await shows(page, f"quadrille.state.overlay.seq === {endpoint.heard('drag')[-1]['seq']}")
        assert max((await page.evaluate(PIXEL, beside))[:3]) < 60 < max(before[:3])
    await until(lambda: endpoint.heard("drag")[-1]["phase"] == "end")


@pytest.mark.slow
async def test_the_splitter_moves_by_drag_and_key_within_bounds(page):
    panes = page.locator("#panes")
    before = (await panes.bounding_box())["width"]
    box = await page.locator("#split").bounding_box()
    await drag_mouse(page, (box["x"] + 2, 300), (702, 300), steps=4)
    assert (await panes.bounding_box())["width"] == pytest.approx(700, abs=1) != before
    await page.locator("#split").focus()
    await page.keyboard.press("ArrowRight")
    assert (await panes.bounding_box())["width"] == pytest.approx(724, abs=1)
    for _ in range(40):
        await page.keyboard.press("ArrowRight")
    assert (await page.locator("#scene").bounding_box())["width"] >= 290


@pytest.mark.endpoint(n_people=2, n_cameras=6)
class TestPeople:
    @pytest.mark.slow
    async def test_six_cameras_and_two_people(self, page, endpoint):
        assert await page.locator(".pane:visible").count() == 6
        await page.locator("#people input").nth(1).check(force=True)
        await until(lambda: endpoint.heard("select"))
        assert endpoint.heard("select") == [{"type": "select", "person": 1, "point": None}]


@pytest.mark.slow
async def test_all_views_are_framed_on_the_people_by_a_key(page):
    await command(page, "Zoom all views to the people")
    await shows(page, "quadrille.state.views.every((view) => view.zoom > 1.05)")
    for camera in range(4):
        pane = await page.locator(".pane").nth(camera).bounding_box()
        handles = [h for h in (await state_of(page))["overlay"]["handles"] if h["camera"] == camera]
        places = [await to_client(page, camera, h["u"], h["v"]) for h in handles]
        for x, y in places:
            assert pane["x"] < x < pane["x"] + pane["width"]
            assert pane["y"] < y < pane["y"] + pane["height"]
        assert max(y for _, y in places) - min(y for _, y in places) > 0.5 * pane["height"]
    await page.mouse.move(0, 0)
    await page.keyboard.press("0")
    await shows(page, "quadrille.state.views.every((view) => view.zoom === 1)")


async def test_linked_views_show_the_same_joint_at_the_same_size(page):
    joint = next(h for h in (await state_of(page))["overlay"]["handles"] if h["camera"] == 0)
    await command(page, "Link the zoom of all views (toggle)")
    await turn_wheel(page, await to_client(page, 0, joint["u"], joint["v"]), -700)
    await shows(page, "quadrille.state.views.every((view) => view.zoom > 1.5)")
    handles = (await state_of(page))["overlay"]["handles"]
    sizes = []
    for camera in range(4):
        pane = await page.locator(".pane").nth(camera).bounding_box()
        own = [h for h in handles if h["camera"] == camera]
        places = {h["point"]: await to_client(page, camera, h["u"], h["v"]) for h in own}
        middle = pane["x"] + pane["width"] / 2, pane["y"] + pane["height"] / 2
        off = {point: np.hypot(px - middle[0], py - middle[1]) for point, (px, py) in places.items()}
        assert min(off.values()) < 0.25 * pane["height"]
        sizes.append(np.std(list(places.values()), axis=0) @ np.std(list(places.values()), axis=0))
    np.testing.assert_allclose(sizes, sizes[0], rtol=0.02)
    zooms = [view["zoom"] for view in (await state_of(page))["views"]]
    await page.mouse.wheel(0, 300)  # they follow on, and each only once
    await shows(page, f"quadrille.state.views.every((view, i) => view.zoom < {zooms}[i])")
    await command(page, "Link the zoom of all views (toggle)")  # no longer
    others = [view["zoom"] for view in (await state_of(page))["views"]][1:]
    await page.mouse.wheel(0, -600)
    await shows(page, f"quadrille.state.views[0].zoom > {zooms[0]}")
    await page.wait_for_timeout(100)
    assert [view["zoom"] for view in (await state_of(page))["views"]][1:] == others


@pytest.mark.slow
async def test_zoom_is_kept_over_a_reload(page):
    await turn_wheel(page, await to_client(page, 0, 200.0, 150.0), -600)
    await shows(page, "localStorage.getItem('quadrille.views.elbow_rotation')")
    before = [await to_client(page, camera, 100.0, 90.0) for camera in (0, 1)]
    await reloaded(page)
    for camera, place in enumerate(before):
        assert await to_client(page, camera, 100.0, 90.0) == pytest.approx(place, abs=0.01)
    await page.keyboard.press("0")  # the whole image, kept as well
    await shows(page, "!localStorage.getItem('quadrille.views.elbow_rotation').includes('zoom')")


@pytest.mark.slow
async def test_a_session_is_framed_on_its_people_when_it_first_opens_and_not_again(page, endpoint):
    await page.evaluate("localStorage.removeItem('quadrille.views.elbow_rotation')")
    await reloaded(page, f"{OPENED} && quadrille.state.views.every((view) => view.zoom > 1.05)")
    framed = (await state_of(page))["views"]
    await page.reload()  # kept, as if by hand
    await shows(page, OPENED)
    assert (await state_of(page))["views"] == framed
    # What was framed is framed still in a pane of another shape.
    await page.set_viewport_size({"width": 1100, "height": 800})
    await shows(page, f"quadrille.state.views[0].scale !== {framed[0]['scale']}")
    pane = await page.locator(".pane").first.bounding_box()
    handles = [h for h in (await state_of(page))["overlay"]["handles"] if h["camera"] == 0]
    places = np.array([await to_client(page, 0, h["u"], h["v"]) for h in handles])
    low, high = places.min(axis=0), places.max(axis=0)
    np.testing.assert_allclose(((high - low) / (pane["width"], pane["height"])).max(), 1 / 1.4, atol=0.01)
    await page.keyboard.press("0")
    await shows(page, "quadrille.state.views.every((view) => view.zoom === 1)")
    await page.keyboard.press("Period")
    await shows(page, "quadrille.state.shown.frame === 13 && quadrille.state.overlay.frame === 13")
    assert all(view["zoom"] == 1 for view in (await state_of(page))["views"])
    # Without a pose there is nobody to frame.
    endpoint.state["people"][0]["source"] = None
    await page.evaluate("localStorage.removeItem('quadrille.views.elbow_rotation')")
    await reloaded(page)
    assert all(view["zoom"] == 1 for view in (await state_of(page))["views"])


@pytest.mark.slow
async def test_a_view_moved_before_the_first_overlay_stays_where_it_is(page, endpoint):
    endpoint.held = asyncio.Event()
    await page.evaluate("localStorage.removeItem('quadrille.views.elbow_rotation')")
    await reloaded(page, "window.quadrille?.state.views.length === 4 && quadrille.state.state")
    pane = await page.locator(".pane").nth(1).bounding_box()
    await turn_wheel(page, (pane["x"] + 100, pane["y"] + 100), -300)
    await shows(page, "quadrille.state.views[1].zoom > 1")
    moved = (await state_of(page))["views"]
    endpoint.held.set()
    await shows(page, OPENED)
    await page.wait_for_timeout(50)
    assert [view["zoom"] for view in (await state_of(page))["views"]] == [view["zoom"] for view in moved]


@pytest.mark.slow
async def test_the_pane_that_fills_the_grid_is_kept_over_a_reload(page):
    await page.keyboard.press("3")
    await shows(page, "quadrille.state.filled === 2")
    await reloaded(page)
    assert [await p.is_visible() for p in await page.locator(".pane").all()] == [False, False, True, False]
    await page.keyboard.press("3")
    await shows(page, "quadrille.state.filled === null")
    await reloaded(page)
    assert await page.locator(".pane:visible").count() == 4


async def sizes_of(page):
    boxes = [await pane.bounding_box() for pane in await page.locator(".pane").all()]
    return [(round(box["width"]), round(box["height"])) for box in boxes]


async def pulled(page, locator, dx, dy):
    box = await locator.bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    await drag_mouse(page, (x, y), (x + dx, y + dy))


@pytest.mark.slow
async def test_panes_are_resized_by_their_borders_and_corners(page):
    automatic = await sizes_of(page)
    middle = await page.evaluate("quadrille.state.views[0]")
    center = [(automatic[0][0] / 2 - middle["origin"]["x"]) / middle["scale"], 240]
    between = page.get_by_role("separator", name="Border between FRONT and RIGHT")
    # Near the end of the border, clear of the corner.
    box = await between.bounding_box()
    assert await between.evaluate("(bar) => getComputedStyle(bar).cursor") == "col-resize"
    await drag_mouse(page, (box["x"] + 4, box["y"] + 20), (box["x"] + 94, box["y"] + 40))
    (width, height), (other, _) = automatic[:2]
    assert await sizes_of(page) == [(width + 90, height), (other - 90, height), *automatic[2:]]
    # What was in the middle is there still.
    view = (await state_of(page))["views"][0]
    assert (width + 90) / 2 == pytest.approx(view["origin"]["x"] + view["scale"] * center[0], abs=1)
    rows = page.get_by_role("separator", name="Border between row 1 and row 2")
    await rows.focus()
    await page.keyboard.press("ArrowUp")
    resized = await sizes_of(page)
    assert [h for _, h in resized] == [height - 24, height - 24, automatic[2][1] + 24, automatic[3][1] + 24]
    assert int(await rows.get_attribute("aria-valuenow")) < 50
    await reloaded(page)
    assert await sizes_of(page) == resized
    # No pane vanishes, however far the border is moved.
    await pulled(page, between, 2000, 0)
    assert (await sizes_of(page))[1][0] == 120
    await between.dblclick()
    assert (await sizes_of(page))[:2] == [(width, height - 24), (other, height - 24)]
    # Where all borders meet they move together.
    await pulled(page, page.locator(".pane-corner"), -50, 30)
    assert await sizes_of(page) == [
        (width - 50, height + 6),
        (other + 50, height + 6),
        (automatic[2][0] - 50, automatic[2][1] - 6),
        (automatic[3][0] + 50, automatic[3][1] - 6),
    ]
    await page.keyboard.press("1")
    await shows(page, "quadrille.state.filled === 0")
    assert await page.locator(".pane-border, .pane-corner").count() == 0
    await page.keyboard.press("1")
    await shows(page, "quadrille.state.filled === null")
    await page.keyboard.press("Control+k")
    await page.keyboard.type("reset sizes of all panes")
    await page.keyboard.press("Enter")
    await shows(page, "localStorage.getItem('quadrille.pane-shares.elbow_rotation') === '{}'")
    assert await sizes_of(page) == automatic
