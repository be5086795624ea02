"""The line over the views: advice, its buttons, answers, what is dismissed, what was said; against `fake_endpoint`."""

import re

import pytest
from page_driver import command, shows, until

TEXT = "document.querySelector('#advice-text').textContent"
LONG = (
    "Not saved: expected room on the disk of the session for the poses of 1,200 frames, found none; make room on it, "
    "or give the session another folder, and try again. Edits are kept in memory until saving succeeds."
)
WORK = {"share": None, "done": "", "steps": (), "step": 0, "is_timed": True, "at_most_s": None}


def action(deed, text="Do it", frame=None, person=None, camera=None, of=""):
    return {"deed": deed, "text": text, "frame": frame, "person": person, "camera": camera, "of": of}


def said(text, *actions, situation="done", level="next", **work):
    return WORK | work | dict(situation=situation, text=text, actions=actions, level=level)


async def advise(endpoint, *advice):
    await endpoint.broadcast({"type": "advice", "said": advice})


async def answer(endpoint, text, level="error"):
    await endpoint.broadcast({"type": "notice", "level": level, "text": text})


async def test_the_most_urgent_is_said_and_the_next_after_it_is_dismissed(page, endpoint):
    await advise(endpoint, said("The first thing.", action("fit", "Fit")), said("The second thing."))
    await shows(page, f"{TEXT} === 'The first thing.'")
    assert await page.locator("#advice-actions button").all_inner_texts() == ["Fit"]
    await command(page, "Dismiss what the line says")
    await shows(page, f"{TEXT} === 'The second thing.'")
    assert await page.locator("#advice-actions button").count() == 0
    await page.locator("#dismiss-advice").click()
    await shows(page, f"{TEXT} === ''")
    assert await page.locator("#dismiss-advice").is_hidden()
    await advise(endpoint, said("The second thing."))  # it holds still, and stays dismissed
    await advise(endpoint)
    await shows(page, "quadrille.state.advice.said.length === 0")
    await advise(endpoint, said("The second thing."))  # it holds again
    await shows(page, f"{TEXT} === 'The second thing.'")


DEEDS = [
    (action("acquire", person=0), "acquire", {"action": "start", "person": 0}),
    (action("apply_correction"), "calibration_check", {"action": "apply"}),
    (action("apply_sizes", person=0), "body_sizes", {"action": "apply", "person": 0, "refit": True}),
    (action("by_key_points", of="network"), "observations", {"action": "track", "name": "network"}),
    (action("check_cameras"), "calibration_check", {"action": "start"}),
    (action("detect"), "observations", {"action": "detect_track", "name": ""}),
    (action("find"), "find_people", {"action": "start"}),
    (action("fit"), "fit", {"frame": 12, "person": None}),
    (action("go_to", frame=40), "seek", {"frame": 40}),
    (action("place", person=0), "select", {"person": 0, "point": "torso"}),
    (action("resume"), None, {}),
    (action("take_found", frame=3), "find_people", {"action": "take"}),
    (action("retry"), "save", {}),
    (action("search"), "search", {"action": "frame", "person": None}),
    (action("show_before"), None, {}),
    (action("show_doubt", frame=31, person=0), "seek", {"frame": 31}),
    (action("stop", of="find"), "find_people", {"action": "stop"}),
    (action("stop", of="track"), "track", {"action": "stop"}),
    (action("stop", of="sizes"), "acquire", {"action": "stop", "person": 0}),
    (action("stop", of="calibration"), "calibration_check", {"action": "stop"}),
    (action("stop", of="observations"), "observations", {"action": "stop", "name": ""}),
    (action("stop", of="range"), "stop_range", {}),
    (action("stop", of="search"), "search", {"action": "stop", "person": None}),
    (action("take_all_back", frame=12), "limb_back", {"frame": 12, "every": True}),
    (action("track"), "track", {"action": "forward", "until": None}),
    (action("track", of="backward", frame=12), "track", {"action": "backward", "until": None}),
    (action("track_again"), "calibration_check", {"action": "track_again"}),
]  # fmt: skip


async def test_each_button_does_what_it_says(page, endpoint):
    for one, kind, fields in DEEDS:
        endpoint.received.clear()
        await advise(endpoint, said(f"Now {one['deed']} {one['of']}.", one))
        await shows(page, f"{TEXT} === 'Now {one['deed']} {one['of']}.'")
        await page.locator("#advice-actions button").click()
        if kind is not None:
            await until(lambda: {"type": kind, **fields}.items() <= (endpoint.heard(kind) or [{}])[-1].items())  # noqa: B023
        await command(page, "Dismiss what the line says")  # an answer
    assert await page.evaluate("document.activeElement === document.body")  # keys go to the views


async def test_buttons_show_sections_views_silhouettes_and_the_export(page, endpoint):
    shown = {
        "show_section": ("sizes", "document.querySelector('[data-section=body]').open"),
        "show_view": ("", "quadrille.state.filled === 1"),
        "show_silhouettes": ("", "quadrille.state.layers.shown.silhouette && quadrille.state.active === 1"),
    }
    for deed, (of, holds) in shown.items():
        await advise(endpoint, said(f"Look: {deed}.", action(deed, camera=1, of=of, frame=12)))
        await page.locator(f"#advice [data-deed={deed}]").click()
        await shows(page, holds)


