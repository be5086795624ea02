"""The inspector: sections, fields, what they ask of the program, and its room beside the views."""

import pytest
from fake_endpoint import CAMERA_NAMES
from page_driver import command, reloaded, shows, until


async def opened(page, *sections):
    """Open the inspector by its key, with some sections open."""
    await command(page, "Inspector: sizes, settings (toggle)")
    await page.evaluate(
        "(open) => document.querySelectorAll('.section').forEach((s) => (s.open = open.includes(s.dataset.section)))",
        sections,
    )
    await page.locator("#inspector").wait_for()


def row(page, label):
    return page.locator(".row", has=page.get_by_text(label, exact=True))


@pytest.mark.slow
async def test_settings_are_changed_marked_and_reset(page, endpoint):
    await opened(page, "track", "search")
    await row(page, "Prediction").locator("select").select_option("2")
    await row(page, "Search lost limbs").locator("input").uncheck()
    angle = row(page, "Angle bound").locator("input")
    assert await angle.input_value() == "15"
    await angle.fill("20")
    await page.keyboard.press("Enter")
    await row(page, "Passes").locator("input").fill("1, 0.5")
    await page.keyboard.press("Enter")
    await until(lambda: len(endpoint.received) == 4)
    order, recover, bound, passes = endpoint.received
    assert order == {"type": "track_settings", "changes": {"options": {"order": "2"}}}
    assert recover == {"type": "track_settings", "changes": {"options": {"recover": False}}}
    assert bound["changes"]["bound_rad"] == pytest.approx(0.349066)
    assert passes == {"type": "search_settings", "changes": {"passes": [1, 0.5]}}
    endpoint.settings["search"]["bound_rad"] = 0.349066
    await endpoint.broadcast(endpoint.settings)
    await shows(page, "document.querySelectorAll('.row-label.is-changed').length === 1")
    await page.locator("[data-section=search] button", has_text="Reset").click()
    await until(lambda: len(endpoint.received) == 5)
    assert endpoint.received[-1]["changes"] == endpoint.settings["search_default"]


async def test_stride_and_cameras_of_a_run_are_chosen(page, endpoint):
    await opened(page, "track")
    await row(page, "Stride").locator("input").fill("3")
    await page.keyboard.press("Enter")
    cameras = page.get_by_role("group", name="Cameras to track with")
    names = await cameras.locator("label").all_inner_texts()
    assert names == list(CAMERA_NAMES)
    assert await cameras.locator("input:checked").count() == len(names)
    await cameras.get_by_label(names[1]).uncheck()
    await until(lambda: len(endpoint.received) == 2)
    chosen = [n for n in names if n != names[1]]
    assert [m["changes"] for m in endpoint.received] == [{"stride": 3}, {"cameras": chosen}]
    endpoint.settings["track"] |= {"stride": 3, "cameras": names[:1]}
    await endpoint.broadcast(endpoint.settings)
    await shows(page, "document.querySelectorAll('[data-section=track] .row-label.is-changed').length === 2")
    assert await row(page, "Stride").locator("input").input_value() == "3"
    only = cameras.get_by_label(names[0])
    await only.click()
    await shows(page, "document.querySelector('#advice-text').textContent.includes('expected at least one')")
    assert await only.is_checked()
    for name in names[1:]:
        await cameras.get_by_label(name).check()
    await until(lambda: len(endpoint.received) == 1 + len(names))
    assert endpoint.received[-1]["changes"] == {"cameras": []}  # all of them


async def test_a_value_out_of_range_is_refused_with_its_range(page, endpoint):
    await opened(page, "track", "body")
    for label, value, told in (("Past poses", "9", "from 1 to 8"), ("Height", "900", "from 30 to 300")):
        field = row(page, label).locator("input")
        await field.fill(value)
        await page.keyboard.press("Enter")
        await shows(page, f"document.querySelector('#advice-text').textContent.includes('{told}')")
        assert await field.get_attribute("aria-invalid") == "true"
        await page.keyboard.press("Escape")
    assert endpoint.received == []


