"""What the program says: notices, their log, what is not saved, the first card; against `fake_endpoint`."""

import pytest
import pytest_asyncio
from page_driver import reloaded, shows, until


async def say(endpoint, text, level="error"):
    await endpoint.broadcast({"type": "notice", "level": level, "text": text})


async def test_repeated_notices_are_counted_and_logged(page, endpoint):
    for text in ("one thing", "another", "one thing", "one thing"):
        await say(endpoint, text)
    await shows(page, "document.querySelector('.notice[data-count]')?.dataset.count === '× 3'")
    assert await page.locator("#notices .notice:visible").count() == 2
    await page.keyboard.press("Shift+Escape")
    assert await page.locator("#notices .notice:visible").count() == 0
    await page.keyboard.press("Shift+H")
    lines = await page.locator("#notice-log-list span").all_inner_texts()
    assert lines == ["one thing (2 times)", "another", "one thing"]
    await page.locator("#clear-notices").click()
    assert await page.locator("#notice-log-none").is_visible()


@pytest.mark.slow
async def test_escape_closes_the_last_notice_and_no_more_than_three_stand(page, endpoint):
    for k in range(5):
        await say(endpoint, f"notice {k}")
    await shows(page, "document.querySelectorAll('#notices .notice:not([hidden])').length === 3")
    await page.keyboard.press("Escape")
    shown = await page.locator("#notices .notice:visible span").all_inner_texts()
    assert shown == ["notice 2", "notice 3"]


@pytest.mark.slow
async def test_notices_leave_panes_and_bars_free(page, endpoint):
    await page.set_viewport_size({"width": 1280, "height": 720})
    await shows(page, "innerWidth === 1280")
    await say(endpoint, "a sentence of some length that says what was expected, what was found, and what to do now")
    await page.get_by_role("alert").wait_for()
    box = await page.locator("#notices .notice:visible").bounding_box()
    for part in ("#panes", "#joint-bar", "footer", ".top-bar"):
        other = await page.locator(part).bounding_box()
        apart = (
            box["x"] >= other["x"] + other["width"]
            or box["y"] >= other["y"] + other["height"]
            or box["y"] + box["height"] <= other["y"]
        )
        assert apart, (part, box, other)


@pytest.mark.slow
async def test_an_unsaved_edit_says_why_and_holds_the_page(fresh_page, endpoint):
    page = fresh_page
    assert not await page.locator("#unsaved").is_visible()
    endpoint.state |= {"saved": False, "save_error": "the disk is full; make room"}
    await endpoint.broadcast(endpoint.state)
    await page.locator("#unsaved").wait_for()
    assert "the disk is full; make room" in await page.locator("#unsaved-why").inner_text()
    await page.keyboard.press("Shift+Escape")  # this one stays until it is not true any more
    assert await page.locator("#unsaved").is_visible()
    await page.locator("#retry-saving").click()
    await page.locator("#saved").click()
    await until(lambda: len(endpoint.heard("save")) == 2)
    prompts = []

    async def stay(dialog):
        prompts.append(dialog.type)
        await dialog.dismiss()

    page.on("dialog", stay)
    await page.close(run_before_unload=True)
    await until(lambda: prompts == ["beforeunload"])
    endpoint.state |= {"saved": True, "save_error": None}
    await endpoint.broadcast(endpoint.state)
    await shows(page, "document.querySelector('#unsaved').hidden")
    assert await page.locator("#saved").inner_text() == "All saved"
    assert await page.evaluate("dispatchEvent(new Event('beforeunload', { cancelable: true }))")


TAKEN = """() => {
  const card = document.querySelector("#first-steps").getBoundingClientRect();
  const others = document.querySelectorAll(
    ".pane, .pane *, #scene, #inspector:not([hidden]), button, input, select, canvas, #notices > :not([hidden])",
  );
  return [...others].filter((one) => {
    const box = one.getBoundingClientRect();
    const isBeside = box.right <= card.left || box.left >= card.right;
    const isAboveOrBelow = box.bottom <= card.top || box.top >= card.bottom;
    return box.width > 0 && !isBeside && !isAboveOrBelow && !one.closest("#first-steps");
  }).map((one) => one.id || one.className || one.tagName);
}"""
"""JavaScript: which parts of the page the first steps cover."""
CUT_OFF = """() => [...document.querySelectorAll("#first-steps > :not(p), #first-steps li:not([hidden])")].filter(
  (one) => one.scrollWidth > one.clientWidth + 1 || one.getBoundingClientRect().right > innerWidth
).length"""


