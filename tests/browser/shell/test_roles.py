"""Pages with a shared link, against `fake_endpoint`: what they show, and what they send."""

import pytest
from page_driver import command, reloaded, shows, until
from playwright.async_api import expect

ANNOTATING = ("#joint-bar", "#undo", "#toggle-keyframe", "#track-forward", "#search-frame", "#show-export")


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
    for control in (*ANNOTATING, "#inspector", "#play", "#toggle-reviewed"):
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


@pytest.mark.slow
async def test_a_review_sees_the_plan_alone(page, endpoint):
    await join(page, endpoint, "review")
    await command(page, "Plan, tasks and comments")
    await expect(page.locator("[data-section=annotation]")).to_be_visible()
    await expect(page.locator("[data-section=body]")).to_be_hidden()
    await expect(page.locator("#plan-frames")).to_be_hidden()


@pytest.mark.slow
async def test_a_link_asks_for_a_name_and_then_moves_by_itself(page, endpoint):
    await join(page, endpoint, "look")
    await page.keyboard.press("End")
    assert endpoint.received == [], "without a name the page shows what the host shows"
    await page.locator("#join-bar").get_by_label("Your name, to look around").fill("Lou Q")
    await page.keyboard.press("Enter")
    await until(lambda: endpoint.name_asked == "Lou Q")
    await expect(page.locator("#join-bar")).to_be_hidden()
    await expect(page.locator("#play")).to_be_visible()
    await page.keyboard.press("End")
    await until(lambda: endpoint.received[-1]["type"] == "seek")
    await command(page, "People on this session, and your name")
    await expect(page.locator("#participants-list")).to_contain_text("Lou Q (you)")
    await page.keyboard.press("Escape")
    await reloaded(page, "window.quadrille?.state.presence?.name === 'Lou Q'")


@pytest.mark.slow
async def test_others_have_marks_at_their_frames(page, endpoint):
    await join(page, endpoint, "review")
    await expect(page.locator("#participant-chips .participant-chip")).to_have_text(["A"])
    await expect(page.locator(".place-mark")).to_have_attribute("title", "Anna is on frame 0")


async def test_the_list_of_a_host_who_is_alone_opens_below_its_button(page):
    button, panel = page.locator("#show-participants"), page.locator("#participants-panel")
    assert not await button.is_visible()
    await command(page, "People on this session, and your name")
    above, below = await button.bounding_box(), await panel.bounding_box()
    assert below["y"] >= above["y"] + above["height"]
    await page.keyboard.press("Escape")
    await shows(page, "document.querySelector('#show-participants').hidden")


@pytest.mark.slow
async def test_the_note_in_place_of_the_3d_view_covers_nothing(page, endpoint):
    endpoint.role = "review"
    await reloaded(page, "!document.querySelector('#scene-note').hidden")
    await command(page, "Plan, tasks and comments")
    await expect(page.locator("[data-section=annotation]")).to_be_visible()
    note, column = [await page.locator(one).bounding_box() for one in ("#scene-note", "#inspector")]
    assert note["x"] + note["width"] <= column["x"]
