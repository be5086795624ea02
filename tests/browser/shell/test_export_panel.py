"""The export panel: options of each format, frames, reasons, a download."""

import json

import pytest
from page_driver import shows

import tracker.interchange.exports.formats

FORMATS = [
    {
        "name": name, "title": format.title, "options": ["frames", "only", "skip_lost", *options], "axes": format.axes,
        "units": format.units, "holds_provenance": format.holds_provenance, "numbering": format.numbering,
    }
    for name, options in (("trc", ["axes", "units"]), ("bvh", ["axes", "units"]), ("mp4", ["view"]))
    for format in [tracker.interchange.exports.formats.FORMATS[name]]
]  # fmt: skip
SENT_BACK = {
    "name": "like/mp", "title": "mp, as it came", "options": ["poses"], "axes": "", "units": "",
    "holds_provenance": True, "numbering": "",
}  # fmt: skip


@pytest.mark.endpoint(n_people=2)
async def test_a_format_is_chosen_and_its_file_downloaded(fresh_page):
    page, asked = fresh_page, []

    async def answer(route):
        asked.append(route.request.url.partition("/export")[2])
        if asked[-1] == "":
            await route.fulfill(body=json.dumps([*FORMATS, SENT_BACK]), content_type="application/json")
        elif asked[-1].startswith("/bvh"):
            await route.fulfill(status=400, body="expected poses of 'person 1', found none")
        else:
            header = {"Content-Disposition": "attachment; filename*=UTF-8''my%20dance.mp4"}
            await route.fulfill(body=b"video", headers=header)

    await page.route("**/export**", answer)
    await page.keyboard.press("Control+k")
    await page.keyboard.type("export")
    await page.keyboard.press("Enter")
    await shows(page, "document.querySelector('#export-panel').matches(':popover-open')")
    labels = page.locator("#export-panel label:visible")
    assert await labels.all_inner_texts() == [
        "Format", "People", "Frames", "Poses", "Axes", "Units", "Leave out lost poses", "Add the provenance"
    ]  # fmt: skip
    untitled = "(all) => all.filter((one) => !one.title && !one.labels?.[0]?.title).map((one) => one.outerHTML)"
    assert await page.eval_on_selector_all("#export-panel :is(button, input, select)", untitled) == []
    assert await page.input_value("#export-axes") == "calibration"
    numbering = page.locator("#export-numbering")
    assert await numbering.inner_text() == "Frame# counts from 1: frame 0 of the session is Frame# 1"
    await page.fill("#export-frames", "20-30")
    assert await numbering.inner_text() == "Frame# counts from 1: frame 20 of the session is Frame# 21"
    await page.select_option("#export-format", "bvh")
    assert await numbering.is_hidden()  # it counts like the session
    assert await page.input_value("#export-axes") == "y-up"
    await page.select_option("#export-person", "person 1")
    await page.fill("#export-frames", "5-500")
    await page.keyboard.press("Enter")
    progress = page.locator("#export-progress")
    assert await progress.inner_text() == "Expected frames within 0-119, such as 0-9 or 0, 119, or nothing."
    await page.fill("#export-frames", "5")
    await page.check("#export-skip-lost")
    async with page.expect_event("console"):  # the browser reports each answer of 400
        await page.click("#export-start")
    await shows(page, "document.querySelector('#export-progress.is-failed')?.textContent.includes('found none')")
    assert "/bvh?person=person+1&axes=y-up&units=m&frames=5%3A6&skip_lost=1" in asked
    page.errors.clear()
    await page.select_option("#export-format", "mp4")
    assert await labels.all_inner_texts() == [
        "Format", "People", "Frames", "Poses", "View", "Leave out lost poses", "Add the provenance"
    ]  # fmt: skip
    await page.fill("#export-frames", "3, 7,12")
    await page.select_option("#export-only", "reviewed")
    await page.check("#export-provenance")
    async with page.expect_download() as download:
        await page.click("#export-start")
    assert (await download.value).suggested_filename == "my dance.mp4"
    assert "/mp4?person=person+1&only=reviewed&frames=3%2C7%2C12&skip_lost=1&provenance=1" in asked
    await shows(page, "document.querySelector('#export-progress').textContent === 'Saved my dance.mp4'")
    await page.select_option("#export-format", "like/mp")
    assert await labels.all_inner_texts() == ["Format", "Replace"]
    for choice in ("edited", "all"):
        await page.select_option("#export-poses", choice)
        async with page.expect_download():
            await page.click("#export-start")
        assert f"/like/mp?poses={choice}" in asked
