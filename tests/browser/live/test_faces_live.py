"""Heads of placed people can be blurred in the page."""

import pytest
from page_driver import handle_of, shows, toggle_layer
from program import READY

DETAIL = """([u, v, half]) => {
  const canvas = document.querySelectorAll(".pane-overlay")[0];
  const box = canvas.getBoundingClientRect();
  const [a, b] = [quadrille.toClient(0, u - half, v - half), quadrille.toClient(0, u + half, v + half)];
  const at = [a.x - box.left, a.y - box.top, b.x - a.x, b.y - a.y].map((n) => Math.round(n * devicePixelRatio));
  const { data, width } = canvas.getContext("2d").getImageData(...at);
  let sum = 0;
  for (let i = 4; i < data.length; i += 4) if ((i / 4) % width) sum += Math.abs(data[i] - data[i - 4]);
  return sum / data.length;
}"""
"""JavaScript: how much neighbouring pixels differ in a square of undistorted pixels of the first camera."""


@pytest.mark.slow
async def test_heads_are_reduced_to_grains_and_all_else_stays(tab):
    await shows(tab, READY, 60)
    for layer in ("contours", "joints"):
        await toggle_layer(tab, layer)
    u, v = await handle_of(tab, 0, "head")
    places = {"head": [u, v, 8], "beside": [u + 150, v, 8]}
    await tab.wait_for_timeout(500)
    before = {name: await tab.evaluate(DETAIL, place) for name, place in places.items()}
    await toggle_layer(tab, "faces")
    await shows(tab, "quadrille.state.layers.shown.faces")
    await tab.wait_for_timeout(500)
    assert await tab.evaluate(DETAIL, places["head"]) < 0.5 * before["head"]
    assert await tab.evaluate(DETAIL, places["beside"]) == before["beside"]
