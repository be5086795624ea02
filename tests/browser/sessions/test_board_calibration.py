"""The form of a calibration by a board: from footage to the form of a new session."""

import pytest
from page_driver import shows, until

SEEN = {"size": [640, 480], "views": 12, "covered_share": 0.31, "corners": [10, 20, 300, 400], "gross": [50, 60]}
CAMERAS = [
    SEEN | {"name": name, "footage": f"/data/videos/{name}.mp4", "held_out_px": error}
    for name, error in (("FRONT", 0.416), ("LEFT", None))
]
FOUND = {"out": "/data/videos/calibration.toml", "up": "-y", "sentence": "Expected error in the volume: 0.33 mm."}
CALIBRATED = FOUND | {"doubts": ["Camera 'LEFT': film the board nearer."], "cameras": CAMERAS}
BOARD = {"inverted": False, "columns": 4, "rows": 5, "square_mm": 54}
PROGRESS = {"progress": {"share": 0.4, "text": "Corners: 40%, 9 s left"}}
FORM = "#board-calibration"


async def describe(page):
    await page.click("#show-board-calibration")
    for field, value in {"footage": "/data/videos", "columns": "4", "square": "54"}.items():
        await page.fill(f"#board-{field}", value)
    await page.fill(f"{FORM} [name=rows]", "5")


async def test_a_calibration_is_shown_and_taken_into_the_form_of_a_new_session(form):
    page, program = form
    program.calibrated = [PROGRESS, {"calibrated": CALIBRATED}]
    await describe(page)
    await page.select_option("#board-dictionary", "DICT_4X4_50")
    await page.check(f"{FORM} [name=inverted]")
    await page.fill("#board-offsets", "FRONT=3, LEFT = -2")
    await page.fill("#board-fisheye", "LEFT")
    await page.click("#calibrate")
    await page.locator("#use-calibration:focus").wait_for()
    sent = {"footage": "/data/videos", "out": CALIBRATED["out"], "common_frames": False, "floor_frame": None}
    charuco = {"kind": "charuco", "dictionary": "DICT_4X4_50", "legacy_pattern": False, "inverted": True}
    chosen = {"board": BOARD | charuco, "fisheye": ["LEFT"], "offsets": {"FRONT": 3, "LEFT": -2}}
    assert program.posted == [sent | chosen]
    words = [CALIBRATED["sentence"], f"The calibration is in {CALIBRATED['out']}.", *CALIBRATED["doubts"]]
    assert await page.locator(f"{FORM}-checks li").all_inner_texts() == words
    cards = page.locator("#board-cameras li")
    qualities = ("0.42 px off", "no frame left out")
    assert await cards.locator("span").all_inner_texts() == [f"12 views, 31% covered, {one}" for one in qualities]
    dots = "all => all.map((one) => [one.getAttribute('class'), one.getBBox().x, one.getBBox().width])"
    found = await cards.first.locator("path").evaluate_all(dots)
    assert found == [["corners", 10, 290], ["corners is-gross", 50, 0]]
    assert program.previews == {"/data/videos/FRONT.mp4", "/data/videos/LEFT.mp4"}
    await page.click("#use-calibration")
    assert not await page.locator(FORM).is_visible()
    assert (await page.input_value("#new-calibration"), await page.input_value("#new-up")) == (CALIBRATED["out"], "-y")
    await until(lambda: (program.surveyed[-1]["calibration"], program.surveyed[-1]["up"]) == (CALIBRATED["out"], "-y"))


@pytest.mark.slow
@pytest.mark.parametrize("how", ["#stop-calibration", "#close-board-calibration"])
async def test_a_calibration_that_is_stopped_or_closed_ends_its_request(form, how):
    page, program = form
    program.may_answer.clear()
    await describe(page)
    await page.select_option(f"{FORM} [name=kind]", "checkerboard")
    assert await page.is_disabled("#board-dictionary")
    async with page.expect_event("requestfailed"):
        await page.click("#calibrate")
        await until(lambda: program.posted)
        assert await page.locator("#board-fields").get_attribute("inert") is not None
        await page.click(how)
    assert program.posted[0]["board"] == BOARD | {"kind": "checkerboard"}
    await shows(page, "document.querySelector('#stop-calibration').hidden")
    if how == "#stop-calibration":
        assert await page.locator(f"{FORM}-checks .is-failed").inner_text() == "Stopped: nothing was written."
    program.may_answer.set()


async def test_a_file_takes_the_place_of_a_description_and_a_failure_can_be_mended(form):
    page, program = form
    await page.keyboard.press("Escape")
    await page.keyboard.press("Control+k")
    await page.keyboard.type("checkerboard")
    await page.keyboard.press("Enter")
    await page.fill("#board-footage", "/data/videos")
    await page.fill("#board-file", "/data/board.toml")
    await page.fill("#board-out", "/data/mine.toml")
    await page.fill("#board-floor", "7")
    assert await page.locator(f"{FORM} [data-describes]:enabled").count() == 0
    await page.click("#calibrate")
    await page.get_by_text("no view shows the board").wait_for()
    assert await page.locator("#calibrate").is_visible()
    sent = program.posted[0]
    assert (sent["board"], sent["out"], sent["floor_frame"]) == ("/data/board.toml", "/data/mine.toml", 7)
    await page.fill("#board-footage", "/data/other")  # the name of the file is the user's
    assert await page.input_value("#board-out") == "/data/mine.toml"
    assert await page.locator(f"{FORM}-checks li").count() == 0
    program.calibrated = [{"calibrated": CALIBRATED}]
    await page.click("#calibrate")
    await page.click("#use-calibration")
    await page.locator("#new-session[open]").wait_for()
    assert await page.input_value("#new-calibration") == CALIBRATED["out"]
    assert await page.input_value("#new-poses") == "world-to-camera"
