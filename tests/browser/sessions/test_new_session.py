"""The form of a new session: files, cameras, their places, and what happens when two seem to be exchanged."""

import pytest
from form_program import DOUBT, NAMES, PASSED, RIG, SURVEY
from page_driver import shows, until


async def choose_files(page):
    await page.fill("#new-footage", "/data/videos")
    await page.fill("#new-calibration", "/data/cameras.toml")
    await shows(page, "document.querySelectorAll('#new-cameras li').length === 4")


async def assigned(page):
    return await page.locator("#new-cameras select").evaluate_all("all => all.map((one) => one.value.split('/').pop())")


@pytest.mark.slow
async def test_files_are_chosen_in_a_dialog(form):
    page, program = form
    await page.click("[data-browse=footage]")
    await page.locator("#path-picker-entries button").first.wait_for()
    assert await page.locator("#path-picker-entries button:disabled").count() == 2  # no folders
    await page.keyboard.press("Enter")  # the first folder has the focus
    await shows(page, "document.querySelectorAll('#path-picker-entries img').length === 5")
    assert await page.locator("#path-picker-path").input_value() == "/data/videos"
    await page.keyboard.press("Backspace")
    await shows(page, "document.querySelector('#path-picker-path').value === '/data'")
    await page.keyboard.press("Enter")
    await shows(page, "document.querySelector('#path-picker-path').value === '/data/videos'")
    await page.click("#path-picker-choose")
    assert await page.locator("#new-footage").input_value() == "/data/videos"
    await page.click("[data-browse=calibration]")  # it begins beside the footage
    await shows(page, "document.querySelector('#path-picker-path').value === '/data/videos'")
    async with page.expect_event("console"):  # the browser reports each answer of 400
        await page.fill("#path-picker-path", "/nothing")
        await page.keyboard.press("Enter")
    await shows(page, "document.querySelector('#path-picker-note').textContent.includes('found /nothing')")
    page.errors.clear()
    await page.click("#path-picker-up")
    await page.click("#path-picker-entries button:has-text('cameras.toml')")
    assert await page.locator("#new-calibration").input_value() == "/data/cameras.toml"
    await shows(page, "document.querySelector('#new-folder').value === '/data/videos_session'")
    await shows(page, "document.querySelectorAll('#new-cameras li').length === 4")
    files = {"footage": "/data/videos", "calibration": "/data/cameras.toml"}
    await until(lambda: program.surveyed[-1] == files | {"up": "z", "units": None, "poses": None})
    await page.keyboard.press("Escape")
    assert not await page.locator("#new-session").is_visible()


@pytest.mark.slow
async def test_several_files_of_one_calibration_are_marked(form):
    page, program = form
    await page.fill("#new-footage", "/data/videos")
    await page.fill("#new-calibration", "/data/")
    await page.click("[data-browse=calibration]")
    choose = page.locator("#path-picker-choose")
    first, second = (page.locator(f"#path-picker-entries button:has-text('{n}')") for n in ("cameras", "notes"))
    await first.click(modifiers=["Control"])
    assert await choose.inner_text() == "Choose 1 file"
    await first.press("Space")
    assert await choose.inner_text() == "Choose this folder"
    await second.press("Space")
    await first.click(modifiers=["Control"])
    assert await page.locator("#path-picker-entries [aria-pressed=true]").count() == 2
    await choose.click()
    assert await page.locator("#new-calibration").input_value() == "/data/notes.txt; cameras.toml"
    await until(lambda: program.surveyed[-1]["calibration"] == "/data/notes.txt; cameras.toml")
    await page.click("[data-browse=calibration]")  # begins in their folder, with nothing marked
    await shows(page, "document.querySelector('#path-picker-path').value === '/data'")
    await shows(page, "document.querySelector('#path-picker-choose').innerText === 'Choose this folder'")
    await page.keyboard.press("Escape")
    await page.click("[data-browse=footage]")  # takes a folder alone
    await page.locator("#path-picker-entries button").first.wait_for()
    await page.locator("#path-picker-entries button").first.press("Space")
    assert await choose.inner_text() == "Choose this folder"


