"""The section of the calibration: a check, poses of an earlier calibration, and what it asks of the program."""

import msgspec
import pytest
from page_driver import command, shows, until

from app.messages.advice import Action, Advice, AdviceMessage

SIGMA = {
    "rotation_deg": [0.03, 0.03, 0.2],
    "position_mm": [2, 2, 9],
    "focal_percent": [0.1],
    "time_ms": [1.5],
    "drift_ms_per_s": [1.5],
}
CAMERA = {
    "name": "FRONT", "misfit_px": 0.4, "misfit_mm": 3.0, "kinds": [], "rivals": {}, "rotation_deg": [0, 0, 0],
    "position_mm": [0, 0, 0], "focal_percent": 0, "time_ms": 0, "drift_ms_per_s": 0, "sigma": SIGMA,
    "since_frame": None, "lost_frames": 0, "is_seen": True,
}  # fmt: skip
TURNED = CAMERA | {
    "name": "LEFT", "misfit_px": 9.4, "misfit_mm": 70.0, "kinds": ["rotation", "time"],
    "rivals": {"position": [1, -70, 0]}, "rotation_deg": [0.04, -1.1, -0.76], "time_ms": 37.2, "since_frame": 30,
}  # fmt: skip
CHECKED = {
    "type": "calibration", "running": False, "stage": "", "share": 0, "message": "", "failed": False,
    "is_checked": True, "frames": [3, 9, 12], "cameras": [CAMERA, TURNED], "sentences": ["camera LEFT is turned"],
    "misfits": [{"camera": 0, "u": 100, "v": 100, "du": 4, "dv": 0}], "misfit_factor": 20,
    "others": 11, "better": 9, "refused": "", "is_previewed": False, "preview_frame": None, "preview_fall_nats": 0,
    "revision": 1, "outdated": [[]],
}  # fmt: skip
APPLIED = CHECKED | {
    "is_checked": False,
    "cameras": [],
    "sentences": [],
    "misfits": [],
    "revision": 2,
    "outdated": [[[2, 30]]],
}


@pytest.fixture
def section(page):
    return page.locator("[data-section=calibration]")


async def opened(page):
    await command(page, "Inspector: sizes, settings (toggle)")
    await page.evaluate("document.querySelector('[data-section=calibration]').open = true")


async def test_a_check_names_the_camera_and_what_mends_it(page, endpoint, section):
    await opened(page)
    await endpoint.broadcast(CHECKED)
    await shows(page, "document.querySelector('.calibration-cameras')")
    rows = await page.locator(".calibration-cameras tbody tr").all_inner_texts()
    mended = ["pitch 0.04 ± 0.03°", "yaw −1.10 ± 0.03°", "roll −0.76 ± 0.20°", "time 37.2 ± 1.5 ms"]
    also = "or moved: right 1 mm, down −70 mm, forward 0 mm"
    assert rows[0].split() == ["FRONT", "0.4", "3", "–"]
    assert rows[1].split() == " ".join(["LEFT 9.4 70", *mended, "since frame 30", also]).split()
    await section.get_by_role("button", name="Preview").click()
    await until(lambda: endpoint.received[-1] == {"type": "calibration_check", "action": "preview"})
    await endpoint.broadcast(CHECKED | {"refused": "expected other frames to fit better, found 2 of 11"})
    await shows(page, "document.querySelector('[data-section=calibration]').innerText.includes('found 2 of 11.')")
    assert await section.get_by_role("button", name="Apply").is_disabled()


async def test_a_check_that_the_line_began_opens_its_result_in_sight(page, endpoint):
    await page.set_viewport_size({"width": 1100, "height": 680})
    doubt = Advice("camera_doubt", "LEFT seems turned.", (Action("check_cameras", "Check the cameras"),), "doubt")
    await endpoint.broadcast(msgspec.to_builtins(AdviceMessage((doubt,))))
    await page.locator("#advice [data-deed=check_cameras]").click()
    await until(lambda: endpoint.received[-1] == {"type": "calibration_check", "action": "start"})
    await endpoint.broadcast(CHECKED | {"is_checked": False, "cameras": [], "sentences": [], "running": True})
    await endpoint.broadcast(CHECKED)
    await shows(page, "document.querySelector('.calibration-cameras')")
    table = await page.locator(".calibration-cameras").bounding_box()
    assert (table["y"] >= 0, table["y"] + table["height"] <= 680) == (True, True)


async def test_lost_frames_are_named_in_place_of_a_time(page, endpoint, section):
    await opened(page)
    await endpoint.broadcast(CHECKED | {"cameras": [CAMERA, TURNED | {"kinds": ["time"], "lost_frames": 2}]})
    await shows(page, "document.querySelector('.calibration-cameras')")
    rows = await page.locator(".calibration-cameras tbody tr").all_inner_texts()
    assert rows[1].split() == ["LEFT", "9.4", "70", "2", "frames", "lost", "before", "frame", "30"]
    await endpoint.broadcast(CHECKED | {"cameras": [CAMERA, TURNED | {"kinds": ["time"], "lost_frames": -1}]})
    await shows(page, "document.querySelector('.calibration-cameras').innerText.includes('1 frame doubled before')")


async def test_poses_of_an_earlier_calibration_are_marked_counted_and_tracked_again(page, endpoint, section):
    await opened(page)
    await endpoint.broadcast(CHECKED)
    await shows(page, "quadrille.state.calibration")
    plain = await drawn(page)
    await endpoint.broadcast(APPLIED)
    await shows(page, "quadrille.state.calibration.outdated[0]?.length > 0")
    assert await drawn(page) != plain
    assert "keyframe was set under it and stays." in await section.inner_text()
    assert "earlier calibration" in await page.locator("#legend").get_attribute("title")
    await page.locator("#frame").fill("2")
    await page.keyboard.press("Enter")
    said = "document.querySelector('#timeline').getAttribute('aria-valuetext')"
    await shows(page, f"{said}.includes('earlier calibration')")
    await page.locator("#show-jumps").click()
    jump = page.locator("#jump-menu .jump-row", has_text="Earlier calibration")
    assert await jump.locator("output").inner_text() == "29"
    await jump.locator("button").nth(1).click()
    await shows(page, "quadrille.state.shown.frame === 3")
    await page.keyboard.press("Escape")
    await section.get_by_role("button", name="Track again").click()
    await until(lambda: endpoint.received[-1] == {"type": "calibration_check", "action": "track_again"})
    await endpoint.broadcast(APPLIED | {"outdated": [[]]})
    await shows(page, "!document.querySelector('[data-section=calibration]').innerText.includes('earlier')")
    assert await section.get_by_role("button", name="Track again").is_hidden()


async def test_misfits_are_drawn_magnified_and_not_during_a_preview(page, endpoint, section):
    await opened(page)
    await endpoint.broadcast(CHECKED)
    await shows(page, "document.querySelector('.calibration-cameras')")
    pane = "document.querySelector('.pane-overlay').toDataURL()"
    plain = await page.evaluate(pane)
    await section.get_by_role("button", name="Misfits").click()
    await shows(page, "document.querySelector('#pose-legend').innerText === 'misfit × 20'")
    assert await page.evaluate(pane) != plain
    await endpoint.broadcast(CHECKED | {"is_previewed": True})
    await shows(page, "document.querySelector('#pose-legend').hidden")
    assert await section.get_by_role("button", name="Misfits").is_disabled()


async def drawn(page):
    return await page.evaluate("document.querySelector('#timeline canvas').toDataURL()")