async def test_sizes_are_entered_in_centimetres_then_applied(page, endpoint):
    await opened(page, "body")
    table = page.locator(".size-table")
    labels = await table.locator(".size-label").all_inner_texts()
    assert [label for label in labels if label] == ["Length", "Depth", "Width", "Torso", "Forearm", "Hips"]
    await table.get_by_label("Forearm: thickness from side to side").fill("14")
    await page.keyboard.press("Enter")
    await table.get_by_label("Distance between the two hip joints").press("ArrowUp")
    await until(lambda: len(endpoint.heard("body_sizes")) == 2)
    assert endpoint.received == [
        {"type": "body_sizes", "person": 0, "action": "part", "part": "left_forearm", "half_width_m": 0.07},
        {"type": "body_sizes", "person": 0, "action": "width", "girdle": "hip", "width_m": pytest.approx(0.175)},
    ]
    apply = page.locator("[data-section=body]").get_by_role("button", name="Apply")
    assert await apply.is_disabled()
    endpoint.body_sizes |= {"edited": True, "sides_alike": False}
    await endpoint.broadcast(endpoint.body_sizes)
    await shows(page, "document.querySelector('.size-table').textContent.includes('Right forearm')")
    assert "Not applied yet" in await page.locator("[data-section=body] [role=status]").inner_text()
    await page.set_viewport_size({"width": 1280, "height": 460})  # there is no room for all sizes
    await page.locator("#inspector").evaluate("(column) => column.scrollTo(0, 0)")
    column, box = await page.locator("#inspector").bounding_box(), await apply.bounding_box()
    assert box["y"] + box["height"] <= column["y"] + column["height"]
    await row(page, "Keyframes").locator("select").select_option("keep")
    await apply.click()
    await until(lambda: len(endpoint.received) == 3)
    assert endpoint.received[-1] == {"type": "body_sizes", "person": 0, "action": "apply", "refit": False}


async def test_another_body_is_chosen(page, endpoint):
    await opened(page, "body")
    choice = row(page, "Body").locator("select")
    assert await choice.input_value() == "gavrila34"
    await choice.select_option("gavrila38")
    await until(lambda: endpoint.heard("body_sizes"))
    assert endpoint.received == [{"type": "body_sizes", "person": 0, "action": "body", "to": "gavrila38"}]
    endpoint.body_sizes |= {"body": "mine"}  # of a file of the session's own
    await endpoint.broadcast(endpoint.body_sizes)
    await shows(page, "quadrille.state.bodySizes.body === 'mine'")
    assert await choice.input_value() == "mine"


async def test_the_3d_view_is_chosen(page, endpoint):
    await opened(page, "view")
    await row(page, "Floor grid").locator("input").uncheck()
    choice = row(page, "Look through").locator("option").nth(2)
    await choice.evaluate("(option) => (window.option = option)")
    await row(page, "Look through").locator("select").select_option(label="RIGHT")
    await page.locator(".trail-points").get_by_label("head").check()
    await row(page, "Opacity").locator("input").fill("0.5")
    await row(page, "Character").locator("select").select_option(label="knossow54")
    await page.get_by_role("button", name="Set floor…").click()
    await until(lambda: len(endpoint.received) == 6)
    assert endpoint.received == [
        {"type": "view_3d", "changes": {"floor": False}},
        {"type": "snap", "camera": 1},
        {"type": "view_3d", "changes": {"trail_points": ["head"]}},
        {"type": "view_3d", "changes": {"opacity": 0.5}},
        {"type": "view_3d", "changes": {"character": "knossow54"}},
        {"type": "floor", "action": "begin"},
    ]
    await shows(page, "quadrille.state.state.snapped === 1")
    assert await choice.evaluate("(option) => option === window.option")  # an open list stays open


async def test_angles_of_the_joint_have_whole_names_and_sliders(page, endpoint):
    await opened(page, "joint")
    names = await page.locator("[data-section=joint] .row-label").all_inner_texts()
    assert names == ["X", "Y", "Z", "Abduction", "Elevation", "Twist"]
    await row(page, "Twist").locator("[type=range]").fill("45")
    await until(lambda: endpoint.received)
    assert endpoint.received[0] == {
        "type": "pose", "frame": 12, "person": 0, "action": "set", "dof": 6, "value": 45,
    }  # fmt: skip


