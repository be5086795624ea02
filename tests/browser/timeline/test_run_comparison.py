"""The drawer's comparison of the poses of a range with those that they replaced."""

import pytest
from page_driver import command, shows, until

ROWS = "[...document.querySelectorAll('#run-comparison-rows tr')]"


def pose(frame, cost_px, other_cost_px, status, other_status, apart_mm):
    return {
        "frame": frame, "method": "contour", "other_method": "chamfer", "cost_px": cost_px,
        "other_cost_px": other_cost_px, "status": status, "other_status": other_status, "apart_mm": apart_mm,
        "farthest_mm": 3 * apart_mm, "farthest": "left wrist",
    }  # fmt: skip


COMPARED = {
    "type": "range_comparison", "first": 24, "last": 36,
    "people": [[pose(24, 2.5, 3.0, "good", "lost", 20.0), pose(25, 2.5, 2.25, "doubtful", "good", 40.0),
                pose(26, None, 2.0, "", "good", 30.0)]],
    "stretches": [], "run": None,
}  # fmt: skip


NOTHING = {"type": "range_comparison", "first": None, "last": None, "people": [], "stretches": [], "run": None}


async def open_comparison(page, endpoint):
    await page.locator("#show-curves").click()
    await page.locator("#drawer-tabs").get_by_text("Compare").click()
    await page.locator("#run-comparison-empty").wait_for()
    assert await page.locator("#run-comparison-take").is_disabled()
    await endpoint.broadcast(COMPARED)
    await shows(page, f"{ROWS}.length === 3")


async def test_a_range_is_compared_frame_by_frame(page, endpoint):
    await open_comparison(page, endpoint)
    heads = await page.locator("#run-comparison-table thead th").all_inner_texts()
    assert heads[1:3] == ["Present: contour, cost in px and status", "Replaced: chamfer, cost in px and status"]
    texts = [row.split("\t") for row in await page.locator("#run-comparison-rows tr").all_inner_texts()]
    assert texts[0] == ["24", "2.50", "good", "3.00", "lost", "20.0", "60.0, left wrist"]
    assert texts[2][1:3] == ["–", "–"]
    summary = await page.locator("#run-comparison-text").inner_text()
    assert summary == "3 frames: 30.0 mm apart, present pose cheaper on 1, lost 0 against 1"
    await page.locator("#run-comparison-rows tr").nth(1).click()
    await until(lambda: endpoint.heard("seek"))
    assert endpoint.heard("seek")[-1]["frame"] == 25
    await shows(page, f"{ROWS}[1].classList.contains('is-current') && !{ROWS}[0].classList.contains('is-current')")


@pytest.mark.slow
async def test_the_replaced_poses_are_taken_and_the_comparison_ends(page, endpoint):
    await open_comparison(page, endpoint)
    await page.locator("#run-comparison-take").click()
    await until(lambda: endpoint.heard("range"))
    assert endpoint.heard("range") == [
        {"type": "range", "action": "take_replaced", "first": 24, "last": 36, "person": None}
    ]
    await page.locator("#run-comparison-end").click()
    await until(lambda: endpoint.heard("compare_range"))
    assert endpoint.heard("compare_range") == [{"type": "compare_range", "first": None, "last": None}]
    await endpoint.broadcast(NOTHING)
    await shows(page, "quadrille.state.drawer === null")  # nothing is left to show
    await page.locator("#show-curves").click()
    await shows(page, f"{ROWS}.length === 0 && !document.querySelector('#run-comparison-empty').hidden")


def stretch(first, last, frames, verdict):
    return {"person": 0, "first": first, "last": last, "frames": frames, "verdict": verdict}


async def test_gain_and_harm_of_a_run_are_opened_and_decided_by_stretch(page, endpoint):
    await endpoint.broadcast(NOTHING)
    await endpoint.tell(point="l_wrist")
    await shows(page, "quadrille.state.state.point === 'l_wrist'")  # and nothing is compared
    stretches = [stretch(24, 30, 6, "better"), stretch(31, 31, 1, "worse"), stretch(33, 36, 4, "better")]
    run = COMPARED | {"stretches": stretches, "run": 1}
    await endpoint.broadcast(run)
    await shows(page, f"{ROWS}.length === 3 && quadrille.state.drawer === 'runs'")
    text = await page.locator("#run-comparison-text").inner_text()
    assert text == "Tracked again, 3 frames: better on 10, worse on 1"
    items = page.locator("#run-stretches li")
    assert [" ".join(one.split()) for one in await items.all_inner_texts()] == [
        "Frames 24–30 better on 6 Keep Take back", "Frame 31 worse on 1 Keep Take back",
        "Frames 33–36 better on 4 Keep Take back",
    ]  # fmt: skip
    await items.nth(1).get_by_role("button", name="Take back").click()
    await until(lambda: endpoint.heard("range"))
    assert endpoint.heard("range") == [
        {"type": "range", "action": "take_replaced", "first": 31, "last": 31, "person": 0}
    ]
    await items.first.get_by_role("button", name="Keep").click()
    await shows(page, "document.querySelectorAll('#run-stretches li').length === 2")
    await items.last.get_by_role("button", name="Frames 33–36").click()
    await until(lambda: [m["frame"] for m in endpoint.heard("seek")] == [33])

    await page.keyboard.press("c")
    await shows(page, "quadrille.state.drawer === 'arms'")
    await endpoint.broadcast(run)  # of the same run: it follows an edit
    await shows(page, "quadrille.state.rangeComparison?.run === 1")
    assert await page.evaluate("quadrille.state.drawer") == "arms"
    await endpoint.broadcast(run | {"run": 2})
    await shows(page, "document.querySelectorAll('#run-stretches li').length === 3")
    assert await page.evaluate("quadrille.state.drawer") == "runs"
    await page.locator("#close-drawer").click()
    await until(lambda: endpoint.heard("compare_range"))
    assert endpoint.heard("compare_range") == [{"type": "compare_range", "first": None, "last": None}]


async def test_a_comparison_leaves_a_tab_that_is_opened_after_its_run(page, endpoint):
    await endpoint.broadcast(NOTHING)
    for run, is_opened in enumerate((True, False)):
        for running in (True, False):
            endpoint.state["track"]["running"] = running
            await endpoint.broadcast(endpoint.state)
            await shows(page, f"quadrille.state.state.track.running === {str(running).lower()}")
        if is_opened:
            await command(page, "Doubtful and lost poses, most severe first")
            await shows(page, "quadrille.state.drawer === 'doubts'")
        await endpoint.broadcast(COMPARED | {"stretches": [stretch(24, 30, 6, "better")], "run": run})
        await shows(page, f"quadrille.state.rangeComparison?.run === {run}")
        assert await page.evaluate("quadrille.state.drawer") == ("doubts" if is_opened else "runs")
