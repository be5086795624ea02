"""Pages with a shared link, against `fake_endpoint`: what they show, and what they send."""

import pytest
from page_driver import shows
from playwright.async_api import expect

ANNOTATING = (
    "#joint-bar",
    "#undo",
    "#toggle-keyframe",
    "#track-forward",
    "#search-frame",
    "#show-export",
    "#inspector",
)


async def join(page, endpoint, role):
    endpoint.role = role
    for socket in list(endpoint.sockets):
        await socket.close()
    await shows(page, f"document.documentElement.dataset.role === '{role}'")
    endpoint.received.clear()


@pytest.mark.slow
async def test_a_link_to_look_changes_nothing(page, endpoint):
    await join(page, endpoint, "look")
    await expect(page.locator("#role-badge")).to_have_text("Look only")
    for control in (*ANNOTATING, "#play", "#toggle-reviewed"):
        await expect(page.locator(control)).to_be_hidden()
    for key in ("f", "k", "Period", "e", "Control+z", "t"):
        await page.keyboard.press(key)
    await expect(page.get_by_text("This link is to look").first).to_be_visible()
    await page.locator("#show-history").click()
    await shows(page, "quadrille.state.session.role === 'look'")
    assert {m["type"] for m in endpoint.received} <= {"history", "view", "curves", "epipolar"}


@pytest.mark.slow
async def test_a_link_to_review_moves_and_marks(page, endpoint):
    await join(page, endpoint, "review")
    await expect(page.locator("#role-badge")).to_have_text("Review")
    for control in ANNOTATING:
        await expect(page.locator(control)).to_be_hidden()
    await expect(page.locator("#play")).to_be_visible()
    await page.keyboard.press("Home")
    await shows(page, "quadrille.state.shown.frame === 0")
    for key in ("f", "k", "Control+z"):
        await page.keyboard.press(key)
    assert {m["type"] for m in endpoint.received} <= {"seek", "select", "view", "mark"}
    assert {"type": "mark", "toggle": "keyframe"} not in endpoint.received
