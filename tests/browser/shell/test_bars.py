"""Keys, top bar and timeline against `fake_endpoint`: what they send and what they say."""

import asyncio

import pytest
from page_driver import handle_of, shows, state_of, to_client, until


@pytest.mark.slow
async def test_frame_keys_end_at_the_ends(page, endpoint):
    frames = {"Period": 13, "Comma": 12, "Shift+Period": 22, "Shift+Comma": 12, "End": 119, "Home": 0}
    for key, frame in frames.items():
        endpoint.received.clear()
        await page.keyboard.press(key)
        await shows(page, f"quadrille.state.shown.frame === {frame}")
        assert endpoint.heard("seek") == [{"type": "seek", "frame": frame}], key
        assert await page.locator("#frame").input_value() == str(frame)
    for key in ("Comma", "Shift+Comma"):
        await page.keyboard.press(key)
    assert {m["frame"] for m in endpoint.heard("seek")} == {0}


@pytest.mark.slow
async def test_a_frame_asked_for_after_an_undo_is_shown_although_it_was_on_the_screen(page, endpoint):
    undone, answer = asyncio.Event(), endpoint.answer

    async def undo_elsewhere(message):
        """An undo goes to the frame of its edit, and takes a while."""
        if message["type"] == "undo":
            await undone.wait()
            endpoint.state |= endpoint.judged(30)
            await endpoint.broadcast(endpoint.state)
            await endpoint.send_frame()
        else:
            await answer(message)

    await page.keyboard.press("Home")
    await shows(page, "quadrille.state.shown.frame === 0 && quadrille.state.state.frame === 0")
    endpoint.answer = undo_elsewhere
    endpoint.received.clear()
    await page.keyboard.press("Control+z")
    await page.keyboard.press("Home")
    await page.keyboard.press("Home")  # one request is enough
    undone.set()
    await until(lambda: endpoint.heard("seek") == [{"type": "seek", "frame": 0}])
    await shows(page, "quadrille.state.state.frame === 0 && quadrille.state.shown.frame === 0")
    assert await page.evaluate("quadrille.state.target") == 0
    await page.keyboard.press("Period")  # needs not wait
    await shows(page, "quadrille.state.shown.frame === 1", 5)
    assert [message["frame"] for message in endpoint.heard("seek")] == [0, 1]
    # Without another request the page goes along.
    await page.keyboard.press("Control+z")
    await shows(page, "quadrille.state.shown.frame === 30 && quadrille.state.target === 30")


async def test_keys_send_one_message(page, endpoint):
    for key, message in {
        "Control+z": {"type": "undo"},
        "Control+Shift+z": {"type": "redo"},
        "Control+y": {"type": "redo"},
        "s": {"type": "search", "action": "step", "person": None},
        "f": {"type": "search", "action": "frame", "person": None},
    }.items():
        endpoint.received.clear()
        await shows(page, "!quadrille.state.state.job.running")
        await page.keyboard.press(key)
        await until(lambda: endpoint.received)
        assert endpoint.received == [message], key


async def test_a_field_that_is_done_gives_the_keys_back(page, endpoint):
    rate = page.locator("#rate")
    await rate.focus()
    await rate.select_option("2")
    await page.keyboard.press("f")
    await until(lambda: [m["action"] for m in endpoint.heard("search")] == ["frame"])
    await page.mouse.click(*await to_client(page, 0, *await handle_of(page, 0, "l_elbow")))
    await shows(page, "document.querySelector('#joint-bar .number-field').ariaLabel.startsWith('l elbow')")
    field = page.locator("#joint-bar .number-field").first
    await field.fill("40")
    await page.keyboard.press("Enter")
    await page.keyboard.press("Home")
    await shows(page, "quadrille.state.shown.frame === 0")
    await field.fill("far")
    await page.keyboard.press("Enter")
    assert await page.evaluate("document.activeElement.value") == "far"  # refused: to be corrected


@pytest.mark.slow
async def test_keys_written_into_the_frame_number_go_there(page, endpoint):
    await page.locator("#frame").click()
    await page.keyboard.type("33")
    await page.keyboard.press("s")
    await page.keyboard.press("Enter")
    await shows(page, "quadrille.state.shown.frame === 33")
    assert endpoint.received == [{"type": "seek", "frame": 33}]


async def test_a_search_is_watched_and_stopped(page, endpoint):
    stop = page.locator("#search-stop")
    assert await stop.is_disabled()
    await page.locator("#search-frame").click()
    await shows(page, "quadrille.state.overlay.paths.some((path) => path.kind === 'candidate')")
    assert await page.locator("#search-frame").is_disabled()
    await stop.click()
    await shows(page, "!quadrille.state.state.job.running")
    assert await stop.is_disabled()
    assert [m["action"] for m in endpoint.heard("search")] == ["frame", "stop"]
    await page.keyboard.press("s")
    await shows(page, "quadrille.state.state.job.kind === 'step'")
    await page.keyboard.press("Escape")
    await until(lambda: [m["action"] for m in endpoint.heard("search")] == ["frame", "stop", "step", "stop"])


