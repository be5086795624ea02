"""How the browser tests drive the page and look at it."""

import asyncio
import json
from contextlib import asynccontextmanager

GUTTER_PX, PADDING_PX = 52, 8
"""Left of the frames on timeline and curves, and right of them."""

OPENED = "window.quadrille?.state.overlay && quadrille.state.overlay.frame === quadrille.state.shown?.frame"
"""That a page shows its first frame, for `shows`."""

DRAWN = """[...document.querySelectorAll(".pane-overlay")].reduce((sum, canvas) => {
  const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
  const people = quadrille.state.session.people.map(({ color }) => parseInt(color.slice(1), 16));
  for (let i = 0; i < data.length; i += 4)
    if (people.includes((data[i] << 16) | (data[i + 1] << 8) | data[i + 2])) sum++;
  return sum;
}, 0)"""
"""JavaScript: how many pixels of all panes have exactly a person's colour; the images have none."""


async def shows(page, expression, timeout_s=20.0):
    """Wait until a JavaScript expression holds and the page has drawn it.

    The page's policy forbids evaluating strings, which Playwright's own waiting does inside the page.
    """
    drawn = f"""async (timeout) => {{
      const pause = (ms) => new Promise((resolve) => setTimeout(resolve, ms));
      for (const until = performance.now() + timeout; !({expression}); await pause(20)) {{
        if (performance.now() > until) return false;
      }}
      await new Promise((resolve) => requestAnimationFrame(() => setTimeout(resolve)));
      return true;
    }}"""
    if not await page.evaluate(drawn, 1000 * timeout_s):
        raise AssertionError(f"after {timeout_s} s the page still does not show: {expression}")


async def go_to(page, frame):
    """Type the number of a frame, and wait until it is shown."""
    await page.locator("#frame").fill(str(frame))
    await page.keyboard.press("Enter")
    await page.locator("#frame").blur()
    await shows(page, f"quadrille.state.shown.frame === {frame} && quadrille.state.overlay.frame === {frame}", 30)


async def reloaded(page, expression=OPENED, *timeout_s):
    """Load the page again, and wait until an expression holds there."""
    await page.reload()
    await shows(page, expression, *timeout_s)


async def until(condition, timeout_s=20.0):
    """Wait until a condition of the fake endpoint holds.

    It does not hold yet where it looks at the last message and none has come.
    """
    async with asyncio.timeout(timeout_s):
        while not _holds(condition):
            await asyncio.sleep(0.02)


def _holds(condition):
    try:
        return condition()
    except IndexError:
        return False


async def handle_of(page, camera, point, person=0):
    """Undistorted pixel of a joint, as last drawn."""
    handles = await page.evaluate("quadrille.state.overlay.handles")
    wanted = (camera, point, person)
    return next((h["u"], h["v"]) for h in handles if (h["camera"], h["point"], h["person"]) == wanted)


TO_CLIENT = """([c, u, v]) => new Promise((resolve) => {
  requestAnimationFrame(() => setTimeout(() => resolve(quadrille.toClient(c, u, v))));
})"""


async def to_client(page, camera, u, v):
    """The place of a pixel on the page, once the views have the size that they get in the next picture."""
    at = await page.evaluate(TO_CLIENT, [camera, u, v])
    return at["x"], at["y"]


def drags_of(page):
    """The drag messages that a page sends, as they go; to be asked for before it opens."""
    sent = []

    def hear(frame):
        message = json.loads(frame) if isinstance(frame, str) else {}
        if message.get("type") == "drag":
            sent.append(message)

    page.on("websocket", lambda socket: socket.on("framesent", hear))
    return sent


async def state_of(page):
    return await page.evaluate("quadrille.state")


async def frame_place(page, frame, share=0.5, chart="#timeline", is_whole=False):
    """Place of a frame at a share of the height of a chart, window pixels; `is_whole`: of the overview."""
    box, state = await page.locator(chart).bounding_box(), await state_of(page)
    span = (not is_whole and state["visible"]) or {"start": 0, "end": state["session"]["n_frames"]}
    at = (frame + 0.5 - span["start"]) / (span["end"] - span["start"])
    return box["x"] + GUTTER_PX + at * (box["width"] - GUTTER_PX - PADDING_PX), box["y"] + share * box["height"]


async def point_of_curve(page, index, frame):
    """Place of a point of the upper plot of curves, as the pointer finds it with all other curves hidden."""
    for other in {0, 1, 2, 3} - {index}:
        await page.locator(".legend-switch").nth(other).click()
    for percent in range(1, 50, 2):
        x, y = await frame_place(page, frame, percent / 100, "#curves")
        await page.mouse.move(x, y)
        if await page.evaluate("document.querySelector('#curves').classList.contains('is-grab')"):
            return x, y + 5
    raise AssertionError(f"no point of curve {index} on frame {frame} can be dragged")


async def drag_mouse(page, start, end, steps=3, button="left"):
    await page.mouse.move(*start)
    await page.mouse.down(button=button)
    await page.mouse.move(*end, steps=steps)
    await page.mouse.up(button=button)


async def turn_wheel(page, at, by_px):
    await page.mouse.move(*at)
    await page.mouse.wheel(0, by_px)


async def drag_up(page, at, by_px):
    """Drag from a place upwards, and hold the button."""
    await page.mouse.move(*at)
    await page.mouse.down()
    await page.mouse.move(at[0], at[1] - by_px, steps=3)


@asynccontextmanager
async def dragging(page, camera, point, *steps_px):
    """Drag a joint along offsets, in undistorted px from where it lies; the button is down inside the block."""
    u, v = await handle_of(page, camera, point)
    await page.mouse.move(*await to_client(page, camera, u, v))
    await page.mouse.down()
    for du, dv in steps_px:
        await page.mouse.move(*await to_client(page, camera, u + du, v + dv))
    yield u, v
    await page.mouse.up()


async def command(page, label):
    """Run a command of the page by its label, as its key would; another word is a key, which is pressed."""
    if not await page.evaluate("(label) => quadrille.command(label)", label):
        await page.keyboard.press(label)


async def toggle_layer(page, layer):
    """Show or hide a layer of the views, by the menu of layers."""
    await page.locator(f"[data-layer={layer}]").evaluate("(box) => box.click()")
