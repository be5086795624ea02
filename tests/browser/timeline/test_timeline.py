"""The timeline against `fake_endpoint`: playing, jumping, zooming, and what is done with a range."""

from itertools import pairwise

import pytest
from page_driver import command, drag_mouse, frame_place, shows, state_of, until

from tracker.session.store.records import SOURCES

INSIDE_THE_MENU = """(() => {
  const menu = document.querySelector("#jump-menu").getBoundingClientRect();
  return [...document.querySelectorAll("#jump-menu button")].every((button) => {
    const { left, right, top, bottom } = button.getBoundingClientRect();
    return left >= menu.left && right <= menu.right && top >= menu.top && bottom <= menu.bottom;
  });
})()"""
"""JavaScript: whether all buttons of the menu lie in it."""


async def mark(page, first, last):
    await page.keyboard.down("Shift")
    await drag_mouse(page, await frame_place(page, first), await frame_place(page, last), steps=4)
    await page.keyboard.up("Shift")
    assert (await state_of(page))["range"] == {"first": first, "last": last}


async def go_to(page, frame):
    await page.locator("#frame").fill(str(frame))
    await page.keyboard.press("Enter")
    await shows(page, f"quadrille.state.shown.frame === {frame}")


LOG_SEEKS = """() => {
  const isLogged = Boolean(window.seeks);
  window.seeks = [];
  if (isLogged) return;
  const { send } = WebSocket.prototype;
  WebSocket.prototype.send = function (text) {
    const message = JSON.parse(text);
    if (message.type === "seek") window.seeks.push([performance.now() / 1000, message.frame]);
    send.call(this, text);
  };
  document.addEventListener("keydown", ({ key }) => {
    if (key === "Home") window.homeAt = performance.now() / 1000;
  }, true);
}"""
"""JavaScript: note when the page asks for which frame, and when Home is pressed, s: the endpoint may hear late."""


async def played(page, endpoint, enough):
    """When frames were asked for while a clip played, s, and which, until there are enough of them."""
    await page.evaluate(LOG_SEEKS)
    before = len(endpoint.heard("seek"))
    await page.keyboard.press("Space")
    await until(lambda: enough([m["frame"] for m in endpoint.heard("seek")[before:]]), 20)
    # A quick clip may have come to its end: what is asked and pressed apart could start it again.
    await page.evaluate("quadrille.state.playing && document.getElementById('play').click()")
    await shows(page, "!quadrille.state.playing")
    times, frames = zip(*await page.evaluate("window.seeks"), strict=True)
    return list(times), list(frames)


@pytest.mark.parametrize("rate", ["2", *(pytest.param(rate, marks=pytest.mark.slow) for rate in ("0.25", "1"))])
async def test_a_clip_plays_at_its_rate(page, endpoint, rate):
    await page.locator("#rate").select_option(rate)
    times, frames = await played(page, endpoint, lambda f: len(f) > 1 and f[-1] - f[0] > 8)
    assert frames == sorted(set(frames))
    # A seek leaves when its frame is due, a frame or a moment late.
    found = (frames[-1] - frames[0]) / (times[-1] - times[0]) / 30
    assert 0.4 * float(rate) < found < 1.4 * float(rate)  # a busy machine draws seldom, and is late for it


async def test_commands_change_the_rate(page):
    for change, rate in (("faster", 2), ("faster", 4), ("faster", 4), ("slower", 2), ("slower", 1), ("slower", 0.5)):
        await command(page, f"Play {change}")
        await shows(page, f"quadrille.state.rate === {rate} && document.querySelector('#rate').value === '{rate}'")


@pytest.mark.slow
async def test_frames_that_would_come_late_are_skipped_or_waited_for(page, endpoint):
    endpoint.image_delay_s = 0.03  # 8 frames a second of 4 cameras
    _, skipping = await played(page, endpoint, lambda f: len(f) > 4)
    assert max(b - a for a, b in pairwise(skipping)) > 1
    await page.locator("#every-frame").click()
    await go_to(page, 12)
    _, every = await played(page, endpoint, lambda f: len(f) > 4)
    assert every == list(range(every[0], every[0] + len(every)))


@pytest.mark.slow
async def test_playing_ends_at_the_last_frame_and_begins_anew(page, endpoint):
    await go_to(page, 115)
    await page.keyboard.press("Space")
    await shows(page, "quadrille.state.shown.frame === 119 && !quadrille.state.playing")
    await page.keyboard.press("Space")
    await shows(page, "quadrille.state.shown.frame < 60 && quadrille.state.playing")
    await page.keyboard.press("Space")