BY_HAND = {"sources": ("manual",)}
"""A session that was never tracked."""


@pytest_asyncio.fixture(loop_scope="session")
async def newcomer(browser, address):
    """The page of somebody who has never seen it."""
    context = await browser.new_context(viewport={"width": 1280, "height": 720}, newcomer=True)
    page = await context.new_page()
    await page.goto(address)
    yield page
    await context.close()


@pytest.mark.slow
@pytest.mark.parametrize(
    "endpoint", [{"n_people": 1, **BY_HAND}, {"n_people": 2, **BY_HAND}], indirect=True, ids=("one", "two")
)
async def test_the_first_steps_cover_nothing(newcomer, endpoint):
    await shows(newcomer, "window.quadrille?.state.overlay")
    await newcomer.locator("#first-steps").wait_for()
    await say(endpoint, "a sentence of some length that says what was expected, what was found, and what to do now")
    await newcomer.get_by_role("alert").wait_for()
    assert await newcomer.locator("#first-place").is_visible() == (endpoint.n_people > 1)
    for width, height in ((1280, 720), (1920, 1080)):
        await newcomer.set_viewport_size({"width": width, "height": height})
        await shows(newcomer, f"innerWidth === {width}")
        assert await newcomer.evaluate(TAKEN) == []
        assert await newcomer.evaluate(CUT_OFF) == 0
        footer = await newcomer.locator("footer").bounding_box()
        assert footer["y"] + footer["height"] <= height


@pytest.mark.slow
@pytest.mark.endpoint(**BY_HAND)
async def test_the_first_steps_tell_the_shortest_way_and_are_closed_for_good(newcomer, endpoint):
    card = newcomer.locator("#first-steps")
    await card.wait_for()
    steps = [" ".join(text.split()) for text in await card.locator("li:visible").all_inner_texts()]
    shortest = ["Press F to search", "then G to fit", "then T to track"]
    assert [step.rstrip(",") for step in steps] == shortest
    # A body that stands far from the person is not found by a search.
    endpoint.state |= {"cost_px": 28.4, "people": [endpoint.state["people"][0] | {"source": None}]}
    await endpoint.broadcast(endpoint.state)
    await newcomer.locator("#first-place").wait_for()
    steps = [" ".join(text.split()) for text in await card.locator("li:visible").all_inner_texts()]
    assert [step.rstrip(",") for step in steps] == [
        "Place the body: drag the square, then joints, in two views", *shortest
    ]  # fmt: skip
    assert not await newcomer.locator("#first-off").is_visible()
    endpoint.state["compared"] = {
        "number": 1, "work": "fit", "before_px": 6.3, "after_px": 2.4, "before_view_costs_px": [],
        "after_view_costs_px": [], "warning": "", "moved": [], "is_before_shown": False,
    }  # fmt: skip
    await endpoint.broadcast(endpoint.state)
    await shows(newcomer, "document.querySelector('#first-fit').classList.contains('is-done')")
    await newcomer.locator("#close-first-steps").click()
    await reloaded(newcomer, "window.quadrille?.state.overlay")
    assert not await card.is_visible()
    await newcomer.keyboard.press("Control+k")
    await newcomer.keyboard.type("first steps")
    await newcomer.keyboard.press("Enter")
    await card.wait_for()
    await newcomer.keyboard.press("Escape")
    assert not await card.is_visible()
    await newcomer.evaluate("localStorage.clear()")
    await newcomer.reload()
    await card.wait_for()
    await newcomer.keyboard.press("t")
    await card.wait_for(state="hidden")  # the first steps are done


@pytest.mark.slow
@pytest.mark.endpoint(**BY_HAND)
async def test_the_first_steps_belong_to_a_session(newcomer, address, endpoint):
    """Closed in one, they show in the next one, but not where a run has tracked."""
    card = newcomer.locator("#first-steps")
    await card.wait_for()
    assert await newcomer.locator("#first-new-session").is_visible()
    await newcomer.locator("#close-first-steps").click()
    endpoint.name = "dance"
    await newcomer.goto(address)
    await shows(newcomer, "window.quadrille?.state.session?.name === 'dance'")
    await card.wait_for()
    endpoint.name, endpoint.sources = "walk", ("manual", "tracked")
    await newcomer.goto(address)
    await shows(newcomer, "window.quadrille?.state.overlay && quadrille.state.session.name === 'walk'")
    assert not await card.is_visible()
    await newcomer.keyboard.press("Control+k")
    await newcomer.keyboard.type("first steps")
    await newcomer.keyboard.press("Enter")
    await card.wait_for()
