"""Another session opened from the page of the real program, which starts again at the same address."""

import json
import shutil
import time

import pytest
import pytest_asyncio
from command_line import SAMPLE
from page_driver import command, shows
from program import WITHOUT_3D, Program
from stranger import Errors

from tracker.session.session import load_session

pytestmark = pytest.mark.slow


@pytest_asyncio.fixture(loop_scope="session")
async def page(browser, tmp_path, monkeypatch):
    """The page of a sample in the folder `walk`."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    shutil.copytree(SAMPLE, tmp_path / "walk")
    program = Program(tmp_path / "walk", has_token=True)
    await program.start()
    context = await browser.new_context(viewport={"width": 1280, "height": 720})
    try:
        page = await context.new_page()
        await page.add_init_script(WITHOUT_3D)
        await page.goto(program.address, timeout=120_000)
        await page.wait_for_url(lambda url: "token" not in url)  # the page exchanges it for a cookie
        await shows(page, "window.quadrille?.state.overlay", 120)
        yield page
    finally:
        await context.close()
        await program.kill()


async def test_another_session_takes_the_place_of_the_first(page, tmp_path):
    shutil.copytree(SAMPLE, tmp_path / "dance")
    errors = Errors(page)
    await command(page, "Open another session")
    await page.keyboard.type(str(tmp_path / "dance"))
    began = time.monotonic()
    async with page.expect_event("load", timeout=60_000):
        await page.keyboard.press("Enter")
    await shows(page, "window.quadrille?.state.overlay && quadrille.state.shown?.frame === 0", 60)
    print(f"another session after {time.monotonic() - began:.1f} s")
    await command(page, "Open another session")
    await shows(page, f"document.querySelector('#recent-sessions').innerText.includes('{tmp_path / 'walk'}')")
    assert errors.found == []
    assert not (tmp_path / "walk" / "lock.json").exists()
    assert (tmp_path / "dance" / "lock.json").exists()
    recent = json.loads((tmp_path / "state" / "quadrille" / "recent_sessions.json").read_text())
    assert [entry["folder"] for entry in recent] == [str(tmp_path / "dance"), str(tmp_path / "walk")]


async def show_form(page):
    await page.click("#session-name")
    await page.click("#show-new-session")


async def test_a_session_is_made_of_footage_with_two_names_exchanged(page, tmp_path, data_folder):
    """The form shows the cameras, exchanges the two on request, and opens the session with its next step."""
    walk, mixed = data_folder("walk"), tmp_path / "mixed"
    mixed.mkdir()
    await show_form(page)
    exchanged = {"FRONT": "LEFT", "LEFT": "FRONT"}
    for name in ("FRONT", "RIGHT", "BACK", "LEFT"):
        shutil.copy(walk / f"{name}.mp4", mixed / f"{exchanged.get(name, name)}.mp4")
    await page.fill("#new-footage", str(mixed))
    await page.fill("#new-calibration", str(walk / "Calib.toml"))
    await page.fill("#new-background", str(walk / "background"))
    pictures = "[...document.querySelectorAll('#new-cameras img')]"
    await shows(page, f"{pictures}.filter((one) => one.naturalWidth).length === 4")
    assert await page.locator("#rig .rig-camera").count() == 8
    await page.click("#make-session")
    await page.get_by_role("button", name="Exchange these two").click(timeout=60_000)
    await shows(page, "!document.querySelector('#open-made-session').hidden", 60)
    made = load_session(tmp_path / "mixed_session")
    assert {c.camera.name: c.footage.stem for c in made.cameras} == {
        "FRONT": "LEFT", "RIGHT": "RIGHT", "BACK": "BACK", "LEFT": "FRONT",
    }  # fmt: skip
    async with page.expect_event("load", timeout=60_000):
        await page.click("#open-made-session")
    await shows(page, "window.quadrille?.state.session?.name === 'mixed_session'", 60)
    await page.locator("#advice [data-deed=find]").wait_for()


async def test_real_cameras_are_calibrated_by_a_board_in_the_page(page, tmp_path, data_folder):
    """The pictures have corners, and the form of a new session draws the cameras."""
    shutil.copytree(data_folder("board_real"), filmed := tmp_path / "board")
    await show_form(page)
    await page.click("#show-board-calibration")
    await page.fill("#board-footage", str(filmed))
    await page.fill("#board-file", str(filmed / "charuco.toml"))
    await page.click("#calibrate")
    await page.locator("#use-calibration:focus").wait_for(timeout=300_000)
    assert await page.locator("#board-cameras path.corners").count() == 8
    await page.click("#use-calibration")
    await shows(page, "document.querySelectorAll('#rig .rig-camera').length === 8")
    assert await page.input_value("#new-calibration") == str(filmed / "calibration.toml")
