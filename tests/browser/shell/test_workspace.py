"""Widths of the panes and the 3-D view, and how the 3-D view folds away."""

import pytest
from page_driver import command, drag_mouse, reloaded, shows, until

SMALL = {"width": 1280, "height": 720}


async def widths(page):
    """Of the first pane and of the 3-D view, 0 where it is hidden."""
    scene = page.locator("#scene")
    pane = await page.locator(".pane").first.bounding_box()
    return pane["width"], (await scene.bounding_box())["width"] if await scene.is_visible() else 0


@pytest.mark.slow
async def test_the_3d_view_leaves_its_room_where_inspector_and_search_leave_none(page):
    await page.set_viewport_size(SMALL)
    await command(page, "Search panel")
    assert (await widths(page))[1] > 300
    await command(page, "Inspector: sizes, settings (toggle)")
    await shows(page, "document.querySelector('.is-scene-folded')")
    pane, scene = await widths(page)
    assert pane > 240  # 172 beside the 3-D view
    assert scene == 0
    inspector = await page.locator("#inspector").bounding_box()
    assert inspector["x"] + inspector["width"] == SMALL["width"]
    # On request it is there, also after a reload.
    button = page.locator("#show-scene")
    assert await button.get_attribute("aria-pressed") == "false"
    await button.click()
    assert (await widths(page))[1] >= 290
    await reloaded(page)
    assert (await widths(page))[1] >= 290
    await command(page, "3-D view: fold away or open (toggle)")
    assert (await widths(page))[1] == 0
    # Elsewhere nothing is folded: this was the automatic choice.
    await command(page, "Inspector: sizes, settings (toggle)")
    await shows(page, "!document.querySelector('.is-scene-folded')")


async def test_the_separator_folds_the_3d_view_away_and_opens_it(page, endpoint):
    bar = page.locator("#split")

    async def drag_to(x):
        box = await bar.bounding_box()
        await drag_mouse(page, (box["x"] + 2, 300), (x, 300), steps=4)

    await drag_to(1400)
    assert (await widths(page))[1] == 0
    await reloaded(page)
    assert (await widths(page))[1] == 0
    await drag_to(900)
    assert abs((await widths(page))[1] - (1440 - 900)) < 5
    await bar.focus()
    await page.keyboard.press("Enter")
    assert (await widths(page))[1] == 0
    # Who looks through a camera wants to see it.
    await command(page, "3-D view: look through the active camera (toggle)")
    await until(lambda: endpoint.heard("snap"))
    await shows(page, "!document.querySelector('.is-scene-folded')")
    assert (await widths(page))[1] > 300
