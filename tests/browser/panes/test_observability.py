"""The layer of observability: rings around joints, lines before angles, sentences in tooltips and labels."""

import pytest
from fake_endpoint import DOFS
from page_driver import command, handle_of, shows, state_of, to_client, until

SENTENCES = {"known": "extension of the l elbow: known to 2.0 degrees", "unknown": "twist of the torso: not observable"}
RING = """([u, v, away]) => {
  const canvas = document.querySelectorAll(".pane-overlay")[0];
  const box = canvas.getBoundingClientRect();
  const { x, y } = quadrille.toClient(0, u, v);
  const at = [(x - box.left + away) * devicePixelRatio, (y - box.top) * devicePixelRatio].map(Math.floor);
  return [...canvas.getContext("2d").getImageData(...at, 1, 1).data].slice(0, 3);
}"""
"""JavaScript: the colour at some CSS pixels to the right of a pixel of the first camera."""
GOOD, BAD = (95, 220, 194), (246, 90, 128)


def message(frame):
    """Everything is weak, but an elbow that is known and a twist that is not."""
    levels = ["weak"] * len(DOFS)
    levels[3], levels[6] = "known", "unknown"
    return {
        "type": "observability", "frame": frame, "person": 0,
        "dofs": [{"level": level, "sigma": 2.0, "sentence": SENTENCES.get(level, "weak")} for level in levels],
    }  # fmt: skip


async def test_rings_lines_and_sentences(page, endpoint):
    await page.keyboard.press("a")
    await page.locator("[data-layer=observability]").check()
    await until(lambda: "observability" in endpoint.views[-1]["layers"])
    frame = (await state_of(page))["state"]["frame"]
    await endpoint.broadcast(message(frame))
    await shows(page, "quadrille.state.observability !== null")
    elbow = await handle_of(page, 0, "l_elbow")
    at = list(elbow)
    await until_color(page, [*at, 11], GOOD)
    torso = await handle_of(page, 0, "torso")
    await until_color(page, [*torso, 14.5], BAD)  # the second ring
    await command(page, "Inspector: sizes, settings (toggle)")
    await page.evaluate("document.querySelector('[data-section=joint]').open = true")
    x, y = await to_client(page, 0, *at)
    await page.mouse.click(x, y)
    row = page.locator(".row.is-joint").first
    await shows(page, "document.querySelector('.row.is-joint')?.dataset.observed === 'known'")
    assert SENTENCES["known"] in await row.get_attribute("title")
    await page.keyboard.press("a")
    await page.locator("[data-layer=observability]").uncheck()
    await shows(page, "document.querySelector('.row.is-joint').dataset.observed === ''")
    assert SENTENCES["known"] not in await row.get_attribute("title")


@pytest.mark.slow
async def test_figures_of_another_frame_are_not_shown(page, endpoint):
    await page.keyboard.press("a")
    await page.locator("[data-layer=observability]").check()
    frame = (await state_of(page))["state"]["frame"]
    before = await color(page)
    await endpoint.broadcast(message(frame + 1))
    await shows(page, "quadrille.state.observability !== null")
    assert await color(page) == before


async def color(page):
    elbow = await handle_of(page, 0, "l_elbow")
    return await page.evaluate(RING, [*elbow, 11])


async def until_color(page, place, wanted):
    """Wait until a place has a colour."""
    for _ in range(50):
        found = await page.evaluate(RING, place)
        if all(abs(a - b) < 60 for a, b in zip(found, wanted, strict=True)):
            return
        await page.wait_for_timeout(50)
    raise AssertionError(found)
