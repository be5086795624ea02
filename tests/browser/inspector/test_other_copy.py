"""The section of the other copy: where it differs, the way through it, and what it asks of the program."""

import pytest
from page_driver import command, shows, until


def difference(frame, joint, distance_mm, decided=False):
    return {"frame": frame, "joint": joint, "distance_mm": distance_mm, "decided": decided}


COPY = {
    "type": "other_copy", "name": "ben", "own_name": "anna", "tolerance_mm": 20, "notes": ["the bodies differ"],
    "posed": [True],
    "people": [[
        difference(12, "l_wrist", 55.5), difference(20, "head", 4.0), difference(30, "r_wrist", 90.0),
        difference(40, "l_knee", 70.0, decided=True),
    ]],
}  # fmt: skip
NONE = COPY | {"name": "", "own_name": "", "tolerance_mm": 0, "notes": [], "posed": [], "people": []}


@pytest.fixture
def section(page):
    return page.locator("[data-section=copy]")


async def opened(page, endpoint, message=COPY):
    await command(page, "Inspector: sizes, settings (toggle)")
    await page.evaluate("document.querySelector('[data-section=copy]').open = true")
    await endpoint.broadcast(message)
    await shows(page, "quadrille.state.otherCopy !== null")


async def test_differences_are_counted_listed_and_visited(page, endpoint, section):
    height = "document.querySelector('#timeline').clientHeight"
    before = await page.evaluate(height)
    await opened(page, endpoint)
    text = await section.inner_text()
    assert "anna and ben: 4 poses were annotated by both. 2 differ by more than the tolerance, 1 decided." in text
    assert "Note: the bodies differ." in text
    assert "Frame 12: the l wrist is 56 mm apart." in text
    assert await page.evaluate(height) > before  # the lane
    rows = await page.locator("[data-section=copy] .observed-worst li").all_inner_texts()
    assert [row.split()[0] for row in rows] == ["30", "12"]
    await section.locator(".observed-worst button").first.click()
    await until(lambda: {"type": "select", "person": 0, "point": "r_wrist"} in endpoint.received)
    await shows(page, "quadrille.state.target === 30")
    await command(page, "Previous frame where the copies differ")
    await shows(page, "quadrille.state.target === 12")
    await endpoint.broadcast(NONE)
    await shows(page, "quadrille.state.otherCopy === null")
    assert await page.evaluate(height) == before
    assert await section.get_by_label("Folder", exact=True).is_visible()


async def test_decisions_and_the_tolerance_are_sent(page, endpoint, section):
    await opened(page, endpoint)
    for name, action in (("Keep mine", "keep"), ("Take theirs", "take"), ("Mean", "mean"), ("End", "leave")):
        await section.get_by_role("button", name=name, exact=True).click()
        wanted = {"type": "other_copy", "action": action, "person": 0, "frame": 0 if action == "leave" else 12}
        await until(lambda w=wanted: endpoint.received[-1] == w)
    field = section.get_by_label("Tolerance, mm")
    await field.fill("60")
    await field.press("Enter")
    await until(lambda: endpoint.received[-1] == {"type": "other_copy", "action": "tolerance", "tolerance_mm": 60})
    await endpoint.broadcast(COPY | {"tolerance_mm": 60})
    await section.get_by_text("1 differs by more than the tolerance").wait_for()


async def test_a_frame_without_their_pose_needs_no_decision(page, endpoint, section):
    await opened(page, endpoint, COPY | {"posed": [False], "people": [[]]})
    for name in ("Keep mine", "Take theirs", "Mean"):
        assert await section.get_by_role("button", name=name, exact=True).is_disabled()
    assert "Frame 12: ben has no pose." in await section.inner_text()


async def test_a_folder_that_is_refused_is_said_beside_the_field(page, endpoint, section):
    await command(page, "Inspector: sizes, settings (toggle)")
    await page.evaluate("document.querySelector('[data-section=copy]').open = true")
    await page.route("**/sessions/paths*", lambda route: route.fulfill(body="[]", content_type="application/json"))
    await page.route("**/copies/open", lambda route: route.fulfill(status=400, body="expected a copy, found none"))
    async with page.expect_response("**/sessions/paths*"):  # names are completed a moment after typing
        await section.get_by_label("Folder", exact=True).fill("/nowhere")
    await section.get_by_role("button", name="Compare", exact=True).click()
    await section.get_by_text("expected a copy, found none").wait_for()
    for address in ("**/copies/open", "**/sessions/paths*"):
        await page.unroute(address)
    page.errors.clear()  # the browser reports the refusal, too