@pytest.mark.slow
async def test_a_loop_goes_round_the_marked_range(page, endpoint):
    await mark(page, 40, 46)
    await command(page, "Loop playback, within the marked range if there is one (toggle)")
    await shows(page, "document.querySelector('#loop').getAttribute('aria-pressed') === 'true'")
    await page.locator("#every-frame").click()
    _, frames = await played(page, endpoint, lambda f: f.count(40) > 2)
    assert frames[:15] == [*range(40, 47), *range(40, 47), 40]
    await command(page, "Loop playback, within the marked range if there is one (toggle)")
    await shows(page, "!quadrille.state.loops")


@pytest.mark.slow
async def test_a_hand_that_goes_elsewhere_while_it_plays_is_followed(page, endpoint):
    await page.keyboard.press("Space")
    await shows(page, "quadrille.state.shown.frame > 20")
    await page.evaluate(LOG_SEEKS)
    await page.keyboard.press("Home")
    await shows(page, "window.seeks.filter(([at]) => at > window.homeAt).length > 4")
    await page.keyboard.press("Space")
    seeks, home_at = await page.evaluate("window.seeks"), await page.evaluate("window.homeAt")
    for at, frame in seeks:  # a busy page asks for a frame soon after the first, not for the first
        assert at < home_at or frame <= 30 * (at - home_at) + 1


@pytest.mark.slow
async def test_the_wheel_zooms_where_the_pointer_is(page):
    x, y = await frame_place(page, 70)
    await page.mouse.move(x, y)
    await page.keyboard.down("Control")
    await page.mouse.wheel(0, -500)
    await page.keyboard.up("Control")
    await shows(page, "quadrille.state.visible?.end - quadrille.state.visible?.start < 60")
    assert (await frame_place(page, 70))[0] == pytest.approx(x, abs=3.0)
    before = (await state_of(page))["visible"]
    await page.mouse.wheel(0, 60)
    await shows(page, f"quadrille.state.visible.start > {before['start']} + 1")
    after = (await state_of(page))["visible"]
    assert after["end"] - after["start"] == pytest.approx(before["end"] - before["start"])
    await page.mouse.click(*await frame_place(page, 75))
    await shows(page, "quadrille.state.shown.frame === 75")
    await page.keyboard.down("Control")
    await page.mouse.wheel(0, 3000)
    await page.keyboard.up("Control")
    await shows(page, "quadrille.state.visible === null")


async def test_a_zoomed_view_is_moved_by_button_and_overview(page):
    for _ in range(4):
        await command(page, "Timeline: zoom in")
    await shows(page, "quadrille.state.visible?.end - quadrille.state.visible?.start < 20")
    x, y = await frame_place(page, 14)
    await drag_mouse(page, (x, y), (x - 300, y), button="middle")
    assert (await frame_place(page, 14))[0] == pytest.approx(x - 300, abs=1.0)
    await page.mouse.click(*await frame_place(page, 90, 0.95, is_whole=True))
    await shows(page, "quadrille.state.visible.start < 90 && quadrille.state.visible.end > 90")
    assert (await state_of(page))["shown"]["frame"] == 12  # to look around is not to go there
    await page.keyboard.press("Period")
    await shows(
        page, "quadrille.state.shown.frame === 13 && quadrille.state.visible.start <= 13"
    )  # it comes back to view
    await command(page, "Timeline: show the marked range, or all frames")
    await shows(page, "quadrille.state.visible === null")


async def test_timeline_and_curves_share_the_zoom(page):
    await page.keyboard.press("c")
    await shows(page, "quadrille.state.curves")
    stage = await page.locator("#curves").bounding_box()
    x, _ = await frame_place(page, 30)
    await page.mouse.move(x, stage["y"] + 40)
    await page.keyboard.down("Control")
    await page.mouse.wheel(0, -400)
    await page.keyboard.up("Control")
    await shows(page, "quadrille.state.visible !== null")
    assert (await frame_place(page, 30))[0] == pytest.approx(x, abs=3.0)
    await page.mouse.click((await frame_place(page, 33))[0], stage["y"] + 40)
    await shows(page, "quadrille.state.shown.frame === 33")
    await page.keyboard.press("c")


@pytest.mark.slow
async def test_the_menu_counts_what_there_is_to_go_to(page):
    await page.locator("#show-jumps").click()
    assert await page.evaluate(INSIDE_THE_MENU)
    await page.keyboard.press("Escape")
    assert await page.locator("#jump-menu").is_hidden()
    await page.locator("#show-jumps").click()
    rows = page.locator("#jump-menu .jump-row")
    counts = {await r.locator("span").inner_text(): await r.locator("output").inner_text() for r in await rows.all()}
    assert counts == {
        "Doubtful or lost": "3", "Ambiguous": "2", "Not reviewed": "80", "Inconsistent": "2",
        "Earlier calibration": "0", "Other copy differs": "0", "Filtered by provenance": "0", "Keyframes": "5",
        "Without a pose": "20",
    }  # fmt: skip
    await rows.nth(3).locator("button").nth(1).click()
    await shows(page, "quadrille.state.shown.frame === 44")
    await page.locator(".jump-gap").click()
    await shows(page, "quadrille.state.shown.frame === 100")
    await page.keyboard.press("Escape")
    assert await page.locator("#jump-menu").is_hidden()