@pytest.mark.slow
async def test_history_and_saving_say_what_they_would_do(page, endpoint):
    assert await page.locator("#undo").get_attribute("title") == "Undo drag l_wrist (Ctrl+Z)"
    assert await page.locator("#redo").is_disabled()
    assert await page.locator("#saved").inner_text() == "All saved"
    await endpoint.tell(saved=False, save_error="the disk is full", undo=None, redo="search")
    await shows(page, "document.querySelector('#saved').textContent === 'Not saved'")
    assert "Not saved: the disk is full" in await page.locator("#saved").get_attribute("title")
    assert await page.locator("#saved").get_attribute("class") == "is-failed"
    assert await page.locator("#undo").is_disabled()


@pytest.mark.slow
async def test_scrubbing_asks_for_one_frame_at_a_time_and_ends_at_the_last(page, endpoint):
    endpoint.image_delay_s = 0.05  # 200 ms a frame
    box = await page.locator("#timeline").bounding_box()
    y = box["y"] + box["height"] - 14
    await page.mouse.move(box["x"] + 20, y)
    await page.mouse.down()
    for x in range(30, 1200, 20):
        await page.mouse.move(box["x"] + x, y)
    await page.mouse.up()
    wanted = (await state_of(page))["target"]
    await shows(page, f"quadrille.state.shown.frame === {wanted}")
    assert wanted > 95
    assert 2 <= len(endpoint.heard("seek")) < 40
    assert endpoint.heard("seek")[-1]["frame"] == wanted


@pytest.mark.slow
async def test_slow_playback_asks_for_few_animation_frames(page):
    """Each has the browser compose the page again, which takes time from everybody on the machine."""
    await page.keyboard.press("Home")
    await shows(page, "quadrille.state.shown.frame === 0")
    await page.locator("#rate").select_option("0.125")
    await page.evaluate("document.activeElement.blur()")
    # The store asks for one for each change, to draw it.
    await page.evaluate(
        "() => { window.asked = 0; const ask = requestAnimationFrame;"
        "window.requestAnimationFrame = (draw) => {"
        "asked += !new Error().stack.includes('Store.set'); return ask(draw); } }"
    )
    await page.keyboard.press("Space")
    await shows(page, "quadrille.state.shown.frame >= 5")
    assert await page.evaluate("asked / quadrille.state.shown.frame") < 6
    await page.keyboard.press("Space")


@pytest.mark.slow
async def test_playback_keeps_no_backlog_and_stops_at_the_end(page, endpoint):
    endpoint.image_delay_s = 0.03  # 120 ms a frame, far slower than 30 fps
    await page.keyboard.press("Shift+Period")
    for _ in range(7):
        await page.keyboard.press("Shift+Period")
    await shows(page, "quadrille.state.shown.frame === 92")
    endpoint.received.clear()
    await page.keyboard.press("Space")
    await shows(page, "!quadrille.state.playing && quadrille.state.shown.frame === 119", timeout_s=10.0)
    frames = [m["frame"] for m in endpoint.heard("seek")]
    assert frames == sorted(set(frames))
    assert len(frames) < 20


async def test_every_control_has_a_name_and_a_tooltip(page):
    unnamed = await page.evaluate(
        """() => [...document.querySelectorAll("button")].filter((button) =>
          !(button.title && (button.textContent.trim() || button.ariaLabel))).map((b) => b.outerHTML)"""
    )
    assert unnamed == []


USUAL = "document.querySelector('#usual-cost').textContent"


@pytest.mark.slow
async def test_the_cost_has_a_scale_from_the_good_frames(page, endpoint):
    good = sorted(endpoint.cell(k)["cost_px"] for k in range(100) if endpoint.cell(k)["status"] == "good")
    low, high = (f"{good[i]:.1f}" for i in (len(good) // 10, len(good) - 1 - len(good) // 10))
    await shows(page, f"{USUAL} === 'usual here {low}–{high}'")
    sizes = (
        "['#cost', '#session-name'].map((one) => parseFloat(getComputedStyle(document.querySelector(one)).fontSize))"
    )
    cost, name = await page.evaluate(sizes)
    assert cost <= name  # it is not the largest thing on the screen
    for width in (1280, 1440, 1920):
        await page.set_viewport_size({"width": width, "height": 720})
        bar, usual, number = [await page.locator(one).bounding_box() for one in (".top-bar", "#usual-cost", "#cost")]
        assert usual["y"] + usual["height"] <= bar["y"] + bar["height"]
        assert usual["y"] >= number["y"] + number["height"] - 4


@pytest.mark.slow
@pytest.mark.endpoint(n_frames=9)
async def test_without_good_frames_nothing_is_usual(page):
    assert await page.evaluate(USUAL) == ""
