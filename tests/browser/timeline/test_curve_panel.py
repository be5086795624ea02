"""The curves against `fake_endpoint`: what is asked for, where it is drawn, and that a click goes to the frame."""

import numpy as np
import pytest
import pytest_asyncio
from fake_endpoint import curve
from page_driver import command, drag_mouse, drag_up, frame_place, point_of_curve, shows, state_of, until
from playwright.async_api import expect

DRAWN = """([first, last, index]) => {
  const canvas = document.querySelector("#curves canvas");
  const count = quadrille.state.session.n_frames;
  const x = (frame) => Math.round((52 + frame * (canvas.clientWidth - 60) / count) * devicePixelRatio);
  const context = document.createElement("canvas").getContext("2d");
  context.fillStyle = getComputedStyle(canvas).getPropertyValue(`--series-${index}`);
  context.fillRect(0, 0, 1, 1);
  const [r, g, b] = context.getImageData(0, 0, 1, 1).data;
  const { data } = canvas.getContext("2d").getImageData(x(first), 0, Math.max(1, x(last) - x(first)), canvas.height);
  let sum = 0;
  for (let i = 0; i < data.length; i += 4) if (data[i] === r && data[i + 1] === g && data[i + 2] === b) sum += 1;
  return sum;
}"""
"""JavaScript: how many pixels between two frames have exactly the colour of a curve."""


@pytest_asyncio.fixture(loop_scope="session")
async def curves(page):
    """The page with its curves open."""
    await page.locator("#show-curves").click()
    await shows(page, "quadrille.state.curves !== null")
    return page


@pytest.mark.slow
async def test_curves_are_sent_only_while_they_are_open(page, endpoint):
    assert await page.locator("#curves").is_hidden()
    assert not endpoint.heard("curves")
    await page.keyboard.press("c")
    await shows(page, "quadrille.state.curves?.group === 'arms'")
    await page.get_by_text("Legs", exact=True).click()
    await shows(page, "quadrille.state.curves.group === 'legs'")
    await page.keyboard.press("c")
    await page.locator("#drawer").wait_for(state="hidden")
    await until(lambda: len(endpoint.heard("curves")) == 3)
    assert [m["group"] for m in endpoint.heard("curves")] == ["arms", "legs", None]


@pytest.mark.slow
async def test_open_sections_are_remembered(curves, endpoint):
    await curves.locator("#drawer-tabs").get_by_text("Torso", exact=True).click()
    await shows(curves, "quadrille.state.curves.group === 'torso'")
    await curves.reload()
    await shows(curves, "quadrille.state.curves?.group === 'torso'")
    assert await curves.locator("#curves").is_visible()


@pytest.mark.slow
async def test_a_click_goes_to_the_frame_whichever_curve_is_there(curves, endpoint):
    for frame, height in ((77, 0.2), (55, 0.7)):
        endpoint.received.clear()
        await curves.mouse.click(*await frame_place(curves, frame, height, "#curves"))
        await shows(curves, f"quadrille.state.shown.frame === {frame}")
        assert endpoint.heard("seek") == [{"type": "seek", "frame": frame}]


@pytest.mark.slow
async def test_curves_and_timeline_share_their_axis(curves, endpoint):
    x, _ = await frame_place(curves, 93, chart="#curves")
    await curves.mouse.click(x, (await frame_place(curves, 93))[1])
    await shows(curves, "quadrille.state.shown.frame === 93")


@pytest.mark.slow
async def test_gaps_stay_open(curves):
    for index in range(4):
        assert await curves.evaluate(DRAWN, [20, 24, index]) > 0
        assert await curves.evaluate(DRAWN, [61, 64, index]) == 0
        assert await curves.evaluate(DRAWN, [102, 118, index]) == 0


