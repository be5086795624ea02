"""The section of the clocks: offsets, nudges, estimates and the pictures of a fast moment."""

import pytest
from page_driver import command, shows, until

CLOCK = {"offset_frames": 0.0, "drift_ms_per_s": 0.0, "found": None}
FOUND = {"offset_frames": -0.118, "drift_ms_per_s": None, "sigma_ms": 1.56, "is_clear": True}
CLOCKS = {
    "type": "clocks", "running": False, "stage": "", "share": 0, "message": "", "failed": False, "way": "sound",
    "cameras": [
        CLOCK, CLOCK | {"offset_frames": 2.5, "drift_ms_per_s": 0.02, "found": FOUND},
        CLOCK | {"found": FOUND | {"is_clear": False}}, CLOCK,
    ],
    "notes": ["the sound and the time code disagree"], "moment": None,
}  # fmt: skip
MOMENT = {"frame": 40, "views": [1, 0], "centers": [[300.0, 200.0], [5.0, 470.0]], "source": "key points"}


async def opened(page, endpoint):
    await command(page, "Inspector: sizes, settings (toggle)")
    await page.evaluate("document.querySelector('[data-section=clocks]').open = true")
    await endpoint.broadcast(CLOCKS)
    found = page.locator("[data-section=clocks]")
    await found.locator("tbody tr").nth(3).wait_for()
    return found


@pytest.mark.slow
async def test_the_chosen_camera_is_nudged_and_a_clear_estimate_taken(page, endpoint):
    section = await opened(page, endpoint)
    fps = await page.evaluate("quadrille.state.session.fps")
    assert (await section.locator("tbody tr").nth(1).inner_text()).split() == [
        "RIGHT", "2.500", f"{2500 / fps:.1f}", "0.020"
    ]  # fmt: skip
    await section.get_by_label("Camera").select_option("RIGHT")
    for name, frames in (("− frame", -1), ("+ ms", fps / 1000)):
        await section.get_by_role("button", name=name, exact=True).click()
        asked = {"type": "clocks", "action": "nudge", "camera": 1, "frames": pytest.approx(frames)}
        await until(lambda asked=asked: endpoint.received[-1] == asked)
    rows = await section.locator("li").all_inner_texts()
    assert rows[0].startswith(f"RIGHT by sound: −0.118 frames, −{118 / fps:.1f} ± 1.6 ms, clear")
    assert "not clear" in rows[1]
    assert "The sound and the time code disagree." in await section.inner_text()
    assert await section.get_by_role("button", name="Take").count() == 1
    await section.get_by_role("button", name="Take").click()
    await until(lambda: endpoint.received[-1] == {"type": "clocks", "action": "take", "camera": 1})
    await section.get_by_label("Estimate by").select_option("Flash")
    await section.get_by_role("button", name="Estimate").click()
    await until(lambda: endpoint.received[-1] == {"type": "clocks", "action": "estimate", "way": "flash"})


async def test_the_page_goes_to_a_fast_moment_and_shows_both_views(page, endpoint):
    section = await opened(page, endpoint)
    await section.get_by_label("Camera").select_option("RIGHT")  # which was the one beside: they change places
    await section.get_by_role("button", name="Fast moment").click()
    await until(lambda: {"type": "clocks", "action": "moment", "camera": 1, "other": 0} in endpoint.received)
    await endpoint.broadcast(CLOCKS | {"running": True})
    await endpoint.broadcast(CLOCKS | {"moment": MOMENT})
    await shows(page, "quadrille.state.shown.frame === 40")
    assert await section.locator("figcaption").all_inner_texts() == ["RIGHT", "FRONT"]
    assert "Frame 40, by key points." in await section.inner_text()
    drawn = "[...document.querySelectorAll('[data-section=clocks] canvas')].map((c) => c.toDataURL())"
    before = await page.evaluate(drawn)
    assert before[0] != before[1]
