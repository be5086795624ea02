"""Tracking and the timeline against `fake_endpoint`: what buttons and keys send, and what is drawn of a run."""

import asyncio

import pytest
from fake_endpoint import REMARK
from page_driver import command, drag_mouse, dragging, frame_place, shows, state_of, until

STRIP = """(frame) => {
  const canvas = document.querySelector("#timeline canvas");
  const count = quadrille.state.session.n_frames;
  const x = Math.round((52 + (frame + 0.5) * (canvas.clientWidth - 60) / count) * devicePixelRatio);
  const style = getComputedStyle(canvas);
  const context = document.createElement("canvas").getContext("2d");
  const column = canvas.getContext("2d").getImageData(x, 28 * devicePixelRatio, 1, 12 * devicePixelRatio).data;
  const height = [...column].filter((value, i) => i % 4 === 3 && value > 0).length;
  for (const [status, token] of [["good", "--good"], ["doubtful", "--warning"], ["lost", "--bad"]]) {
    context.fillStyle = style.getPropertyValue(token);
    context.fillRect(0, 0, 1, 1);
    const [r, g, b] = context.getImageData(0, 0, 1, 1).data;
    for (let i = 0; i < column.length; i += 4)
      if (column[i] === r && column[i + 1] === g && column[i + 2] === b) return [status, height / devicePixelRatio];
  }
  return [null, 0];
}"""
"""JavaScript: which status the strip shows at a frame, and how high its bar stands."""


@pytest.mark.slow
async def test_a_run_is_watched_paused_and_stopped(page, endpoint):
    assert await page.locator("#track-pause").is_disabled()
    await page.locator("#track-forward").click()
    await shows(
        page, "quadrille.state.shown.frame > 14 && quadrille.state.overlay.frame === quadrille.state.shown.frame"
    )
    assert await page.locator("#track-forward").is_disabled()
    await page.locator("#track-pause").click()
    await shows(page, "!quadrille.state.state.track.running")
    at = (await state_of(page))["state"]["track"]["at"]
    await page.locator("#track-pause").click()
    await shows(page, f"quadrille.state.shown.frame > {at}")
    await page.locator("#track-stop").click()
    await shows(page, "quadrille.state.state.track.first === null")
    assert [m["action"] for m in endpoint.heard("track")] == ["forward", "pause", "resume", "stop"]
    assert endpoint.heard("track")[0]["until"] is None
    assert not endpoint.heard("seek")  # following asks for nothing
    seen = (await state_of(page))["timeline"]
    assert seen[str(at)]["source"] == "tracked"


@pytest.mark.slow
async def test_backward_by_key_and_escape(page, endpoint):
    await page.keyboard.press("Shift+T")
    await shows(page, "quadrille.state.shown.frame < 11")
    await page.keyboard.press("Escape")
    await until(lambda: endpoint.heard("track")[-1]["action"] == "stop")
    assert endpoint.heard("track")[0] == {"type": "track", "action": "backward", "until": None}


async def test_looking_elsewhere_unticks_follow_and_the_tick_leads_back(page, endpoint):
    endpoint.frame_s = 0.3  # the run must outlast what a busy machine takes for a click
    await page.keyboard.press("t")
    await shows(page, "quadrille.state.shown.frame > 13")
    await page.mouse.click(*await frame_place(page, 5))
    await shows(page, "quadrille.state.shown.frame === 5 && !quadrille.state.state.follow")
    assert not await page.locator("#follow").is_checked()
    at = (await state_of(page))["state"]["track"]["at"]
    await shows(page, f"quadrille.state.state.track.at > {at + 3}")
    assert (await state_of(page))["shown"]["frame"] == 5
    await command(page, "Follow the tracker (toggle)")
    await shows(page, "quadrille.state.shown.frame > 15")
    assert await page.locator("#follow").is_checked()


async def test_a_marked_range_ends_a_run(page, endpoint):
    (x0, y), (x1, _) = await frame_place(page, 8), await frame_place(page, 40)
    await page.keyboard.down("Shift")
    await drag_mouse(page, (x0, y), (x1, y), steps=5)
    await page.keyboard.up("Shift")
    assert (await state_of(page))["range"] == {"first": 8, "last": 40}
    assert not endpoint.heard("seek")
    await page.locator("#track-forward").click()
    await until(lambda: endpoint.heard("track"))
    await page.locator("#track-stop").click()
    await shows(page, "quadrille.state.state.track.first === null")
    await page.locator("#track-backward").click()
    await until(lambda: len(endpoint.heard("track")) == 3)
    assert [m.get("until") for m in endpoint.heard("track")] == [40, None, 8]
    await page.keyboard.press("Escape")
    await page.keyboard.down("Shift")
    await page.mouse.click(x0, y)
    await page.keyboard.up("Shift")
    await shows(page, "quadrille.state.range === null")


