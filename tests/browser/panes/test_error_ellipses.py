"""The switch of the error ellipses: in the inspector, in the palette, kept in the browser; the error of a joint."""

from fake_endpoint import COLORS, REST
from page_driver import command, handle_of, reloaded, shows, until

LAYER = "quadrille.state.layers.shown.errors"
ERRORS_M = [0.023 if name == "l_elbow" else 0.1 for name in REST]
ON_CIRCLE = """([u, v]) => {
  const canvas = document.querySelectorAll(".pane-overlay")[0];
  const box = canvas.getBoundingClientRect();
  const { x, y } = quadrille.toClient(0, u, v);
  const at = [(x - box.left) * devicePixelRatio, (y - box.top) * devicePixelRatio].map(Math.floor);
  return [...canvas.getContext("2d").getImageData(...at, 1, 1).data].slice(0, 3);
}"""
"""JavaScript: the colour at a pixel of the first camera."""


async def open_inspector(page):
    await command(page, "Inspector: sizes, settings (toggle)")
    await page.evaluate(
        "document.querySelectorAll('.section').forEach((s) => (s.open = ['joint', 'view'].includes(s.dataset.section)))"
    )
    return page.locator(".row", has=page.get_by_text("Error ellipses", exact=True)).locator("input")


async def is_drawn(page):
    """Whether the circle is drawn in the person's colour, 40 px to the right of the head."""
    u, v = await handle_of(page, 0, "head")
    found = await page.evaluate(ON_CIRCLE, [u + 40, v])
    wanted = bytes.fromhex(COLORS[0][1:])
    return all(abs(a - b) < 60 for a, b in zip(found, wanted, strict=True))


async def test_ellipses_are_switched_on_in_the_inspector_and_kept(page, endpoint):
    await endpoint.tell(expected_errors_m=ERRORS_M)
    switch = await open_inspector(page)
    assert not await switch.is_checked()
    assert not await is_drawn(page)
    await switch.check()
    await until(lambda: "errors" in endpoint.views[-1]["layers"])
    await shows(page, "quadrille.state.overlay.paths.some((path) => path.kind === 'error')")
    assert await is_drawn(page)
    await reloaded(page, f"window.quadrille?.state.overlay?.paths.some((path) => path.kind === 'error') && {LAYER}")
    assert await switch.is_checked()
    await page.keyboard.press("Control+k")
    await page.keyboard.type("hide error ellipses")
    await page.keyboard.press("Enter")
    await shows(page, f"!{LAYER}")
    await until(lambda: "errors" not in endpoint.views[-1]["layers"])
    assert not await switch.is_checked()
    assert not await is_drawn(page)


async def test_the_inspector_says_where_errors_come_from_while_none_are_known(page, endpoint):
    switch = await open_inspector(page)
    why = page.get_by_text("they come from tracking over the whole run")
    assert await why.is_hidden()
    await switch.check()
    await why.wait_for()
    await until(lambda: "errors" in endpoint.views[-1]["layers"])
    await endpoint.tell(expected_errors_m=ERRORS_M)
    await why.wait_for(state="hidden")


async def test_the_selected_joint_shows_its_expected_error(page, endpoint):
    await open_inspector(page)
    error = page.get_by_text("Expected error")
    assert await error.is_hidden()
    await endpoint.tell(expected_errors_m=ERRORS_M, point="l_elbow")
    await error.wait_for()
    assert await error.inner_text() == "Expected error 23 mm"
    await endpoint.tell(point="l_wrist")
    await shows(page, "document.querySelector('[data-section=joint]').textContent.includes('Expected error 100 mm')")
    await endpoint.tell(expected_errors_m=[])
    await error.wait_for(state="hidden")