@pytest.mark.slow
async def test_the_legend_reads_values_and_switches_curves(curves, endpoint):
    switches = curves.locator(".legend-switch")
    assert [t.split("\n")[0] for t in await switches.all_inner_texts()] == [
        "abduction", "elevation", "twist", "extension",
    ]  # fmt: skip
    left, right = float(curve(0, 12)), float(curve(4, 12))
    values = await switches.nth(0).locator("output").text_content()
    assert values == f"L {left:.1f}°  R {right:.1f}°"
    await curves.mouse.move(*await frame_place(curves, 40, chart="#curves"))
    await shows(curves, f"document.querySelector('.legend-switch output').textContent.startsWith("
                        f"'L {float(curve(0, 40)):.1f}°')")  # fmt: skip
    await switches.nth(1).click()
    await shows(curves, "true")
    assert await switches.nth(1).get_attribute("aria-pressed") == "false"
    assert await curves.evaluate(DRAWN, [0, 100, 1]) == 0
    assert await curves.evaluate(DRAWN, [0, 100, 0]) > 0
    await switches.nth(1).click()
    await shows(curves, "true")
    assert await curves.evaluate(DRAWN, [0, 100, 1]) > 0


@pytest.mark.slow
async def test_angles_are_drawn_without_jumps_of_a_turn(curves):
    values = await curves.evaluate("[...quadrille.state.curves.series[2].values]")
    known = np.array([v for v in values if v is not None and np.isfinite(v)])
    assert np.abs(np.diff(known)).max() < 60  # 7 degrees a frame; the gap of 5 frames between
    assert known[-1] - known[0] == pytest.approx(7 * 99)


@pytest.mark.slow
async def test_changes_are_taken_over_frame_by_frame(curves, endpoint):
    before = await curves.evaluate("[...quadrille.state.curves.series[0].values]")
    await endpoint.send_curves(np.array([3, 110]), replace=False, shift=100.0)
    await shows(curves, "Number.isFinite(quadrille.state.curves.series[0].values[110])")
    after = await curves.evaluate("[...quadrille.state.curves.series[0].values]")
    changed = [i for i in range(120) if before[i] != after[i] and not (before[i] != before[i] and after[i] != after[i])]
    assert changed == [3, 110]
    assert after[3] == pytest.approx(before[3] + 100.0, abs=1e-3)


@pytest.mark.slow
async def test_costs_have_a_curve_for_each_view(curves):
    await curves.locator("#drawer").get_by_text("Cost", exact=True).click()
    await shows(curves, "quadrille.state.curves.group === 'cost'")
    names = await curves.locator(".legend-switch").all_inner_texts()
    assert [n.split("\n")[0] for n in names] == ["mean", "FRONT", "RIGHT", "BACK", "LEFT"]
    assert " px" in names[0]


@pytest.mark.slow
async def test_they_fit_a_small_screen(curves):
    await curves.set_viewport_size({"width": 1280, "height": 720})
    # The bar of the selected joint has its 34 px too, and the line of advice 32.
    await shows(curves, "quadrille.state.views[0].scale > 0.3")


def turns_of(endpoint):
    return [m for m in endpoint.heard("pose") if m["action"] == "turn"]


@pytest.mark.slow
async def test_a_point_is_dragged_and_taken_back(curves, endpoint):
    at = await point_of_curve(curves, 3, 40)
    await drag_up(curves, at, 20)
    await until(lambda: turns_of(endpoint)[-1]["by"] > 10)
    await curves.mouse.up()
    moved = turns_of(endpoint)
    assert {(m["frame"], m["drag"], *m["dofs"]) for m in moved} == {(40, moved[0]["drag"], 3)}
    assert endpoint.heard("seek") == [{"type": "seek", "frame": 40}]
    await drag_up(curves, at, -10)
    await until(lambda: turns_of(endpoint)[-1]["drag"] != moved[0]["drag"])
    await curves.keyboard.press("Escape")
    await until(lambda: turns_of(endpoint)[-1]["by"] is None)
    assert turns_of(endpoint)[-1]["drag"] == turns_of(endpoint)[-2]["drag"] != moved[0]["drag"]


