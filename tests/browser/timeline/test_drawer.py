"""The drawer closes when it is empty, belongs to its session, and leaves the lanes of the timeline their room."""

import pytest
from page_driver import OPENED, command, reloaded, shows

EMPTY = {"type": "timeline", "person": None, "cells": {}, "replace": True}


@pytest.mark.slow
async def test_a_drawer_opens_again_in_its_session_only_and_only_with_content(page, endpoint):
    await page.keyboard.press("c")
    await shows(page, "quadrille.state.drawer === 'arms'")
    await reloaded(page, f"{OPENED} && quadrille.state.drawer === 'arms'")
    await page.evaluate("localStorage.setItem('quadrille.drawer.elbow_rotation', '\"runs\"')")
    await reloaded(page)
    await page.wait_for_timeout(300)
    assert await page.locator("#drawer").is_hidden()  # nothing is compared
    await page.keyboard.press("c")
    await page.evaluate("localStorage.setItem('quadrille.drawer.other', '\"arms\"')")
    await page.evaluate("localStorage.removeItem('quadrille.drawer.elbow_rotation')")
    await reloaded(page)
    await page.wait_for_timeout(300)
    assert await page.locator("#drawer").is_hidden()


@pytest.mark.slow
async def test_a_drawer_whose_content_is_gone_closes(page, endpoint):
    await page.keyboard.press("c")
    await shows(page, "quadrille.state.drawer === 'arms'")
    await endpoint.broadcast(EMPTY)
    await shows(page, "quadrille.state.drawer === null")
    # On request it opens all the same, and says why it is empty.
    await page.keyboard.press("c")
    await shows(page, "quadrille.state.drawer === 'arms'")
    await endpoint.broadcast(EMPTY)
    await page.wait_for_timeout(300)
    assert await page.locator("#drawer").is_visible()


async def test_a_search_drawer_without_searches_stays_as_opened(page, endpoint):
    """The list of searches comes only after the drawer has been opened."""
    await command(page, "Search panel")
    await shows(page, "quadrille.state.drawer === 'search'")
    await endpoint.broadcast(endpoint.state | {"undo": "drag torso, frame 12"})
    await shows(page, "quadrille.state.state.undo !== null")
    await endpoint.broadcast({"type": "search_runs", "runs": [], "replay": None, "compared": None})
    await shows(page, "quadrille.state.searchRuns?.runs.length === 0")
    await page.wait_for_timeout(300)
    assert await page.locator("#drawer").is_visible()


@pytest.mark.slow
@pytest.mark.parametrize("endpoint", [{"n_people": 2}, {"n_people": 8}], indirect=True, ids=["2", "8"])
@pytest.mark.parametrize("height", [720, 1080])
async def test_no_lane_of_the_timeline_is_cut_off(page, endpoint, height):
    for kind in ("search", "curves", "doubts"):
        await page.evaluate("(kind) => localStorage.setItem(`quadrille.drawer-height-${kind}`, '2000')", kind)
    await page.set_viewport_size({"width": 1280, "height": height})
    for key in ("Search panel", "c", "Doubtful and lost poses, most severe first"):
        await command(page, key)
        await shows(page, "document.querySelector('#drawer').offsetHeight > 0")
        timeline = await page.locator("#timeline").bounding_box()
        assert timeline["y"] + timeline["height"] <= height
        views = await page.locator("#panes").bounding_box()
        assert views["height"] >= 100