async def test_a_range_is_marked_by_keys(page):
    await page.keyboard.press("[")
    await page.keyboard.press("Shift+Period")
    await shows(page, "quadrille.state.shown.frame === 22")
    await page.keyboard.press("]")
    await shows(page, "quadrille.state.range?.first === 12 && quadrille.state.range.last === 22")


@pytest.mark.slow
@pytest.mark.parametrize("scheme", ["dark", "light"])
async def test_statuses_differ_by_colour_and_by_height(page, scheme):
    await page.emulate_media(color_scheme=scheme)
    async with asyncio.timeout(20):
        while (await page.evaluate(STRIP, 15))[0] is None:  # drawn again in the colors of the theme
            await asyncio.sleep(0.05)
    found = {frame: await page.evaluate(STRIP, frame) for frame in (3, 15, 31, 50, 110)}
    assert found[3] == [None, 0]  # nobody has judged it
    assert found[110] == [None, 0]  # no pose
    assert [found[f][0] for f in (15, 31, 50)] == ["good", "doubtful", "lost"]
    assert found[15][1] + 2 < found[31][1] < found[50][1] - 2


@pytest.mark.slow
async def test_a_tooltip_says_what_the_tracker_thinks_of_each_limb(page):
    tip = page.locator("#cell-tip")
    await page.mouse.move(*await frame_place(page, 31))
    await shows(page, "document.querySelector('#cell-tip').innerText.startsWith('Frame 31: tracked, doubtful, ')")
    assert (await tip.inner_text()).split("\n")[1:] == [
        "right arm: doubtful (31 % chance that it is lost); others tracked",
        REMARK,
    ]
    await page.mouse.move(*await frame_place(page, 50))
    await shows(page, "document.querySelector('#cell-tip').innerText.startsWith('Frame 50')")
    assert (await tip.inner_text()).split("\n")[1:] == [
        "left arm: lost (97 % chance that it is lost); right arm: doubtful (4 %); others tracked"
    ]
    await page.mouse.move(*await frame_place(page, 110))
    await shows(page, "document.querySelector('#cell-tip').innerText === 'Frame 110: no pose'")
    await page.mouse.move(400, 300)
    await tip.wait_for(state="hidden")


@pytest.mark.slow
async def test_doubtful_and_lost_frames_are_visited_one_after_the_other(page, endpoint):
    for frame in (31, 32, 50, 50):
        await page.keyboard.press("n")
        await shows(page, f"quadrille.state.shown.frame === {frame}")
    await page.locator("#previous-doubt").click()
    await shows(page, "quadrille.state.shown.frame === 32")
    await page.locator("#next-doubt").click()
    await shows(page, "quadrille.state.shown.frame === 50")
    assert [m["frame"] for m in endpoint.heard("seek")] == [31, 32, 50, 32, 50]


async def test_the_card_says_what_the_tracker_thinks_of_the_frame(page):
    card = page.locator("#frame-card")
    assert await card.is_hidden()  # of the first frame nobody has said anything
    await page.keyboard.press("n")
    await shows(page, "document.querySelector('#frame-status').textContent === 'doubtful'")
    assert await page.locator("#frame-remark").inner_text() == REMARK
    assert not await page.locator("#frame-parts").is_visible()
    await page.evaluate("document.querySelector('#frame-remark').append(' and so on'.repeat(90))")
    assert (await page.locator("#frame-status").bounding_box())["height"] < 30, "the badge stays on one line"
    await card.locator("summary").click()
    await shows(page, "document.querySelector('#frame-parts').childElementCount > 0")
    texts = await page.locator("#frame-parts").locator("span, output").all_inner_texts()
    # Left beside right, whatever the order of the model; three parts of the trunk leave a gap.
    assert texts == [
        "torso", "0.80 px", "head", "1.20 px", "pelvis", "0.90 px", "",
        "left arm", "4.50 px", "right arm", "not visible", "left leg", "1.50 px", "right leg", "2.50 px",
    ]  # fmt: skip
    label = page.locator("#frame-parts span")
    boxes = {await one.inner_text(): await one.bounding_box() for one in await label.all()}
    for left, right in (("left arm", "right arm"), ("left leg", "right leg")):
        assert boxes[left]["y"] == boxes[right]["y"]
        assert boxes[left]["x"] < boxes[right]["x"]
    await page.keyboard.press("Period")
    await shows(page, "quadrille.state.state.frame === 32")
    assert await page.locator("#frame-parts").is_visible()


@pytest.mark.slow
async def test_a_drag_names_the_frame_under_the_hand(page, endpoint):
    async with dragging(page, 0, "head", (5, 5), (9, 9)):
        await until(lambda: endpoint.heard("drag"))
    assert {m["frame"] for m in endpoint.heard("drag")} == {12}