@pytest.mark.slow
@pytest.mark.endpoint(n_people=2)
async def test_it_leaves_the_views_room_and_stays_open_after_a_reload(page):
    await page.set_viewport_size({"width": 1280, "height": 720})
    boxes = {}
    for state in ("closed", "open"):
        boxes[state] = [await page.locator(f"#{name}").bounding_box() for name in ("panes", "scene")]
        if state == "closed":
            await page.locator("#show-inspector").click()
            await page.locator("#inspector").wait_for()
    panes, scene = boxes["open"]
    inspector = await page.locator("#inspector").bounding_box()
    assert panes["width"] >= 690
    assert scene["width"] >= 290
    assert boxes["closed"][0]["width"] >= panes["width"]
    assert inspector["x"] >= scene["x"] + scene["width"] - 1
    assert inspector["x"] + inspector["width"] <= 1280
    last = await page.locator("#show-key-list").bounding_box()
    assert last["x"] + last["width"] <= 1280
    await page.locator("[data-section=search] summary").click()
    await reloaded(page, "window.quadrille?.state.settings && document.querySelector('[data-section=search]').open")
    assert await page.locator("#inspector").is_visible()
    assert await page.locator("#inspector").evaluate("(one) => one.scrollWidth <= one.clientWidth")


FOUND = {
    "body": ("Body sizes", "Joints and parts of the person"),
    "sizes": ("Body sizes", "Joints and parts of the person"),
    "settings": ("Track settings", "Chamfer matching"),
    "track settings": ("Track settings", "Chamfer matching"),
    "search settings": ("Search settings", "Angle bound, °"),
    "angle bound": ("Angle bound", "Angle bound, °"),
}


@pytest.mark.slow
async def test_the_palette_leads_to_sections_and_rows(page, endpoint):
    for query, (label, focused) in FOUND.items():
        await page.keyboard.press("Control+k")
        await page.keyboard.type(query)
        assert await page.locator("#palette-list li > span").first.inner_text() == label
        await page.keyboard.press("Enter")
        name = "(document.activeElement.ariaLabel ?? document.activeElement.closest('label').title)"
        await shows(page, f"{name}.startsWith('{focused}')")
    assert endpoint.received == []


FIRST = {
    "dark": "Dark theme",
    "light": "Light theme",
    "theme": "Theme",
    "zoom": "Zoom all views to the people",
    "track": "Track forward",
    "search": "Search panel",
}


@pytest.mark.slow
async def test_words_of_a_beginner_find_something(page):
    await page.keyboard.press("Control+k")
    for query, label in FIRST.items():
        await page.locator("#palette-query").fill(query)
        assert await page.locator("#palette-list li > span").first.inner_text() == label, query


GROUND = "getComputedStyle(document.querySelector('#scene')).backgroundColor"


@pytest.mark.slow
async def test_a_theme_is_chosen_kept_and_recolours_the_3d_view_as_it_stands(page, endpoint):
    frame = page.frame_locator("#scene").locator("body")
    await frame.evaluate("() => (window.isLoadedOnce = true)")
    dark = await page.evaluate(GROUND)
    await page.keyboard.press("Control+k")
    await page.keyboard.type("light")
    await page.keyboard.press("Enter")
    await shows(page, f"{GROUND} !== '{dark}'")
    light = await page.evaluate(GROUND)
    assert await frame.evaluate("(body) => getComputedStyle(body).backgroundColor") == light
    assert await frame.evaluate("() => window.isLoadedOnce")
    await reloaded(page, "window.quadrille?.state.overlay")
    assert await page.evaluate(GROUND) == light
    await opened(page, "view")
    theme = row(page, "Theme").locator("select")
    assert await theme.input_value() == "light"
    await theme.select_option("system")
    await shows(page, f"{GROUND} === '{dark}'")
    assert endpoint.received == []


@pytest.mark.slow
async def test_people_are_found_with_progress_and_a_stop(page, endpoint):
    await opened(page, "find")
    section = page.locator("[data-section=find]")
    await section.get_by_role("button", name="Find people").click()
    await until(lambda: endpoint.heard("find_people") == [{"type": "find_people", "action": "start"}])
    work = {"type": "finding", "running": True, "stage": "acquiring sizes", "share": 0.6, "notes": ["frame 7: good"]}
    ends = {"message": "", "failed": False, "frame": None, "axes": []}
    await endpoint.broadcast(work | ends)
    await shows(page, "document.querySelector('[data-section=find] progress').value === 0.6")
    assert "acquiring sizes" in await section.get_by_role("status").inner_text()
    assert await section.locator("li").is_hidden()
    await section.locator("details summary").click()
    assert await section.locator("li").all_inner_texts() == ["frame 7: good"]
    assert await section.get_by_role("button", name="Find people").is_hidden()
    await section.get_by_role("button", name="Stop").click()
    await until(lambda: endpoint.heard("find_people")[-1]["action"] == "stop")
    text = "Expected somebody in the silhouettes, found none."
    await endpoint.broadcast(work | ends | {"running": False, "message": text, "failed": True})
    await section.get_by_role("button", name="Find people").wait_for()
    assert await section.get_by_role("status").inner_text() == text
    assert await section.locator("li").is_hidden()
    await endpoint.broadcast(work | ends)
    await shows(page, "quadrille.state.finding.running")
    await endpoint.broadcast(work | ends | {"running": False, "message": "Done."})
    await section.locator("li").wait_for()  # who was found


