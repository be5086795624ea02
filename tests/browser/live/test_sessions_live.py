"""Another session opened from the page of the real program, which starts again at the same address."""

import json
import shutil
import time

import pytest
from command_line import SAMPLE
from page_driver import shows
from program import WITHOUT_3D, Program
from stranger import Errors

pytestmark = pytest.mark.slow


async def test_another_session_takes_the_place_of_the_first(browser, tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    for name in ("walk", "dance"):
        shutil.copytree(SAMPLE, tmp_path / name)
    program = Program(tmp_path / "walk", has_token=True)
    await program.start()
    context = await browser.new_context(viewport={"width": 1280, "height": 720})
    try:
        page = await context.new_page()
        errors = Errors(page)
        await page.add_init_script(WITHOUT_3D)
        await page.goto(program.address, timeout=120_000)
        await page.wait_for_url(lambda url: "token" not in url)
        await shows(page, "window.quadrille?.state.overlay", 120)
        await page.keyboard.press("Control+o")
        await page.keyboard.type(str(tmp_path / "dance"))
        began = time.monotonic()
        async with page.expect_event("load", timeout=60_000):
            await page.keyboard.press("Enter")
        await shows(page, "window.quadrille?.state.overlay && quadrille.state.shown?.frame === 0", 60)
        print(f"another session after {time.monotonic() - began:.1f} s")
        await page.keyboard.press("Control+o")
        await shows(page, f"document.querySelector('#recent-sessions').innerText.includes('{tmp_path / 'walk'}')")
        assert errors.found == []
        assert not (tmp_path / "walk" / "lock.json").exists()
        assert (tmp_path / "dance" / "lock.json").exists()
        recent = json.loads((tmp_path / "state" / "quadrille" / "recent_sessions.json").read_text())
        assert [entry["folder"] for entry in recent] == [str(tmp_path / "dance"), str(tmp_path / "walk")]
    finally:
        await context.close()
        await program.kill()
