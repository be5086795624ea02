"""The 3-D view's animation frames wait where no graphics card draws them and the panes are at work."""

import asyncio

import pytest
from page_driver import dragging, shows, until

COUNT = """async () => {
  const view = document.querySelector('#scene').contentWindow;
  view.drawn = 0;
  view.dropped = 0;
  const draw = () => {
    view.drawn += 1;
    view.requestAnimationFrame(draw);
  };
  view.requestAnimationFrame(draw);
  view.cancelAnimationFrame(view.requestAnimationFrame(() => (view.dropped += 1)));
}"""


DRAWN = """([key, ms]) => new Promise((resolve) => {
  const view = document.querySelector('#scene').contentWindow;
  if (key) document.body.dispatchEvent(new KeyboardEvent("keydown", { key, bubbles: true }));
  const before = view.drawn;
  setTimeout(() => resolve(view.drawn - before), ms);
})"""
SO_FAR = "document.querySelector('#scene').contentWindow.drawn"


async def drawn(page, ms=300, key=None):
    """Animation frames of the 3-D view in some time, after a key, by the page's own clock."""
    return await page.evaluate(DRAWN, [key, ms])


async def draws(page, n=4, seconds=8):
    """Whether it draws some frames: where it waits there are two at most in that time."""
    before = await page.evaluate(SO_FAR)
    await shows(page, f"{SO_FAR} >= {before + n}", seconds)
    return True


@pytest.mark.slow
async def test_it_waits_for_the_panes(page, endpoint):
    await shows(page, "document.querySelector('#scene').contentDocument.readyState === 'complete'")
    await page.evaluate(COUNT)
    await once_loaded(page)
    await while_a_hand_drags(page)
    await while_frames_go_by(page)
    await beside_a_search(page, endpoint)


async def once_loaded(page):
    """Nothing waits, not even for a hand, until it has faded in; nor afterwards while nothing goes on."""
    async with dragging(page, 0, "l_wrist", (10, 0), (20, 0)):
        assert await draws(page)
    await asyncio.sleep(8.5)
    assert await draws(page)
    assert await page.evaluate("document.querySelector('#scene').contentWindow.dropped") == 0


async def while_a_hand_drags(page):
    async with dragging(page, 0, "l_wrist", (10, 0), (20, 0)):
        await shows(page, "quadrille.state.dragging")
        assert await drawn(page) == 0
        await page.set_viewport_size({"width": 1300, "height": 900})
        assert await draws(page, 1)  # else it would be empty in its new size
        await asyncio.sleep(0.6)
        assert await drawn(page) == 0
    await shows(page, "!quadrille.state.dragging")
    assert await draws(page)


async def while_frames_go_by(page):
    for _ in range(4):
        assert await drawn(page, 100, key=".") <= 1
    await asyncio.sleep(0.5)
    assert await draws(page)


async def beside_a_search(page, endpoint):
    """A pointer over the view resumes it."""
    box = await page.locator("#scene").bounding_box()
    await page.keyboard.press("f")
    await until(lambda: endpoint.state["job"]["running"])
    assert await drawn(page, 200) <= 1
    await page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    assert await draws(page, 2)
