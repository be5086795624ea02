"""Notes on the shown pose over the images: limbs that a fit moved by itself, depth that no view showed."""

import pytest
from page_driver import shows, until

COMPARED = {
    "number": 4, "work": "fit", "before_px": 5.74, "after_px": 5.44, "before_view_costs_px": [],
    "after_view_costs_px": [], "warning": "", "is_before_shown": False,
    "moved": [
        {"person": 1, "limb": "left arm", "distance_cm": 21.3}, {"person": 0, "limb": "right leg", "distance_cm": 12.0}
    ],
}  # fmt: skip


async def tell(endpoint, **state):
    endpoint.state |= state
    await endpoint.broadcast(endpoint.state)


@pytest.mark.endpoint(n_people=2)
async def test_a_limb_that_a_fit_moved_by_itself_is_named_and_taken_back(page, endpoint):
    await tell(endpoint, compared=COMPARED)
    notes = page.locator("#pose-notes li")
    await notes.nth(1).wait_for()
    texts = await notes.all_inner_texts()
    assert "moved the left arm of person 1 by 21 cm, which nobody had touched" in texts[0]
    assert "right leg of person 0 by 12 cm" in texts[1]
    await notes.get_by_role("button", name="Take back").click()
    await until(lambda: endpoint.heard("limb_back") == [{"type": "limb_back", "frame": 12}])
    await tell(endpoint, compared=COMPARED | {"moved": COMPARED["moved"][1:]})
    await shows(page, "document.querySelectorAll('#pose-notes li').length === 1")
    await page.keyboard.press("Alt+b")
    await until(lambda: len(endpoint.heard("limb_back")) == 2)
    await tell(endpoint, compared=COMPARED | {"number": 5, "moved": []})
    await shows(page, "document.querySelectorAll('#pose-notes li').length === 0")
    await page.keyboard.press("Alt+b")
    await page.locator("#notices .notice", has_text="moved no limb").wait_for()
    assert len(endpoint.heard("limb_back")) == 2


@pytest.mark.slow
async def test_the_former_place_of_a_limb_is_drawn_and_explained(page, endpoint):
    endpoint.other_kind = "former"
    await endpoint.send_overlay()
    legend = page.locator("#pose-legend", has_text="limb before the fit")
    await legend.wait_for()


@pytest.mark.endpoint(n_people=2)
async def test_a_fit_can_be_limited_to_a_person_or_a_limb(page, endpoint):
    await page.keyboard.press("Alt+g")
    await page.locator("#notices .notice", has_text="Select a joint of the limb first").wait_for()
    await page.locator("#fit-choices").click()
    items = page.locator("#fit-menu button")
    assert [" ".join(text.split()) for text in await items.all_inner_texts()] == [
        "All placed people G", "Only person 0", "Only a limb select a joint"
    ]  # fmt: skip
    assert await items.nth(2).is_disabled()
    await page.keyboard.press("Escape")
    await tell(endpoint, point="l_elbow")
    await shows(page, "quadrille.state.state.point === 'l_elbow'")
    await page.keyboard.press("Alt+g")
    await page.locator("#fit-choices").click()
    for name in ("Only the left arm", "Only person 0", "All placed people"):
        if not await items.first.is_visible():
            await page.locator("#fit-choices").click()
        await items.filter(has_text=name).click()
    await until(lambda: len(endpoint.heard("fit")) == 4)
    limb = {"type": "fit", "frame": 12, "person": 0, "point": "l_elbow"}
    assert endpoint.heard("fit") == [
        limb, limb, {"type": "fit", "frame": 12, "person": 0}, {"type": "fit", "frame": 12, "person": None}
    ]  # fmt: skip


async def test_the_view_across_is_named_and_fills_the_grid(page, endpoint):
    await page.keyboard.press("Alt+v")
    await page.locator("#notices .notice", has_text="The views have shown the depth").wait_for()
    await tell(endpoint, unseen_depth={"person": 0, "points": ["l_wrist", "l_knee"], "camera": 1})
    note = page.locator("#pose-notes li")
    await note.wait_for()
    assert "No view has shown the depth of the l wrist and 1 more: drag it in RIGHT" in await note.inner_text()
    await note.get_by_role("button", name="Show RIGHT").click()
    await shows(page, "quadrille.state.filled === 1 && !document.querySelector('#pose-notes button')")
    await page.keyboard.press("2")
    await shows(page, "quadrille.state.filled === null")
    await page.keyboard.press("Alt+v")
    await shows(page, "quadrille.state.filled === 1")
    await tell(endpoint, unseen_depth=None)
    await shows(page, "document.querySelectorAll('#pose-notes li').length === 0")
    await page.keyboard.press("2")
