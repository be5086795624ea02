"""The picture without drawing over it: a held key, contours of all kinds, and the corner of a replayed pose."""

import pytest
from page_driver import DRAWN, dragging, shows, toggle_layer, until

REPLAY = {"run": 1, "step": 3, "steps": 9, "stage": "arms"}
LINES = """(() => {
  const canvas = document.querySelector(".pane-overlay");
  const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
  const [red, green, blue] = %s;
  let sum = 0;
  for (let i = 0; i < data.length; i += 4) {
    if (Math.abs(data[i] - red) + Math.abs(data[i + 1] - green) + Math.abs(data[i + 2] - blue) < 30) sum++;
  }
  return sum;
})()"""
"""JavaScript: how many pixels of the first pane have about a colour."""


@pytest.mark.slow
async def test_one_held_key_hides_all_drawing(page, endpoint):
    await page.locator("#quick-layers").get_by_text("Distance").click()
    await shows(page, f"'distance 3' in quadrille.state.shown.pictures && ({DRAWN}) > 200")
    await page.keyboard.down("Backquote")
    await shows(page, f"({DRAWN}) === 0")
    for over in (".pane-cost", ".pane-joint"):
        assert await page.locator(over).first.is_hidden()
    async with dragging(page, 0, "head", (10, 10), (20, 20)):  # nothing is taken that is not seen
        pass
    assert not endpoint.heard("drag")
    await page.keyboard.up("Backquote")
    await shows(page, f"({DRAWN}) > 200 && !quadrille.state.bare")
    # A page that loses the focus does not hear the key go up.
    await page.keyboard.down("Backquote")
    await shows(page, "quadrille.state.bare")
    await page.evaluate("window.dispatchEvent(new Event('blur'))")
    await shows(page, "!quadrille.state.bare")
    await page.keyboard.up("Backquote")
    # The palette has no key to hold: it stays until Esc.
    await page.keyboard.press("Control+k")
    await page.keyboard.type("bare picture")
    await page.keyboard.press("Enter")
    await shows(page, f"({DRAWN}) === 0")
    await page.keyboard.press("Escape")
    await shows(page, f"({DRAWN}) > 200")


@pytest.mark.slow
@pytest.mark.endpoint(n_people=2)
async def test_without_contours_no_dashed_ones_are_left(page, endpoint):
    contours = page.locator("#quick-layers").get_by_text("Contours")
    assert await page.evaluate("quadrille.state.layers.shown.hidden")
    await page.locator("#quick-layers").get_by_text("Joints").click()
    await contours.click()
    await shows(page, f"({DRAWN}) === 0")
    await until(lambda: "hidden" not in endpoint.views[-1]["layers"])
    await contours.click()
    await shows(page, f"({DRAWN}) > 200 && quadrille.state.layers.shown.hidden")
    # Somebody who does not want them does not get them with the others.
    await toggle_layer(page, "hidden")
    await shows(page, "!quadrille.state.layers.shown.hidden")
    for _ in range(2):
        await contours.click()
    await shows(page, f"({DRAWN}) > 200")
    assert not await page.evaluate("quadrille.state.layers.shown.hidden")


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["alternative", "compared", "preview", "result", "new_sizes"])
async def test_contours_of_other_poses_are_contours_too(page, endpoint, kind):
    endpoint.other_kind = kind
    await endpoint.send_overlay()
    pink = LINES % "[255, 157, 242]"
    await shows(page, f"({pink}) > 20")
    await page.locator("#quick-layers").get_by_text("Contours").click()
    await shows(page, f"({pink}) === 0")


@pytest.mark.slow
async def test_the_corner_is_right_about_a_replayed_pose(page, endpoint):
    await endpoint.tell(point="l_wrist", replay=REPLAY)
    await endpoint.send_overlay()
    corner = page.locator(".pane-joint")
    await shows(page, "quadrille.state.state.replay !== null && !document.querySelector('.pane-joint').hidden")
    assert await corner.all_inner_texts() == 2 * ["●\nvisible", "○\nhidden"]
    async with dragging(page, 0, "head", (10, 10), (20, 20)):  # a replayed pose is not edited
        pass
    assert not endpoint.heard("drag")