async def test_the_palette_finds_people(page, endpoint):
    await page.keyboard.press("Control+k")
    await page.keyboard.type("find people")
    await page.keyboard.press("Enter")
    await until(lambda: endpoint.heard("find_people") == [{"type": "find_people", "action": "start"}])
    await page.locator("[data-section=find]").wait_for()


async def test_sizes_are_acquired_with_progress_and_shown_before_and_after(page, endpoint):
    await opened(page, "body")
    await page.get_by_role("button", name="Acquire from footage").click()
    start = {"type": "acquire", "action": "start", "person": 0, "method": "contours"}
    await until(lambda: endpoint.heard("acquire") == [start])
    work = {"type": "acquisition", "person": 0, "running": True, "stage": "fitting sizes", "share": 0.4}
    await endpoint.broadcast(work | {"message": "", "result": None})
    await shows(page, "document.querySelector('[data-section=body] progress').value === 0.4")
    assert "fitting sizes" in await page.locator(".acquisition-status").inner_text()
    assert await page.get_by_role("button", name="Acquire from footage").is_hidden()
    assert await row(page, "Fit to").is_hidden()
    await page.locator("[data-section=body] .acquisition").get_by_role("button", name="Stop").click()
    await until(lambda: endpoint.heard("acquire")[-1]["action"] == "stop")
    lines = {"before": [[0, 0, 10, 10]], "after": [[0, 0, 12, 10], [12, 10, 20, 20]]}
    result = {
        "frames": [0, 7], "cost_before_px": 3.0, "cost_after_px": 2.25, "size_px": [24, 48],
        "sizes": [{"name": "thigh, length", "before_m": 0.4, "after_m": 0.445, "sigma_m": 0.008}],
        "front": lines, "side": lines,
    }  # fmt: skip
    note = "The shoulder turned by 19 degrees only, which does not show its centre; the hip turned by 9 degrees."
    await endpoint.broadcast(work | {"running": False, "stage": "", "message": note, "result": result})
    await page.locator(".acquisition-sizes").wait_for()
    assert await page.locator(".acquisition-status").inner_text() == note
    assert await page.locator(".acquisition-sizes tbody tr").inner_text() == "Thigh, length\t40.0\t44.5\t0.8"
    assert "Frames 0, 7: 3.00 → 2.25 px" in await page.locator("[data-section=body] .acquisition").inner_text()
    assert (
        await page.locator("[data-section=body] .acquisition path.is-after").first.get_attribute("d")
        == "M0 0L12 10M12 10L20 20"
    )
    # Nobody else's result is shown as one's own.
    await endpoint.broadcast(endpoint.body_sizes | {"person": 1})
    await page.locator(".acquisition-sizes").wait_for(state="hidden")


@pytest.mark.slow
async def test_sizes_are_acquired_from_voxels_first(page, endpoint):
    await opened(page, "body")
    choice = row(page, "Fit to")
    assert await choice.locator("option").all_inner_texts() == ["Contours", "Voxels first"]
    assert "labelled voxels" in await choice.get_attribute("title")
    await choice.locator("select").select_option(label="Voxels first")
    start = page.get_by_role("button", name="Acquire from footage")
    await start.click()
    await until(lambda: len(endpoint.heard("acquire")) == 1)
    work = {"type": "acquisition", "person": 0, "running": True, "stage": "fitting sizes to voxels", "share": 0.3}
    await endpoint.broadcast(work | {"message": "", "result": None})
    await start.wait_for(state="hidden")
    await endpoint.broadcast(work | {"running": False, "stage": "", "message": "Stopped.", "result": None})
    await start.click()  # the choice stays
    await until(lambda: len(endpoint.heard("acquire")) == 2)
    sent = {"type": "acquire", "action": "start", "person": 0, "method": "voxels"}
    assert endpoint.heard("acquire") == [sent, sent]