@pytest.mark.slow
async def test_several_curves_are_stepped_by_keys(curves, endpoint):
    at = await point_of_curve(curves, 3, 40)
    await curves.mouse.click(*at)
    await curves.keyboard.press("u")  # the next visible one, of the right arm
    await curves.keyboard.press("Shift+u")
    await expect(curves.locator("#curves-chosen")).to_have_text("2 curves")
    await curves.keyboard.press("ArrowUp")
    await curves.keyboard.press("Shift+ArrowDown")
    await until(lambda: sum(m["by"] for m in turns_of(endpoint)) == -45)
    assert {tuple(m["dofs"]) for m in turns_of(endpoint)} == {(10, 3)}
    await curves.keyboard.press("ArrowRight")
    await shows(curves, "quadrille.state.shown.frame === 41")
    assert not endpoint.heard("drag")


@pytest.mark.slow
async def test_a_range_is_marked_shifted_and_smoothed(curves, endpoint):
    at = await point_of_curve(curves, 3, 40)
    x, y = await frame_place(curves, 45, 0.02, "#curves")
    await curves.mouse.click(*at)
    await curves.locator("#smooth-curves").click()
    await expect(curves.get_by_text("No range is marked").first).to_be_visible()
    await curves.keyboard.down("Shift")
    await drag_mouse(curves, (at[0] - 40, y), (x, y), steps=2)
    span = (await state_of(curves))["range"]
    assert (span["first"] < 40, span["last"]) == (True, 45)
    await drag_up(curves, at, 15)
    assert not endpoint.heard("range"), "the poses change on release"
    await curves.mouse.up()
    await curves.keyboard.up("Shift")
    await until(lambda: endpoint.heard("range")[-1]["amount"] > 10)
    await curves.locator("#curve-tools .number-field").first.fill("4")
    await curves.locator("#smooth-curves").click()
    await until(lambda: endpoint.heard("range")[-1]["action"] == "smooth")
    assert endpoint.heard("range")[-1] == {
        "type": "range", "action": "smooth", **span, "person": 0, "dofs": [3], "amount": 4
    }  # fmt: skip
    assert not turns_of(endpoint)


@pytest.mark.slow
@pytest.mark.endpoint(role="review")
async def test_a_page_that_may_not_edit_is_offered_no_point(curves, endpoint):
    with pytest.raises(AssertionError, match="no point"):
        await point_of_curve(curves, 3, 40)
    x, y = await frame_place(curves, 40, chart="#curves")
    await drag_up(curves, (x, y), 20)
    await curves.mouse.up()
    await curves.keyboard.press("ArrowUp")
    await expect(curves.get_by_text("This link is to review").first).to_be_visible()
    assert not turns_of(endpoint)


@pytest.mark.endpoint(n_frames=100_000)
class TestLong:
    @pytest.mark.slow
    async def test_a_hundred_thousand_frames_are_drawn_at_once(self, curves, endpoint):
        """A redraw traces a few points for each column of the screen, not one for each frame."""
        await endpoint.send_curves(np.arange(100_000), replace=True, shift=1.0)  # poses on all of them
        await shows(curves, "quadrille.state.curves.series[0].values.at(-1) > 0")
        points = await curves.evaluate(
            """async () => {
              const { lineTo, moveTo } = Path2D.prototype;
              let points = 0;
              Path2D.prototype.lineTo = function (x, y) { points += 1; lineTo.call(this, x, y); };
              Path2D.prototype.moveTo = function (x, y) { points += 1; moveTo.call(this, x, y); };
              document.querySelectorAll(".legend-switch")[0].click();
              await new Promise((resolve) => requestAnimationFrame(() => setTimeout(resolve)));
              Object.assign(Path2D.prototype, { lineTo, moveTo });
              return points;
            }"""
        )
        assert 1_000 < points < 90_000  # interpolated stretches are strokes of their own


@pytest.mark.slow
async def test_the_landscape_says_why_it_is_empty(page, endpoint):
    await command(page, "Cost landscape")
    waiting = page.locator("#landscape p")
    assert "Sampling the cost" in await waiting.inner_text()
    await command(page, "Cost landscape")
    await endpoint.tell(compiling="cost")
    await shows(page, "quadrille.state.state.compiling === 'cost'")
    await command(page, "Cost landscape")
    await shows(page, "document.querySelector('#landscape p').innerText.includes('once the kernels are compiled')")