@pytest.mark.slow
async def test_work_shows_its_share_and_the_time_left(page, endpoint):
    for share in (0.0, 0.1, 0.2):
        work = said("Finding people", action("stop", "Stop", of="find"), level="work", share=share, done=f"{share:.0%}")
        await advise(endpoint, work | {"situation": "find"})
        await page.wait_for_timeout(1100)
    assert re.fullmatch("20%, .* left", await page.locator("#advice-figures").inner_text())
    assert await page.evaluate("document.querySelector('#advice-share').value") == 0.2
    await advise(endpoint, work | {"situation": "find", "is_timed": False})
    await shows(page, "document.querySelector('#advice-figures').textContent === '20%'")
    await page.keyboard.press("Period")  # one looks around meanwhile
    await until(lambda: endpoint.heard("seek") == [{"type": "seek", "frame": 13}])
    await advise(endpoint, said("Finding people", level="work", situation="find"))
    await shows(page, "document.querySelector('#advice-share').hidden")


async def test_an_answer_is_said_for_a_while_and_kept_in_the_list(page, endpoint):
    await advise(endpoint, said("What is next."))
    for text in ("one thing", "another", "one thing", "one thing"):
        await answer(endpoint, text)
    await shows(page, f"{TEXT} === 'one thing' && document.querySelector('#advice').dataset.level === 'fault'")
    await command(page, "Dismiss what the line says")
    await shows(page, f"{TEXT} === 'What is next.'")
    await command(page, "Earlier sentences of the line")
    lines = await page.locator("#advice-log-list span").all_inner_texts()
    assert lines[:4] == ["What is next.", "one thing (2 times)", "another", "one thing"]
    await page.locator("#clear-advice-log").click()
    assert await page.locator("#advice-log-none").is_visible()


@pytest.mark.slow
async def test_an_answer_ends_by_itself(page, endpoint):
    await advise(endpoint, said("What is next."))
    await answer(endpoint, "a word", "info")
    await shows(page, f"{TEXT} === 'a word'")
    await shows(page, f"{TEXT} === 'What is next.'", timeout_s=10)


@pytest.mark.slow
async def test_an_edit_that_is_not_saved_holds_the_page(fresh_page, endpoint):
    page = fresh_page
    await endpoint.tell(saved=False, save_error="the disk is full; make room")
    await page.locator("#saved.is-failed").click()
    await until(lambda: len(endpoint.heard("save")) == 1)
    prompts = []

    async def stay(dialog):
        prompts.append(dialog.type)
        await dialog.dismiss()

    page.on("dialog", stay)
    await page.close(run_before_unload=True)
    await until(lambda: prompts == ["beforeunload"])
    await endpoint.tell(saved=True, save_error=None)
    await shows(page, "document.querySelector('#saved').textContent === 'All saved'")
    assert await page.evaluate("dispatchEvent(new Event('beforeunload', { cancelable: true }))")


CUT_OFF = """() => [...document.querySelectorAll("#advice button, #advice-text")].filter((one) => {
  const box = one.getBoundingClientRect();
  const isClipped = one.scrollWidth > one.clientWidth + 1 || one.scrollHeight > one.clientHeight + 1;
  return box.width > 0 && (box.right > innerWidth || isClipped);
}).map((one) => one.textContent)"""
"""JavaScript: which parts of the line are cut off."""


@pytest.mark.slow
@pytest.mark.parametrize("endpoint", [{"n_people": 1}, {"n_people": 2}], indirect=True, ids=("one", "two"))
async def test_the_line_is_whole_in_every_window(page, endpoint):
    buttons = [
        action("track", "Track from here"),
        action("show_before", "Show before"),
        action("take_back", "Take back"),
    ]
    await advise(endpoint, said(LONG, *buttons, level="fault"))
    await shows(page, f"{TEXT}.startsWith('Not saved')")
    for width, height in ((1920, 1080), (1280, 720), (1100, 680), (1024, 768)):
        await page.set_viewport_size({"width": width, "height": height})
        await shows(page, f"innerWidth === {width}")
        assert await page.evaluate(CUT_OFF) == [], width


async def test_the_steps_of_a_chain_are_one_bar(page, endpoint):
    chain = dict(steps=("find", "sizes", "track"), step=1, share=0.25, at_most_s=62)
    await advise(endpoint, said("Trying frame 4 of 12", action("take_found"), level="work", **chain))
    await shows(page, "document.querySelector('#advice [aria-current=step]')?.textContent === 'sizes'")
    assert await page.locator("#advice .steps-bar li").all_inner_texts() == ["find", "sizes", "track"]
    assert await page.locator("#advice-share").is_hidden()
    assert await page.locator("#advice-figures").inner_text() == "at most 65 s left in this step"
