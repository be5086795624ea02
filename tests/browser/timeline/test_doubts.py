"""The queue of doubtful and lost poses: ranked, with thumbnails, walked through, resolved."""

import pytest
from page_driver import command, handle_of, shows, state_of, to_client, toggle_layer, until

ROWS = "[...document.querySelectorAll('#doubt-list li')]"
LOADED = f"{ROWS}.every((row) => row.querySelector('img').naturalWidth > 0)"


async def rows_of(page):
    return [row.split("\n") for row in await page.locator("#doubt-list .doubt").all_inner_texts()]


@pytest.mark.slow
@pytest.mark.endpoint(n_people=2)
async def test_doubts_are_listed_by_severity_and_vanish_when_they_are_resolved(page, endpoint):
    await command(page, "Doubtful and lost poses, most severe first")
    await shows(page, f"{ROWS}.length === 4 && {LOADED}")
    doubtful = ["right arm: 31 % chance that it is lost", "frames 31–32"]
    lost = ["left arm: 97 % chance that it is lost", "right arm: 4 %", "frame 50"]
    assert await rows_of(page) == [
        ["lost", "person 0", *lost], ["lost", "person 1", *lost],
        ["doubtful", "person 0", *doubtful], ["doubtful", "person 1", *doubtful],
    ]  # fmt: skip
    assert {url.split("v=")[0] for url in endpoint.thumbnails} == {
        f"thumbnail/{person}/{frame}?limb={limb}&" for person in (0, 1) for frame, limb in ((50, 0), (31, 1))
    }
    await toggle_layer(page, "faces")
    await until(lambda: all("&blurred&" in url for url in endpoint.thumbnails[4:]) and len(endpoint.thumbnails) == 8)
    assert "4 to check" in await page.locator("#doubts-count").inner_text()
    await page.locator("#doubt-list .doubt").nth(1).click()
    await shows(page, "quadrille.state.state.frame === 50 && quadrille.state.state.person === 1")
    await shows(page, f"{ROWS}[1].classList.contains('is-current')")
    await command(page, "Accept the doubtful or lost poses here: mark them as reviewed")
    await shows(page, f"{ROWS}.length === 3")
    assert [(m["action"], m["first"], m["last"], m["person"]) for m in endpoint.heard("range")] == [
        ("reviewed", 50, 50, 1)
    ]
    n_loaded = len(endpoint.thumbnails)
    for frame, person in ((31, 0), (31, 1)):  # the next takes the place of the one that was resolved
        await command(page, "Next doubtful or lost pose by severity")
        await shows(page, f"quadrille.state.state.frame === {frame} && quadrille.state.state.person === {person}")
    await command(page, "Previous doubtful or lost pose by severity")
    await shows(page, "quadrille.state.state.person === 0")
    for left in (2, 1, 0):
        await page.locator("#doubt-list .doubt-accept").first.click()
        await shows(page, f"{ROWS}.length === {left}")
    assert (
        await page.locator("#doubts-empty").inner_text() == "All 6 doubtful and lost poses are confirmed or reviewed."
    )
    assert len(endpoint.thumbnails) == n_loaded  # those that stay are not loaded again
    await command(page, "Next doubtful or lost pose by severity")
    await page.locator("#advice-text", has_text="no doubtful or lost frame left").wait_for()


async def replace_doubts(page, endpoint, doubts, **marks):
    """Let the page know these doubts alone: probabilities of the limbs by frame."""
    rest = endpoint.cell(31) | {"status": "good", "limbs_lost": [], "remark": "", "reviewed": False, "keyframe": False}
    cells = {str(k): rest for k in range(10, 120)} | {
        str(k): rest | {"status": "doubtful", "limbs_lost": limbs} | marks for k, limbs in doubts.items()
    }
    await endpoint.broadcast({"type": "timeline", "person": None, "cells": cells, "replace": True})
    await shows(page, f"quadrille.state.timeline[{max(doubts)}]?.status === 'doubtful'")


