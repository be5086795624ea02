"""What the page shows while a frame is on its way, against `fake_endpoint`."""

import asyncio
from contextlib import asynccontextmanager

import pytest
from page_driver import drag_mouse, handle_of, shows, state_of, to_client

GO = """(frame) => {
  const box = document.querySelector("#frame");
  box.value = String(frame);
  box.dispatchEvent(new Event("change"));
  return performance.now();
}"""
COLORS = """() => {
  const canvas = document.querySelector(".pane-overlay");
  const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
  const colors = new Set();
  for (let i = 0; i < data.length; i += 4) if (data[i + 3] === 255) colors.add(data.slice(i, i + 3).join());
  return [...colors];
}"""
"""JavaScript: the colours in the first pane."""
COLORED = "255,180,84"
"""Of the model and its joints."""


async def visit(page, *frames):
    for frame in frames:
        await page.evaluate(GO, frame)
        await shows(page, f"quadrille.state.shown.frame === {frame} && !quadrille.state.placeholder", 15)


@asynccontextmanager
async def slow(page, endpoint, frame):
    """Ask for a frame whose images come at the end of the block."""
    endpoint.held = asyncio.Event()
    await page.evaluate(GO, frame)
    yield
    endpoint.held.set()
    await shows(page, f"quadrille.state.shown.frame === {frame} && !quadrille.state.placeholder", 15)
    endpoint.held = None


@pytest.mark.slow
async def test_the_nearest_frame_stands_in_marked_and_is_replaced_by_the_true_one(page, endpoint):
    await visit(page, 40, 90)
    async with slow(page, endpoint, 45):
        await shows(page, "quadrille.state.placeholder?.frame === 40 && quadrille.state.placeholder.pictures")
        assert await page.locator(".pane-placeholder").all_inner_texts() == ["frame 40, while 45 loads"] * 4
        assert (await state_of(page))["shown"]["frame"] == 90
    assert await page.locator(".pane-placeholder:visible").count() == 0


@pytest.mark.slow
async def test_no_hand_takes_anything_of_a_frame_that_stands_in(page, endpoint):
    await visit(page, 40, 90)
    u, v = await handle_of(page, 0, "l_wrist")
    x, y = await to_client(page, 0, u, v)
    assert COLORED in await page.evaluate(COLORS)
    async with slow(page, endpoint, 45):
        await shows(page, "quadrille.state.placeholder?.pictures")
        assert COLORED not in await page.evaluate(COLORS)  # the model of another frame is not drawn over it
        await drag_mouse(page, (x, y), (x + 20, y + 5))
    assert endpoint.heard("drag") == []
    assert COLORED in await page.evaluate(COLORS)


@pytest.mark.slow
async def test_the_nearest_frame_on_the_screen_stays_and_is_marked(page, endpoint):
    await visit(page, 40)
    async with slow(page, endpoint, 44):
        await shows(page, "quadrille.state.placeholder")
        assert (await state_of(page))["placeholder"] == {"frame": 40, "target": 44, "pictures": False}
        assert await page.locator(".pane-placeholder").first.inner_text() == "frame 40, while 44 loads"


@pytest.mark.slow
async def test_a_hand_that_scrubs_on_is_followed(page, endpoint):
    await visit(page, 20, 60, 100)
    async with slow(page, endpoint, 59):
        for wish, stand_in in ((61, 60), (22, 20), (59, 60)):
            await page.evaluate(GO, wish)
            await shows(
                page,
                f"quadrille.state.placeholder?.frame === {stand_in} && quadrille.state.placeholder.target === {wish}",
            )


@pytest.mark.slow
async def test_playing_shows_no_stand_ins(page, endpoint):
    await visit(page, 5)
    async with slow(page, endpoint, 5):
        await page.keyboard.press("Space")
        await shows(page, "quadrille.state.playing && quadrille.state.target > 5")
        await asyncio.sleep(0.2)
        state = await state_of(page)
        assert (state["shown"]["frame"], state["placeholder"]) == (5, None)
        await page.keyboard.press("Space")
        await page.evaluate(GO, 5)


@pytest.mark.slow
@pytest.mark.parametrize("scheme", ["dark", "light"])
@pytest.mark.endpoint(n_cameras=16, n_frames=100_000)
async def test_the_mark_fits_a_narrow_pane(page, endpoint, scheme):
    await page.set_viewport_size({"width": 1280, "height": 720})
    await page.emulate_media(color_scheme=scheme)
    await visit(page, 99_000)
    async with slow(page, endpoint, 99_999):
        await shows(page, "quadrille.state.placeholder")
        widths = await page.eval_on_selector_all(
            ".pane-placeholder", "all => all.map((m) => [m.scrollWidth, m.clientWidth])"
        )
        assert len(widths) == 16
        assert all(needed <= given for needed, given in widths)
