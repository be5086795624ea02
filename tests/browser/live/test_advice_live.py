"""The line of advice alone leads from an empty session to an export, by mouse, on the real program."""

import shutil

import pytest
from command_line import SAMPLE
from page_driver import shows
from program import started, visited

from tracker.formats.trc import read_trc

SAID = "quadrille.state.advice?.said[0]"


@pytest.mark.slow
async def test_its_buttons_lead_from_an_empty_session_to_an_export(browser, tmp_path):
    pressed = []
    folder = shutil.copytree(SAMPLE, tmp_path / "session")
    async with started(folder) as program, visited(browser, program.address) as page:
        while pressed[-1:] != ["export"]:
            await shows(page, f"{SAID} && {SAID}.level !== 'work'", 600)
            deed, text = await page.evaluate(f"[{SAID}.actions[0]?.deed, {SAID}.text]")
            pressed.append(deed)
            await page.locator(f"#advice [data-deed={deed}]").click()
            if deed != "export":
                await shows(page, f"{SAID}.text !== {text!r} || {SAID}.actions[0]?.deed !== {deed!r}", 600)
        async with page.expect_download() as download:
            await page.locator("#export-start").click()
        await (await download.value).save_as(tmp_path / "out.trc")
    assert (pressed[0], len(read_trc(tmp_path / "out.trc").times)) == ("find", 50)