@pytest.mark.slow
async def test_doubts_of_one_cause_are_one_entry(page, endpoint):
    right_arm = {k: [0.0, 0.44 if k == 40 else 0.2, 0.03, 0.0, 0.0] for k in (*range(30, 46), *range(52, 60), 75)}
    left_leg = {k: [0.0, 0.0, 0.3, 0.0, 0.0] for k in (47, 110)}
    await replace_doubts(page, endpoint, right_arm | left_leg)
    await command(page, "Doubtful and lost poses, most severe first")
    await shows(page, f"{ROWS}.length === 3")
    assert await rows_of(page) == [
        ["doubtful", "right arm: 44 % chance that it is lost", "left leg: 3 %", "frames 30–75, in 3 stretches"],
        ["doubtful", "left leg: 30 % chance that it is lost", "frame 47"],
        ["doubtful", "left leg: 30 % chance that it is lost", "frame 110"],
    ]
    await page.locator("#doubt-list .doubt-accept").first.click()
    await until(lambda: len(endpoint.heard("range")) == 3)
    assert [(m["first"], m["last"]) for m in endpoint.heard("range")] == [(30, 45), (52, 59), (75, 75)]
    await shows(page, f"{ROWS}.length === 2")


@pytest.mark.slow
@pytest.mark.endpoint(n_frames=1200)
async def test_ten_entries_are_listed_before_more(page, endpoint):
    await replace_doubts(page, endpoint, {k: [0.05 + k / 3000, 0.0, 0.0, 0.0, 0.0] for k in range(100, 1100, 60)})
    await command(page, "Doubtful and lost poses, most severe first")
    await shows(page, f"{ROWS}.length === 11")
    assert await page.locator("#doubts-count").inner_text() == "17 to check, the 10 most severe are listed"
    await page.get_by_role("button", name="7 more").click()
    await shows(page, f"{ROWS}.length === 17 && document.activeElement === {ROWS}[10].querySelector('button')")
    await command(page, "Doubtful and lost poses, most severe first")
    await shows(page, "document.querySelector('#doubts').hidden")
    await command(page, "Doubtful and lost poses, most severe first")
    await shows(page, f"{ROWS}.length === 11")


@pytest.mark.slow
@pytest.mark.parametrize("way", ["entry", "key"])
async def test_going_to_a_doubt_selects_the_limb_and_zooms_the_views_that_show_it(page, endpoint, way):
    assert await page.evaluate("quadrille.state.views.every(({ zoom }) => zoom === 1)")
    if way == "entry":
        await command(page, "Doubtful and lost poses, most severe first")
        await page.locator("#doubt-list .doubt").first.click()
    else:
        for _ in range(3):
            await page.keyboard.press("n")
            frames = [m["frame"] for m in endpoint.heard("seek")]
            await shows(page, f"quadrille.state.shown.frame === {frames[-1] if frames else 12}")
    await shows(page, "quadrille.state.shown.frame === 50 && quadrille.state.state.point === 'l_wrist'")
    # The left arm is visible in FRONT and BACK, in which it is on the right and on the left.
    await shows(page, "quadrille.state.views[0].zoom > 1.5 && quadrille.state.views[2].zoom > 1.5")
    others = await page.evaluate("[1, 3].map((camera) => quadrille.state.views[camera].zoom)")
    # By key it went to the right arm on frames 31 and 32 before: RIGHT and LEFT show the whole person again.
    assert others == [1, 1] if way == "entry" else max(others) < 1.5
    for camera in (0, 2):
        box = await page.locator(".pane").nth(camera).bounding_box()
        for point in ("l_shoulder", "l_wrist"):
            x, y = await to_client(page, camera, *await handle_of(page, camera, point))
            assert box["x"] < x < box["x"] + box["width"]
            assert box["y"] < y < box["y"] + box["height"]