@pytest.mark.slow
async def test_jumps_by_keys_and_commands(page):
    apart = "frame inconsistent with its neighbours"
    for key, frame in (
        (f"Next {apart}", 44), (f"Next {apart}", 45), (f"Next {apart}", 45), (f"Previous {apart}", 44),
        ("Next keyframe", 60), ("Next keyframe", 80), ("Previous keyframe", 60), ("Next unreviewed frame", 61),
        ("Previous unreviewed frame", 59), ("Middle of the longest gap", 100), ("n", 100), ("Shift+N", 50),
    ):  # fmt: skip
        await command(page, key)
        await shows(page, f"quadrille.state.shown.frame === {frame}")


async def test_a_double_click_marks_the_stretch_between_keyframes(page):
    await page.mouse.dblclick(*await frame_place(page, 33))
    await shows(page, "quadrille.state.range?.first === 20 && quadrille.state.range.last === 40")
    await page.mouse.dblclick(*await frame_place(page, 110))
    await shows(page, "quadrille.state.range?.first === 80 && quadrille.state.range.last === 119")


@pytest.mark.slow
async def test_a_range_is_worked_on_from_its_bar(page, endpoint):
    assert await page.locator("#range-bar").is_hidden()
    await mark(page, 24, 36)
    assert await page.locator("#range-text").inner_text() == "Frames 24 – 36"
    assert await page.locator("#range-work").inner_text() == "13 frames"
    names = ["backward", "forward", "interpolate", "estimate", "clear", "keyframe", "reviewed", "unreviewed"]
    for name in names:
        await page.locator(f"#range-{name}").click()
    await command(page, "Interpolate the marked range")
    await command(page, "Estimate the poses here again")
    await page.locator("#range-compare").click()
    await until(lambda: len(endpoint.heard("range")) == 10 and endpoint.heard("compare_range"))
    assert endpoint.heard("compare_range") == [{"type": "compare_range", "first": 24, "last": 36}]
    await shows(page, "quadrille.state.drawer === 'runs'")
    assert [m["action"] for m in endpoint.heard("range")] == [
        "track_backward", "track_forward", "interpolate", "estimate", "clear", "keyframe", "reviewed", "unreviewed",
        "interpolate", "estimate",
    ]  # fmt: skip
    assert {(m["first"], m["last"], m["person"]) for m in endpoint.heard("range")} == {(24, 36, None)}
    await endpoint.tell(
        range=endpoint.state["range"] | {"running": True, "what": "interpolating", "done": 500, "total": 12000}
    )
    await shows(page, "document.querySelector('#range-work').textContent === 'interpolating 500 of 12,000'")
    assert await page.locator("#range-clear").is_disabled()
    await page.locator("#range-stop").click()
    await until(lambda: endpoint.heard("stop_range"))
    await endpoint.tell(
        range=endpoint.state["range"] | {"running": False, "message": "stopped: interpolated 500 of 12000 frames"}
    )
    await shows(page, "document.querySelector('#range-work').textContent.startsWith('stopped: ')")
    await page.keyboard.press("Escape")
    await shows(page, "quadrille.state.range === null")
    assert await page.locator("#range-bar").is_hidden()


@pytest.mark.slow
async def test_poses_around_a_frame_are_estimated_again_in_a_range_of_their_own(page, endpoint):
    """The next frame has another range; one that a user marked stays. A message that comes again is shown again."""
    for frame, first, last in ((30, 26, 34), (3, 0, 7), (99, 95, 99), (112, 112, 112)):
        await go_to(page, frame)
        await command(page, "Estimate the poses here again")
        await shows(page, f"quadrille.state.range?.first === {first} && quadrille.state.range.last === {last}")
        for running, text in ((True, "estimating"), (False, "estimated 8 frames")):
            await endpoint.tell(
                range=endpoint.state["range"]
                | {"running": running, "what": "estimating", "message": "" if running else text}
            )
            await shows(page, f"document.querySelector('#range-work').textContent.startsWith('{text}')")
    await mark(page, 24, 36)
    await command(page, "Estimate the poses here again")
    await until(lambda: len(endpoint.heard("range")) == 5)
    assert endpoint.heard("range")[-1] == {
        "type": "range",
        "action": "estimate",
        "first": 24,
        "last": 36,
        "person": None,
    }
    assert {(m["action"], m["person"]) for m in endpoint.heard("range")} == {("estimate", None)}


