"""The popover that opens another session: recent ones, a typed folder, what is refused."""

import json
import re

import pytest
from page_driver import command, shows

RECENT = {"refusal": None, "folder": "/data/here", "recent": [
    {"folder": "/data/walks/dance", "name": "dance", "opened": "2026-03-04T10:00:00+00:00"},
], "batches": []}  # fmt: skip
BATCH = {
    "name": "night_batch",
    "totals": {"done": 1, "failed": 1, "running": 0, "waiting": 0, "hours": 3.25, "share_verified": 0.1},
    "recordings": [
        {"name": "<b>lab</b>", "session": "/data/lab", "state": "failed", "expected_error_mm": None, "share_doubted": 0,
         "poses": 0, "verified": 0, "worst_frame": None, "worst_person": "", "seconds": 1, "contradiction": "",
         "error": "expected footage, found none; put it back"},
        {"name": "walk", "session": "/data/walk", "state": "done", "expected_error_mm": 21.34, "share_doubted": 0.25,
         "poses": 40, "verified": 4, "worst_frame": 17, "worst_person": "ann", "seconds": 63.2,
         "contradiction": "camera 'LEFT' seems off", "error": ""},
    ],
}  # fmt: skip
STARTED = {"steps": [], "at": 0, "folder": "/data/here"}
WHY = "expected a page that only its user can open, found one without a token"


@pytest.mark.slow
async def test_a_session_is_opened_by_its_folder_or_from_the_list(fresh_page, endpoint):
    page, listed, posted = fresh_page, dict(RECENT), []
    starting = [STARTED, *({"steps": ["Loading the program"], "at": 0} for _ in range(4)), STARTED | {"folder": "/b"}]

    async def answer(route):
        request, path = route.request, route.request.url.partition("/sessions")[2]
        if path.startswith("/paths"):
            await route.fulfill(json=[{"path": "/data/walks/", "is_session": False}])
        elif path == "/open":
            posted.append(json.loads(request.post_data)["folder"])
            is_good = posted[-1] == "/data/walks/dance"
            listed["folder"] = "/data/walks/dance" if is_good else listed["folder"]
            await route.fulfill(**({"json": {"name": "dance"}} if is_good else {"status": 400, "body": "no session"}))
        else:
            await route.fulfill(json=listed)

    async def start(route):
        await route.fulfill(json=starting.pop(0))

    await page.route(re.compile(r"/sessions(/|$)"), answer)
    await page.route("**/starting.json", start)
    await command(page, "Open another session")
    await shows(page, "document.activeElement.id === 'session-folder'")
    await shows(page, "document.querySelector('#recent-sessions').innerText.includes('/data/walks/dance')")
    await page.keyboard.type("/data/w")
    await shows(page, "document.querySelector('#session-folders option')?.value === '/data/walks/'")
    async with page.expect_event("console"):  # the browser reports each answer of 400
        await page.keyboard.press("Enter")
    await shows(page, "document.querySelector('#sessions-note.is-failed')?.textContent === 'no session'")
    page.errors.clear()
    async with page.expect_event("load"):
        await page.locator("#recent-sessions button").click()
        await shows(page, "document.querySelector('#advice-text').textContent === 'Opening dance…'")
        for socket in [*endpoint.sockets]:  # the program ends
            await socket.close()
        await shows(
            page, "document.querySelector('#advice-text').textContent === 'Opening dance: loading the program…'"
        )
    assert posted == ["/data/w", "/data/walks/dance"]
    await shows(page, "window.quadrille?.state.overlay")
    listed |= {"refusal": WHY, "recent": []}
    await page.locator("#session-name").click()
    await shows(page, f"document.querySelector('#sessions-note').textContent === '{WHY}'")
    assert await page.locator("#session-folder").is_disabled()
    assert endpoint.received == []


async def test_a_new_session_is_offered_at_the_first_start(fresh_page):
    page = fresh_page
    await page.route(re.compile(r"/sessions$"), lambda route: route.fulfill(json=RECENT | {"recent": []}))
    await page.route("**/sessions/models", lambda route: route.fulfill(json={"models": [], "default": "gavrila34"}))
    await command(page, "Open another session")
    await page.locator("#recent-sessions button").click()
    await page.locator("#new-session[open]").wait_for()
    assert not await page.locator("#sessions-panel").is_visible()


@pytest.mark.slow
async def test_the_page_says_why_no_session_can_be_made(fresh_page):
    page = fresh_page
    await page.route(
        re.compile(r"/sessions(/|$)"),
        lambda route: route.fulfill(json={"refusal": WHY, "folder": "", "recent": [], "batches": []}),
    )
    await page.keyboard.press("Control+k")
    await page.keyboard.type("new session")
    await page.keyboard.press("Enter")
    await page.get_by_text(WHY).first.wait_for()
    assert not await page.locator("#new-session").is_visible()


async def test_a_recording_of_a_batch_is_opened_at_its_worst_frame(fresh_page):
    page, posted = fresh_page, []

    async def answer(route):
        if route.request.url.endswith("/open"):
            posted.append(json.loads(route.request.post_data))
            await route.fulfill(json={"name": "walk"})
        else:
            await route.fulfill(json=RECENT | {"batches": [BATCH]})

    await page.route(re.compile(r"/sessions(/|$)"), answer)
    await page.route("**/starting.json", lambda route: route.fulfill(json=STARTED))
    await command(page, "Open another session")
    await page.get_by_text("night_batch").click()
    table = page.locator(".batch table")
    assert (await table.locator("tbody tr").all_inner_texts())[1].split("\t")[1:] == ["21.3", "25%", "4/40", "63"]
    assert "<b>lab</b>" in await table.inner_text()
    assert "camera 'LEFT' seems off" in await table.inner_text()
    assert await table.locator("button").count() == 1
    await table.get_by_role("button", name="walk").click()
    await shows(page, "!document.querySelector('#sessions-panel').matches(':popover-open')")
    assert posted == [{"folder": "/data/walk", "frame": 17, "person": "ann"}]