@pytest.mark.slow
async def test_each_camera_shows_its_footage_and_the_rig_is_drawn(form):
    page, program = form
    await choose_files(page)
    await shows(
        page, "[...document.querySelectorAll('#new-cameras img')].filter((one) => one.naturalWidth).length === 3"
    )
    assert program.previews == {f"/data/videos/{n}.mp4" for n in NAMES[:3]}
    assert await page.locator("#new-cameras-note").inner_text() == (
        "Left out: LEFT. Not used: LEFT.mp4, gopro7.mp4. Drag a picture onto another to exchange them."
    )
    for drawing in await page.locator("#rig svg").all():
        assert await drawing.locator(".rig-camera").count() == 4
    titles = await page.locator("#rig svg:first-child .rig-camera title").all_text_contents()
    assert titles[2] == "BACK: 4.50 m from the point, 2.50 m over the floor"
    above = await page.locator("#rig svg:first-child circle:not(.rig-point)").evaluate_all(
        "all => all.map((one) => [one.cx.baseVal.value, one.cy.baseVal.value])"
    )
    (fx, fy), (rx, ry), (bx, by), _ = above
    assert fx - rx == pytest.approx(bx * -1 + fx, abs=0.5)  # RIGHT and BACK are both to the left
    assert fy == pytest.approx(ry, abs=0.5)
    assert by > fy  # north is up
    assert RIG["sentence"] in await page.locator("#rig-text").inner_text()
    assert await page.locator("#rig-text .is-warning").inner_text() == DOUBT
    await page.select_option("#new-up", "y")
    await until(lambda: program.surveyed[-1]["up"] == "y")
    for size in ((1280, 720), (1920, 1080)):
        await page.set_viewport_size({"width": size[0], "height": size[1]})
        box = await page.locator("#new-session").bounding_box()
        assert box["y"] >= 0
        assert box["y"] + box["height"] <= size[1]
        for part in ("#make-session", "#rig", "#new-session-checks", "#new-fps"):
            inner = await page.locator(part).bounding_box()
            assert inner["y"] + inner["height"] <= box["y"] + box["height"]


async def test_footage_is_given_to_cameras_by_menu_drag_and_hand(form):
    page, program = form
    await choose_files(page)
    assert await assigned(page) == ["FRONT.mp4", "RIGHT.mp4", "BACK.mp4", ""]
    menus = page.locator("#new-cameras select")
    await menus.nth(3).select_option("/data/videos/gopro7.mp4")
    await menus.nth(0).select_option("/data/videos/BACK.mp4")  # that of another camera is exchanged
    assert await assigned(page) == ["BACK.mp4", "RIGHT.mp4", "FRONT.mp4", "gopro7.mp4"]
    await page.locator("#new-cameras li").nth(0).drag_to(page.locator("#new-cameras li").nth(2))
    assert await assigned(page) == ["FRONT.mp4", "RIGHT.mp4", "BACK.mp4", "gopro7.mp4"]
    await menus.nth(1).select_option(label="Other footage…")
    await page.locator("#path-picker-entries img").first.wait_for()
    await page.click("#path-picker-entries button:has-text('LEFT.mp4')")
    assert await assigned(page) == ["FRONT.mp4", "LEFT.mp4", "BACK.mp4", "gopro7.mp4"]
    await page.fill("#new-offset-3", "4")
    await page.fill("#new-offset-0", "0")  # on purpose, whatever clocks show
    await menus.nth(2).select_option("")
    await page.select_option("#new-poses", "camera-to-world")
    await page.check("#new-rescale")
    await page.check("#new-common-frames")
    await page.select_option("#new-units", "mm")  # the choices stay
    await shows(page, "document.querySelectorAll('#new-cameras li.is-left-out').length === 1")
    for field, value in {
        "people": "ann, bob",
        "height": "170, 158.5",
        "model": "gavrila22",
        "masks": "/data/m",
    }.items():
        await page.fill(f"#new-{field}", value)
    await page.click("#make-session")
    await page.locator("#new-session-checks button").first.wait_for()
    (sent,) = program.posted
    assert [(c["name"], c["footage"].split("/")[-1], c["offset"]) for c in sent["cameras"]] == [
        ("FRONT", "FRONT.mp4", 0), ("RIGHT", "LEFT.mp4", None), ("LEFT", "gopro7.mp4", 4),
    ]  # fmt: skip
    assert sent.items() >= {
        "people": ["ann", "bob"], "heights": [170, 158.5], "models": ["gavrila22"], "masks": "/data/m",
        "units": "mm", "poses": "camera-to-world", "rescale": True, "common_frames": True, "keep_assignment": False,
    }.items()  # fmt: skip


