"""The epipolar check: lines of the place under the pointer, a place that is kept, the distance of another, Esc."""

import pytest
from page_driver import command, shows, to_client, until

LINES = {"type": "epipolar", "lines": [{"camera": 1, "x0": 0, "y0": 100, "x1": 400, "y1": 180}], "distance": None}
MARKED = """(camera) => {
  const mark = getComputedStyle(document.documentElement).getPropertyValue("--image-mark").trim();
  const canvas = document.querySelectorAll(".pane-overlay")[camera];
  const probe = document.createElement("canvas").getContext("2d");
  probe.fillStyle = mark;
  probe.fillRect(0, 0, 1, 1);
  const [r, g, b] = probe.getImageData(0, 0, 1, 1).data;
  const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
  let count = 0;
  const near = (a, b) => Math.abs(a - b) < 60;
  for (let i = 0; i < data.length; i += 4) {
    if (near(data[i], r) && near(data[i + 1], g) && near(data[i + 2], b)) count += 1;
  }
  return count;
}"""
"""JavaScript: how many pixels of a pane have about the colour of marks."""


def asked(endpoint):
    return [m["points"] for m in endpoint.received if m["type"] == "epipolar"]


async def test_lines_follow_the_pointer_a_click_keeps_them_and_another_measures(page, endpoint):
    hint = page.locator("#epipolar-hint")
    await command(page, "Epipolar lines (toggle)")
    await shows(page, "!document.querySelector('#epipolar-hint').hidden")
    await page.mouse.move(*await to_client(page, 0, 200, 150))
    await until(lambda: asked(endpoint)[-1] == [[0, pytest.approx(200, abs=2), pytest.approx(150, abs=2)]])
    plain = [await page.evaluate(MARKED, camera) for camera in (0, 1)]
    await endpoint.broadcast(LINES)
    await shows(page, "quadrille.state.epipolarLines?.lines.length")
    assert await page.evaluate(MARKED, 1) > plain[1] + 50
    await page.mouse.click(*await to_client(page, 0, 200, 150))
    await shows(page, "quadrille.state.epipolar.kept.length === 1")
    assert await page.evaluate(MARKED, 0) > plain[0]
    assert not [m for m in endpoint.received if m["type"] in ("drag", "select")]
    await page.mouse.move(*await to_client(page, 1, 210, 140))
    await until(lambda: [p[0] for p in asked(endpoint)[-1]] == [0, 1])
    await endpoint.broadcast(LINES | {"distance": {"camera": 1, "px": 5.7, "mm": 48.2}})
    await shows(page, "quadrille.state.epipolarLines?.distance")
    first, second = (await page.evaluate("quadrille.state.session.cameras.map(({ name }) => name)"))[:2]
    said = f"{second}: 5.70 px from the line of {first}, 48 mm at the body. Esc to finish."
    assert await hint.inner_text() == said
    await page.mouse.click(*await to_client(page, 1, 210, 140))
    await shows(page, "quadrille.state.epipolar.kept.length === 2")
    await page.mouse.move(*await to_client(page, 1, 240, 190))
    assert await hint.inner_text() == said  # it stays until the next click
    await page.keyboard.press("Escape")
    await until(lambda: asked(endpoint)[-1] == [])
    assert await hint.is_hidden()
