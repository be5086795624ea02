"""The section of observations: sets, their judgement, the way through the worst, and what it asks of the program."""

import pytest
from page_driver import command, shows, until

SETS = [
    {"name": "mp", "format": "openpose", "people": ["person"], "is_in_space": False, "frames": 40, "problem": ""},
    {"name": "old", "format": "", "people": [], "is_in_space": False, "frames": 0, "problem": "Expected a file."},
]
EMPTY = {
    "type": "imported", "sets": SETS, "shown": "", "is_previewed": False, "running": False, "stage": "", "share": 0,
    "message": "", "failed": False, "judged": "", "people": [], "worst": [], "off": 0,
}  # fmt: skip
LIMB = {
    "person": 0, "frame": 9, "limb": "left arm", "joint": "l_wrist", "reason": "left arm jumps", "probability": 0.98,
    "distance_mm": 210,
}  # fmt: skip
JUDGED = EMPTY | {
    "shown": "mp", "judged": "mp", "off": 2, "worst": [LIMB, LIMB | {"frame": 4, "reason": "arms exchanged"}],
    "people": [
        {"name": "person", "share_in_order": 0.9, "frames": 40, "sentences": ["left hip off by 4 cm throughout"]}
    ],
}  # fmt: skip


@pytest.fixture
def section(page):
    return page.locator("[data-section=observations]")


async def opened(page, endpoint, message):
    await endpoint.broadcast(message)
    await command(page, "Observations of other programs")
    await shows(page, "document.querySelector('[data-section=observations]').open")
    await shows(page, "document.querySelector('.observed-sets li')")


async def test_sets_are_listed_shown_and_judged(page, endpoint, section):
    await opened(page, endpoint, EMPTY)
    rows = await page.locator(".observed-sets li").all_inner_texts()
    assert "openpose, key points of person, 40 frames" in rows[0]
    assert "Expected a file." in rows[1]
    assert await section.get_by_role("button", name="Show old").is_disabled()
    await section.get_by_role("button", name="Show mp").click()
    await until(lambda: endpoint.received[-1] == {"type": "observations", "action": "show", "name": "mp"})
    await section.get_by_role("button", name="Judge", exact=True).click()
    await until(lambda: endpoint.received[-1] == {"type": "observations", "action": "judge", "name": "mp"})
    await endpoint.broadcast(EMPTY | {"running": True, "stage": "tracking", "share": 0.4})
    await section.get_by_text("Tracking …").wait_for()
    assert await section.get_by_role("button", name="Judge", exact=True).is_hidden()
    await section.get_by_role("button", name="Stop").click()
    await until(lambda: endpoint.received[-1]["action"] == "stop")


async def test_people_are_detected_where_nothing_was_imported(page, endpoint, section):
    await endpoint.broadcast(EMPTY | {"sets": []})
    await command(page, "Observations of other programs")
    detect = section.get_by_role("button", name="Detect people")
    await detect.click()
    await until(lambda: endpoint.received[-1] == {"type": "observations", "action": "detect", "name": ""})
    await endpoint.broadcast(EMPTY | {"sets": [], "running": True, "stage": "detecting people", "share": 0.4})
    await section.get_by_text("Detecting people …").wait_for()
    assert await detect.is_hidden()


FINDING = {
    "type": "finding", "running": True, "stage": "acquiring sizes", "share": 0.5, "message": "", "failed": False,
    "notes": [], "frame": None, "axes": [],
}  # fmt: skip


async def test_people_are_tracked_by_the_evidence_that_is_chosen(page, endpoint, section):
    await opened(page, endpoint, EMPTY)
    track = section.get_by_role("button", name="Track by", exact=True)
    for choice, action in (("contours and points", "track"), ("contours alone", "track_contours")):
        await section.get_by_label("Evidence").select_option(choice)
        await track.click()
        await until(lambda a=action: endpoint.received[-1] == {"type": "observations", "action": a, "name": "mp"})
    await endpoint.broadcast(FINDING)
    await section.get_by_text("Acquiring sizes …").wait_for()
    assert await track.is_hidden()
    await section.get_by_role("button", name="Stop").click()
    await until(lambda: endpoint.received[-1] == {"type": "find_people", "action": "stop"})
    await endpoint.broadcast(FINDING | {"running": False, "failed": True, "message": "No frame shows a person."})
    await section.locator(".is-failed", has_text="No frame shows a person.").wait_for()
    assert await track.is_visible()