@pytest.mark.slow
async def test_the_bar_stays_within_the_window(page):
    await page.set_viewport_size({"width": 1280, "height": 720})
    for first, last in ((0, 3), (60, 61), (116, 119)):
        await mark(page, first, last)
        await shows(page, "!document.querySelector('#range-bar').hidden")
        bar = await page.locator("#range-bar").bounding_box()
        assert bar["x"] >= 0
        assert bar["x"] + bar["width"] <= 1280
        assert bar["y"] + bar["height"] <= (await page.locator("#timeline").bounding_box())["y"]


async def test_marks_of_the_shown_frame(page, endpoint):
    assert await page.locator("#toggle-reviewed").get_attribute("aria-pressed") == "true"  # frame 12 of the fake
    assert await page.locator("#toggle-keyframe").get_attribute("aria-pressed") == "false"
    await page.keyboard.press("k")
    await page.keyboard.press("e")
    await command(page, "Remove the marks of this frame")
    await page.locator("#toggle-keyframe").click()
    await until(lambda: len(endpoint.heard("mark")) == 3)
    assert [m["toggle"] for m in endpoint.heard("mark")] == ["keyframe", "reviewed", "keyframe"]
    assert endpoint.heard("range") == [{"type": "range", "action": "none", "first": 12, "last": 12, "person": 0}]
    await go_to(page, 20)
    assert await page.locator("#toggle-keyframe").get_attribute("aria-pressed") == "true"
    assert await page.locator("#toggle-reviewed").is_disabled()  # a keyframe is reviewed


@pytest.mark.slow
@pytest.mark.endpoint(n_people=2)
async def test_the_legend_leaves_out_what_does_not_fit(page, endpoint):
    await page.set_viewport_size({"width": 1280, "height": 720})
    await endpoint.tell(other_sizes=True)
    await shows(page, "document.querySelector('#source').textContent.endsWith(', earlier sizes')")
    legend = await page.locator("#legend").bounding_box()
    entries = await page.locator(".legend-row > span").all()
    boxes = [await entry.bounding_box() for entry in entries if await entry.is_visible()]
    assert max((box["x"] + box["width"] for box in boxes), default=0) <= legend["x"] + legend["width"]
    names = [await entry.text_content() for entry in entries]
    assert (await page.locator("#legend").get_attribute("title")).startswith(f"{', '.join(names)}.")
    await page.locator("#legend").click()
    panel = page.locator("#marks-panel")
    box = await panel.bounding_box()
    assert box["y"] >= 0
    assert box["x"] + box["width"] <= 1280
    listed = await panel.inner_text()
    assert all(name in listed for name in ("lost", "keyframe", "smoothed", "pose under test"))
    await page.locator("#legend").click()
    await panel.wait_for(state="hidden")
    await endpoint.tell(other_sizes=False)
    await page.locator("#legend").get_by_text("lost").wait_for()  # there is room for every status
    await page.set_viewport_size({"width": 1920, "height": 720})
    await page.locator(".legend-row > span").last.wait_for()


PROFILE = """(frame) => {
  const canvas = document.querySelector("#timeline canvas");
  const pitch = (canvas.clientWidth - 60) / quadrille.state.session.n_frames;
  const at = [52 + (frame + 0.3) * pitch, 44, 1, 12].map((place) => Math.round(place * devicePixelRatio));
  const { data } = canvas.getContext("2d").getImageData(...at);
  const rows = Array.from({ length: at[3] }, (_, row) => [...data.slice(4 * row, 4 * row + 3)].join());
  return rows;
}"""
"""JavaScript: the colours down the lane of a single person at a frame."""
BANDS = "(marks) => marks.map((one) => getComputedStyle(one).backgroundImage.match(/[0-9.]+%/g).join())"
"""JavaScript: heights of the bands in the legend."""


@pytest.mark.slow
async def test_each_source_has_bands_of_its_own(page, endpoint):
    """Colour-blind people tell sources apart too: on the timeline as in the legend."""
    plain = {"cost_px": 1.0, "keyframe": False, "status": "", "remark": "", "reviewed": False, "ambiguous": False}
    cells = {str(frame): plain | {"source": name, "limbs_lost": []} for frame, name in enumerate(SOURCES)}
    await endpoint.broadcast({"type": "timeline", "person": None, "cells": cells, "replace": True})
    await page.set_viewport_size({"width": 1920, "height": 720})
    await shows(page, "document.querySelectorAll('#legend .source-mark').length === 8")
    empty = (await page.evaluate(PROFILE, 20))[0]
    lanes = [await page.evaluate(PROFILE, frame) for frame in range(len(SOURCES))]
    assert len({tuple(color == empty for color in lane) for lane in lanes}) == len(SOURCES)
    assert len(set(await page.eval_on_selector_all("#legend .source-mark", BANDS))) == len(SOURCES)