KEYFRAME = {
    "person": 0, "frame": 40, "distance_cm": 26.9, "point": "l wrist",
    "views": [{"camera": 2, "cost_px": 5.1, "usual_px": 2.0}], "reason": "",
}  # fmt: skip


async def test_an_assessed_keyframe_is_listed_with_the_limb_in_doubt(page, endpoint):
    await replace_doubts(page, endpoint, {40: [0.0, 0.9, 0.0, 0.0, 0.0]}, reviewed=True, keyframe=True)
    await command(page, "Doubtful and lost poses, most severe first")
    assert await rows_of(page) == []
    doubt = KEYFRAME | {"distance_cm": None, "point": "", "views": [], "reason": "right arm uncertain without LEFT"}
    await endpoint.broadcast({"type": "inconsistent", "frames": [], "keyframes": [doubt]})
    await shows(page, f"{ROWS}.length === 1")
    told = "disagrees with the footage: right arm uncertain without LEFT"
    assert await rows_of(page) == [["keyframe", told, "frame 40"]]
    await page.locator("#doubt-list .doubt").click()
    await shows(page, "quadrille.state.shown.frame === 40 && quadrille.state.state.point === 'r_wrist'")
    assert told in await page.locator("#frame-card").inner_text()
    await command(page, "Accept the doubtful or lost poses here: mark them as reviewed")
    await until(lambda: endpoint.heard("confirm_keyframe"))


async def test_a_keyframe_in_doubt_comes_first_and_takes_its_neighbours(page, endpoint):
    await replace_doubts(page, endpoint, {39: [0.2, 0.0, 0.0, 0.0, 0.0], 41: [0.0, 0.3, 0.0, 0.0, 0.0]})
    await command(page, "Doubtful and lost poses, most severe first")
    await shows(page, f"{ROWS}.length === 2")
    before = await page.locator("#timeline canvas").first.screenshot()
    await endpoint.broadcast({"type": "inconsistent", "frames": [40], "keyframes": [KEYFRAME]})
    await shows(page, f"{ROWS}.length === 1")
    assert await rows_of(page) == [
        ["keyframe", "disagrees with its neighbours: l wrist 27 cm off",
         "disagrees with BACK: 5.10 px, usually 2.00 px", "frames 39–41"]
    ]  # fmt: skip
    assert await page.locator("#timeline canvas").first.screenshot() != before
    await page.locator("#doubt-list .doubt").click()
    await shows(page, "quadrille.state.shown.frame === 40 && quadrille.state.state.point === 'l_wrist'")
    card = page.locator("#frame-card")
    assert "disagrees with its neighbours: l wrist 27 cm off" in await card.inner_text()
    await command(page, "Accept the doubtful or lost poses here: mark them as reviewed")
    await until(lambda: endpoint.heard("confirm_keyframe"))
    assert endpoint.heard("confirm_keyframe") == [{"type": "confirm_keyframe", "person": 0, "frame": 40}]
    assert [(m["first"], m["last"]) for m in endpoint.heard("range")] == [(39, 41)]
    await endpoint.broadcast({"type": "inconsistent", "frames": [], "keyframes": []})
    await shows(page, f"{ROWS}.length === 0")
    assert "disagrees" not in await card.inner_text()


@pytest.mark.slow
@pytest.mark.endpoint(n_frames=6)
async def test_an_empty_list_says_why(page, endpoint):
    await command(page, "Doubtful and lost poses, most severe first")
    empty = page.locator("#doubts-empty")
    await empty.wait_for()
    assert (await empty.inner_text()).startswith("No frame has been tracked. ")
    cells = {str(k): endpoint.cell(12) for k in range(6)}
    await endpoint.broadcast({"type": "timeline", "person": None, "cells": cells, "replace": False})
    await shows(page, "document.querySelector('#doubts-empty').textContent === 'No pose is doubtful or lost.'")
    assert (await state_of(page))["drawer"] == "doubts"
    await command(page, "Doubtful and lost poses, most severe first")
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
