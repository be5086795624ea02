"""The bar of the selected joint, against `fake_endpoint`."""

import pytest
from page_driver import shows


@pytest.mark.slow
async def test_angles_have_whole_names_where_there_is_room_and_are_explained(page):
    for width, shown in ((1920, "abduction"), (1280, "abd."), (1100, "abduction")):
        await page.set_viewport_size({"width": width, "height": 720})
        await shows(page, f"document.querySelectorAll('.dof-name')[3].innerText === '{shown}'")
        assert (await page.locator(".dof").nth(3).get_attribute("title")).startswith("torso abduction: leans sideways")
        assert await page.locator("#joint-dofs").evaluate("(list) => list.scrollWidth <= list.clientWidth")
    assert await page.locator("#joint-dofs .dof-name").nth(5).inner_text() == "twist"
