"""Keys that answer to the last fit or placement: limbs that it moved by itself, depth that no view showed."""

import pytest
from page_driver import command, shows, until


@pytest.mark.endpoint(n_people=2)
async def test_limbs_that_a_fit_moved_by_itself_are_taken_back(page, endpoint):
    await command(page, "Take back the untouched limb that the last fit moved")
    await until(lambda: endpoint.heard("limb_back") == [{"type": "limb_back", "frame": 12}])


@pytest.mark.slow
async def test_the_former_place_of_a_limb_is_drawn_and_explained(page, endpoint):
    endpoint.other_kind = "former"
    await endpoint.send_overlay()
    legend = page.locator("#pose-legend", has_text="limb before the fit")
    await legend.wait_for()


@pytest.mark.endpoint(n_people=2)
async def test_a_fit_can_be_limited_to_a_person_or_a_limb(page, endpoint):
    await command(page, "Fit only the limb of the selected joint")
    await page.locator("#advice-text", has_text="Select a joint of the limb first").wait_for()
    await page.locator("#fit-choices").click()
    items = page.locator("#fit-menu button")
    assert [" ".join(text.split()) for text in await items.all_inner_texts()] == [
        "All placed people", "Only person 0", "Only a limb select a joint"
    ]  # fmt: skip
    assert await items.nth(2).is_disabled()
    await page.keyboard.press("Escape")
    await endpoint.tell(point="l_elbow")
    await shows(page, "quadrille.state.state.point === 'l_elbow'")
    await command(page, "Fit only the limb of the selected joint")
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


async def test_the_view_across_fills_the_grid(page, endpoint):
    await command(page, "Fill the grid with the view that looks across the last placed joint")
    await page.locator("#advice-text", has_text="The views have shown the depth").wait_for()
    await endpoint.tell(view_across=1)
    await shows(page, "quadrille.state.state.view_across === 1")
    await command(page, "Fill the grid with the view that looks across the last placed joint")
    await shows(page, "quadrille.state.filled === 1")
    await page.keyboard.press("2")
