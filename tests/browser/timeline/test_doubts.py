"""The queue of doubtful and lost poses: ranked, with thumbnails, walked through, resolved."""

from itertools import pairwise

import pytest
from page_driver import shows, state_of, until

ROWS = "[...document.querySelectorAll('#doubt-list li')]"
LOADED = f"{ROWS}.every((row) => row.querySelector('img').naturalWidth > 0)"


async def rows_of(page):
    return [row.split("\n") for row in await page.locator("#doubt-list .doubt").all_inner_texts()]


@pytest.mark.endpoint(n_people=2)
async def test_doubts_are_listed_by_severity_and_vanish_when_they_are_resolved(page, endpoint):
    await page.keyboard.press("Shift+L")
    await shows(page, f"{ROWS}.length === 4 && {LOADED}")
    doubtful = ["left arm 31 %", "frames 31–32"]
    lost = ["left arm 97 %", "right arm 4 %", "frame 50"]
    assert await rows_of(page) == [
        ["lost", "person 0", *lost], ["lost", "person 1", *lost],
        ["doubtful", "person 0", *doubtful], ["doubtful", "person 1", *doubtful],
    ]  # fmt: skip
    assert {url.split("v=")[0] for url in endpoint.thumbnails} == {
        f"thumbnail/{person}/{frame}?limb=0&" for person in (0, 1) for frame in (50, 31)
    }
    assert "4 to check" in await page.locator("#doubts-count").inner_text()
    await page.locator("#doubt-list .doubt").nth(1).click()
    await shows(page, "quadrille.state.state.frame === 50 && quadrille.state.state.person === 1")
    await shows(page, f"{ROWS}[1].classList.contains('is-current')")
    await page.keyboard.press("Alt+Enter")
    await shows(page, f"{ROWS}.length === 3")
    assert [(m["action"], m["first"], m["last"], m["person"]) for m in endpoint.heard("range")] == [
        ("reviewed", 50, 50, 1)
    ]
    n_loaded = len(endpoint.thumbnails)
    for frame, person in ((31, 0), (31, 1)):  # the next takes the place of the one that was resolved
        await page.keyboard.press("Alt+ArrowDown")
        await shows(page, f"quadrille.state.state.frame === {frame} && quadrille.state.state.person === {person}")
    await page.keyboard.press("Alt+ArrowUp")
    await shows(page, "quadrille.state.state.person === 0")
    for left in (2, 1, 0):
        await page.locator("#doubt-list .doubt-accept").first.click()
        await shows(page, f"{ROWS}.length === {left}")
    assert (
        await page.locator("#doubts-empty").inner_text() == "All 6 doubtful and lost poses are confirmed or reviewed."
    )
    assert len(endpoint.thumbnails) == n_loaded  # those that stay are not loaded again
    await page.keyboard.press("Alt+ArrowDown")
    await page.locator("#notices .notice", has_text="no doubtful or lost frame left").wait_for()


@pytest.mark.endpoint(n_frames=12_000)
async def test_a_long_stretch_is_listed_in_pieces_around_its_worst_frames(page, endpoint):
    def cell(frame, worst):
        limbs = [0.0, worst, 0.03, 0.0, 0.0]
        return endpoint.cell(31) | {"source": "tracked", "limbs_lost": limbs, "reviewed": False, "keyframe": False}

    cells = {str(k): cell(k, 0.44 if k == 1040 else 0.2 if k == 1100 else 0.1) for k in range(1000, 1121)}
    cells |= {str(k): None for k in (31, 32, 50)}
    await endpoint.broadcast({"type": "timeline", "person": None, "cells": cells, "replace": False})
    await shows(page, "quadrille.state.timeline[1040]?.status === 'doubtful'")
    await page.keyboard.press("Shift+L")
    await shows(page, f"{ROWS}.length === 4")
    rows = await rows_of(page)
    assert rows[0] == ["doubtful", "right arm 44 %", "left leg 3 %", "frames 1025–1055"]
    assert rows[1] == ["doubtful", "right arm 20 %", "left leg 3 %", "frames 1085–1120"]
    spans = sorted([int(k) for k in row[-1].removeprefix("frames ").split("–")] for row in rows)
    assert spans[0][0] == 1000
    assert spans[-1][1] == 1120
    assert all(after == before + 1 for (_, before), (after, _) in pairwise(spans))


@pytest.mark.endpoint(n_frames=6)
async def test_an_empty_list_says_why(page, endpoint):
    await page.keyboard.press("Shift+L")
    empty = page.locator("#doubts-empty")
    await empty.wait_for()
    assert (
        await empty.inner_text()
        == "No frame has been tracked. Press T to track; doubtful and lost poses are listed here."
    )
    cells = {str(k): endpoint.cell(12) for k in range(6)}
    await endpoint.broadcast({"type": "timeline", "person": None, "cells": cells, "replace": False})
    await shows(page, "document.querySelector('#doubts-empty').textContent === 'No pose is doubtful or lost.'")
    assert (await state_of(page))["drawer"] == "doubts"
    await page.keyboard.press("Shift+L")
    await until(lambda: not endpoint.thumbnails)
    await page.locator("#doubts").wait_for(state="hidden")


async def test_poses_that_were_accepted_are_no_longer_visited(page, endpoint):
    await page.locator("#show-jumps").click()
    row = page.locator(".jump-row", has_text="Doubtful or lost").locator("output")
    assert await row.inner_text() == "3"
    await page.get_by_role("button", name="List doubts by severity").click()
    await shows(page, f"{ROWS}.length === 2 && document.querySelector('#jump-menu').hidden")
    await page.locator("#doubt-list .doubt-accept").last.click()
    await shows(page, f"{ROWS}.length === 1")
    await page.keyboard.press("n")
    await shows(page, "quadrille.state.shown.frame === 50")  # not 31