@pytest.mark.slow
async def test_exchanged_cameras_are_exchanged_by_a_button_before_anything_is_made(form):
    page, program = form
    await choose_files(page)
    await page.click("#make-session")
    await page.get_by_text("Nothing has been made yet").wait_for()
    assert not await page.locator("#open-made-session").is_visible()
    await page.get_by_role("button", name="Exchange these two").click()
    await shows(page, "!document.querySelector('#open-made-session').hidden")
    assert await page.locator("#new-session .popover-foot").inner_text() == "Open"
    cameras = {c["name"]: (c["footage"].split("/")[-1], c["side_name"]) for c in program.posted[1]["cameras"]}
    assert cameras["FRONT"] == ("BACK.mp4", "BACK")
    assert cameras["BACK"] == ("FRONT.mp4", "FRONT")
    assert cameras["RIGHT"] == ("RIGHT.mp4", "RIGHT")
    async with page.expect_event("load"):
        await page.click("#open-made-session")
    assert program.posted[2] == {"folder": "/data/new"}


@pytest.mark.slow
async def test_exchanged_cameras_may_stay(form):
    page, program = form
    await choose_files(page)
    await page.click("#make-session")
    await page.get_by_role("button", name="Keep as they are").click()
    await shows(page, "!document.querySelector('#open-made-session').hidden")
    assert [sent["keep_assignment"] for sent in program.posted] == [False, True]


@pytest.mark.slow
async def test_unreadable_files_are_named_before_anything_is_made(form):
    page, program = form
    program.survey = SURVEY | {"cameras": [], "rig": None, "assigned": {}, "problems": ["no calibration of ours"]}
    program.outcomes = [[PASSED, {"failed": "no video for camera LEFT"}]] * 2
    await page.fill("#new-footage", "/data/videos")
    await page.fill("#new-calibration", "/data/notes.txt")
    await page.locator("#new-session-checks .is-failed").get_by_text("no calibration of ours").wait_for()
    assert await page.locator("#rig").is_hidden()
    await page.click("#make-session")
    await page.get_by_text("no video for camera LEFT").wait_for()
    assert not await page.locator("#open-made-session").is_visible()
    assert program.posted[0]["cameras"] == []


async def test_parts_beside_the_footage_are_filled_in_where_the_user_has_given_none(form):
    page, program = form
    program.survey = SURVEY | {"beside": {"calibration": "/data/Calib.toml", "background": "/data/background"}}
    await page.fill("#new-masks", "/data/mine")
    await page.fill("#new-footage", "/data")
    await shows(page, "document.querySelector('#new-calibration').value === '/data/Calib.toml'")
    values = [await page.input_value(f"#new-{name}") for name in ("background", "masks", "folder")]
    assert values == ["/data/background", "/data/mine", "/data_session"]
    # Those of other footage replace them, and nothing that was proposed is taken for a choice.
    program.survey = SURVEY
    await page.fill("#new-footage", "/other")
    await shows(page, "document.querySelector('#new-calibration').value === ''")
    assert program.surveyed[-1]["calibration"] is None


@pytest.mark.slow
async def test_other_files_are_looked_at_before_the_session_is_made(form):
    """However quickly Create follows, it takes the cameras of the files that the form has."""
    page, program = form
    await choose_files(page)
    other = {"path": "/data/other/FRONT.mp4", "name": "FRONT.mp4"}
    program.survey = SURVEY | {"footage": [other], "assigned": {"FRONT": other["path"]}}
    await page.evaluate("""() => {
      const footage = document.querySelector("#new-footage");
      footage.value = "/data/other";
      footage.dispatchEvent(new Event("input", { bubbles: true }));
      document.querySelector("#make-session").click();
    }""")
    await until(lambda: program.posted)
    assert [c["footage"] for c in program.posted[0]["cameras"]] == [other["path"]]