async def test_the_worst_are_gone_through_by_click_and_key(page, endpoint, section):
    await opened(page, endpoint, JUDGED)
    assert "90 % of 40 frames in order; 2 limbs are off." in await section.inner_text()
    assert "Left hip off by 4 cm throughout." in await section.inner_text()
    await page.locator(".observed-worst button").first.click()
    await until(lambda: {"type": "select", "person": 0, "point": "l_wrist"} in endpoint.received)
    await shows(page, "quadrille.state.target === 9")
    await command(page, "Next imported limb that is off")
    await shows(page, "quadrille.state.target === 4")
    assert "exchanged" in await page.locator(".observed-worst [aria-current]").inner_text()
    await command(page, "Previous imported limb that is off")
    await shows(page, "quadrille.state.target === 9")


@pytest.mark.endpoint(has_outlines=False)
async def test_a_network_is_offered_where_only_what_moves_shows_the_people(page, endpoint):
    await endpoint.broadcast(EMPTY)
    await command(page, "Inspector: sizes, settings (toggle)")
    find = page.locator("[data-section=find]")
    await page.evaluate("document.querySelector('[data-section=find]').open = true")
    await find.get_by_text("No camera has a background").wait_for()
    await find.get_by_role("button", name="Detect and track").click()
    asked = {"type": "observations", "name": ""}
    await until(lambda: endpoint.heard("observations") == [asked | {"action": "detect_track"}])
    await endpoint.broadcast(EMPTY | {"running": True, "stage": "detecting people", "share": 0.4})
    await find.get_by_text("detecting people").wait_for()
    assert not await find.get_by_role("button", name="Detect and track").is_visible()
    await find.get_by_role("button", name="Stop").click()
    await until(lambda: endpoint.heard("observations")[-1] == asked | {"action": "stop"})


async def test_problems_of_files_forbid_the_import(fresh_page, endpoint):
    page, section = fresh_page, fresh_page.locator("[data-section=observations]")
    await opened(page, endpoint, EMPTY)
    view = {"view": "FRONT", "place": "/a", "rows": 40, "frames": [0, 39], "most_people": 1, "confidence": 0.9,
        "share": None}  # fmt: skip
    plan = {
        "name": "new", "format": "openpose", "are_masks": False, "people": ["person"], "frames": 40, "views": [view],
        "skeleton": "BODY_25", "points": {"LWrist": ["l_wrist"], "Nose": []}, "matched": 1, "notes": [],
        "problems": [],
    }  # fmt: skip
    asked = []

    async def answer(route):
        asked.append(route.request.post_data_json)
        await route.fulfill(json=plan)

    await page.route("**/observations/plan", answer)
    await page.route("**/sessions/paths**", lambda route: route.fulfill(json=[]))  # completions
    await section.get_by_text("Import…").click()
    await page.fill("#import-paths", "/a")
    await page.fill("#import-name", "new")
    check = section.get_by_role("button", name="Check", exact=True)
    await check.click()
    await section.get_by_text("FRONT: 40 rows, points in frames 0 to 39, median confidence 0.90").wait_for()
    assert (asked[0]["paths"], asked[0]["offsets"]) == ("/a", {})
    await section.get_by_text("Details that the files lack").click()
    await page.fill("#import-offsets", "FRONT")
    await check.click()
    await section.locator(".is-failed", has_text="Expected offsets such as cam2=3, found “FRONT”.").wait_for()
    await page.fill("#import-offsets", "FRONT=3; LEFT = -1;")
    await check.click()
    await section.get_by_text("FRONT: 40 rows").wait_for()
    assert asked[-1]["offsets"] == {"FRONT": 3, "LEFT": -1}
    assert await section.get_by_role("button", name="Import", exact=True).is_enabled()
    plan |= {"are_masks": True, "people": []}
    view |= {"confidence": None, "share": 0.062}
    await check.click()
    await section.get_by_text("FRONT: 40 masks, people in frames 0 to 39, 6.2 % of the picture").wait_for()
    await section.get_by_text("The cameras will use these masks as silhouettes.").wait_for()
    plan["problems"] = ["Expected 40 pictures, found 30."]
    await check.click()
    await section.locator(".is-failed", has_text="found 30").wait_for()
    assert await section.get_by_role("button", name="Import", exact=True).is_disabled()
