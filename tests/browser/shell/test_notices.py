"""What the program says: notices, their log, what is not saved, the first card; against `fake_endpoint`."""

import pytest
from page_driver import shows, until


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


async def test_escape_closes_the_last_notice_and_no_more_than_three_stand(page, endpoint):
    for k in range(5):
        await say(endpoint, f"notice {k}")
    await shows(page, "document.querySelectorAll('#notices .notice:not([hidden])').length === 3")
    await page.keyboard.press("Escape")
    shown = await page.locator("#notices .notice:visible span").all_inner_texts()
    assert shown == ["notice 2", "notice 3"]


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


async def test_what_is_not_saved_says_why_is_tried_again_and_holds_the_page(fresh_page, endpoint):
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


async def test_the_first_card_is_put_away_for_good_and_found_again(browser, address, endpoint):
    context = await browser.new_context(viewport={"width": 1280, "height": 720}, newcomer=True)
    page = await context.new_page()
    await page.goto(address)
    card = page.locator("#first-steps")
    await card.wait_for()
    assert not await page.locator("#first-choose-person").is_visible()
    assert "quadrille --sample elbow_rotation" in await card.inner_text()
    box, panes = await card.bounding_box(), await page.locator("#panes").bounding_box()
    assert box["x"] >= panes["x"] + panes["width"]
    assert box["y"] + box["height"] <= (await page.locator("#joint-bar").bounding_box())["y"]
    await say(endpoint, "a sentence of some length that says what was expected, what was found, and what to do now")
    await page.get_by_role("alert").wait_for()
    await page.locator("#close-first-steps").click(timeout=2000)  # the notice does not lie over it
    await page.reload()
    await shows(page, "window.quadrille?.state.overlay")
    assert not await card.is_visible()
    await page.keyboard.press("Control+k")
    await page.keyboard.type("first steps")
    await page.keyboard.press("Enter")
    await card.wait_for()
    await page.keyboard.press("Escape")
    assert not await card.is_visible()
    await context.close()


@pytest.mark.endpoint(n_people=2)
class TestSeveralPeople:
    async def test_the_first_card_begins_with_the_choice_of_a_person(self, page):
        await page.keyboard.press("Control+k")
        await page.keyboard.type("first steps")
        await page.keyboard.press("Enter")
        first = page.locator("#first-steps li:visible").first
        assert "Choose a person" in await first.inner_text()
