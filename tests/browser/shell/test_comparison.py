"""Before and after of a fit or search in the page: costs, the key that shows the pose before, the warning."""

import pytest
from page_driver import command, shows, until

WARNING = "The fit lowered the cost but left the left wrist 8 cm from where you placed it."
COMPARED = {
    "number": 4, "work": "fit", "before_px": 5.74, "after_px": 5.44, "before_view_costs_px": [6.0, 5.0, 5.9, None],
    "after_view_costs_px": [5.0, 5.6, 5.9, None], "warning": "", "is_before_shown": False,
}  # fmt: skip
TEXT_BOXES = """['#show-comparison', '#cost'].map((one) => {
  const range = document.createRange();
  range.selectNodeContents(document.querySelector(one));
  return range.getBoundingClientRect().toJSON();
})"""
TEXT = "document.querySelector('#show-comparison').textContent"


@pytest.mark.slow
async def test_costs_before_and_after_are_shown_and_one_key_shows_the_pose_before(page, endpoint):
    assert not await page.locator("#show-comparison").is_visible()
    await endpoint.tell(compared=COMPARED, cost_px=5.44)
    await shows(page, f"{TEXT} === '5.74 →'")
    await page.locator("#show-comparison").click()
    rows = await page.locator("#comparison-views tr").all_inner_texts()
    assert [row.split() for row in rows] == [
        ["FRONT", "6.00", "5.00", "▼", "−1.00"],
        ["RIGHT", "5.00", "5.60", "▲", "+0.60"],
        ["BACK", "5.90", "5.90", "0.00"],
        ["LEFT", "–", "–"],
        ["Mean", "5.74", "5.44", "▼", "−0.30"],
    ]
    await page.keyboard.press("Escape")
    await command(page, "Show the pose before the last fit or search, or its result")
    await shows(page, "!document.querySelector('#before-badge').hidden")
    assert "Before the fit: 5.74 px" in await page.locator("#before-badge").inner_text()
    assert await page.locator("#toggle-before").get_attribute("aria-pressed") == "true"
    await page.keyboard.press("Escape")
    await shows(page, "document.querySelector('#before-badge').hidden")
    await until(lambda: [m["shown"] for m in endpoint.heard("before")] == [True, False])
    await endpoint.tell(compared=None)  # the pose has changed since
    await page.locator("#show-comparison").wait_for(state="hidden")
    await command(page, "Show the pose before the last fit or search, or its result")
    await until(lambda: len(endpoint.heard("before")) == 2)


@pytest.mark.slow
@pytest.mark.endpoint(n_people=2)
async def test_the_top_bar_has_room_for_a_comparison(page, endpoint):
    job = endpoint.idle_job("done: 12,345 poses scored")
    compared = COMPARED | {"before_px": 15.74, "warning": WARNING}
    await endpoint.tell(compared=compared, cost_px=15.44, job=job)
    await shows(page, f"{TEXT} === '15.74 →'")
    for width in (1280, 1440, 1520, 1640, 1700, 1770, 1920):
        await page.set_viewport_size({"width": width, "height": 720})
        await shows(page, f"innerWidth === {width}")
        boxes = [await one.bounding_box() for one in await page.locator(".top-bar button:visible").all()]
        assert max(box["x"] + box["width"] for box in boxes) <= width
        assert max(box["y"] + box["height"] for box in boxes) <= 48
        before, cost = await page.evaluate(TEXT_BOXES)
        assert before["height"] < 20  # the mark of the warning stands beside the number
        assert before["bottom"] <= cost["top"] + 4 or before["right"] <= cost["left"]


async def test_a_result_that_disagrees_with_the_placement_says_so_until_the_next_fit(page, endpoint):
    for number, warning in ((4, ""), (5, WARNING), (6, "")):
        await endpoint.tell(compared=COMPARED | {"number": number, "warning": warning})
        await shows(page, f"quadrille.state.state.compared?.number === {number}")
        if warning:
            await page.locator("#show-comparison").click()
            assert await page.locator("#comparison-warning").inner_text() == WARNING
            await page.keyboard.press("Escape")


@pytest.mark.slow
@pytest.mark.parametrize("width", [1280, 1510, 1600, 1640])
async def test_both_costs_have_room_in_the_top_bar(page, endpoint, width):
    await page.set_viewport_size({"width": width, "height": 900})
    await endpoint.tell(compared=COMPARED, cost_px=5.44)
    await shows(page, f"{TEXT} === '5.74 →'")
    heights = "['.cost', '.top-bar'].map((name) => document.querySelector(name).getBoundingClientRect().height)"
    cost, bar = await page.evaluate(heights)
    assert cost <= bar
    usual = await page.locator("#usual-cost").bounding_box()
    assert usual["y"] + usual["height"] <= bar
