"""The popover that opens another session: recent ones, a typed folder, what is refused."""

import json
import re

from page_driver import shows

RECENT = {"refusal": None, "folder": "/data/here", "recent": [
    {"folder": "/data/walks/dance", "name": "dance", "opened": "2026-03-04T10:00:00+00:00"},
]}  # fmt: skip
STARTED = {"steps": [], "at": 0, "folder": "/data/here"}
WHY = "expected a page that only its user can open, found --no-token"


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
    await page.keyboard.press("Control+o")
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
        await shows(page, "document.querySelector('#banner').textContent === 'Opening dance…'")
        for socket in [*endpoint.sockets]:  # the program ends
            await socket.close()
        await shows(page, "document.querySelector('#banner').textContent === 'Opening dance: loading the program…'")
    assert posted == ["/data/w", "/data/walks/dance"]
    await shows(page, "window.quadrille?.state.overlay")
    listed |= {"refusal": WHY, "recent": []}
    await page.locator("#session-name").click()
    await shows(page, f"document.querySelector('#sessions-note').textContent === '{WHY}'")
    assert await page.locator("#session-folder").is_disabled()
    assert endpoint.received == []


CHECKS = [{"passed": "The calibration has 4 cameras."}, {"warning": "'LEFT' and 'RIGHT' seem exchanged"}]


async def test_a_new_session_is_made_from_a_form_that_lists_the_checks(fresh_page):
    page, posted = fresh_page, []
    outcomes = [{"failed": "no video for camera LEFT"}, {"made": "/data/new"}]

    async def answer(route):
        if route.request.method == "POST":
            posted.append((route.request.url.partition("/sessions")[2], json.loads(route.request.post_data)))
            lines = [*CHECKS, outcomes[len(posted) - 1]] if len(posted) < 3 else [{"name": "new"}]
            await route.fulfill(body="\n".join(map(json.dumps, lines)))
        else:
            await route.fulfill(json=RECENT)

    await page.route(re.compile(r"/sessions(/|$)"), answer)
    await page.route("**/starting.json", lambda route: route.fulfill(json=STARTED | {"folder": "/data/new"}))
    await page.set_viewport_size({"width": 1280, "height": 720})
    await page.keyboard.press("Control+k")
    await page.keyboard.type("new session")
    await page.keyboard.press("Enter")
    for name, value in {"footage": "/data/videos", "calibration": "/data/cameras.toml", "folder": "/data/new"}.items():
        await page.fill(f"#new-{name}", value)
    await page.fill("#new-people", "ann, bob")
    await page.fill("#new-height", "170, 158.5")
    await page.keyboard.press("Enter")
    checks = page.locator("#new-session-checks li")
    await shows(page, "document.querySelectorAll('#new-session-checks li').length === 3")
    assert [await c.get_attribute("class") for c in await checks.all()] == ["is-passed", "is-warning", "is-failed"]
    await page.click("#make-session")
    await shows(page, "!document.querySelector('#open-made-session').hidden")
    box = await page.locator("#new-session").bounding_box()
    assert box["y"] >= 0
    assert box["y"] + box["height"] <= 720
    async with page.expect_event("load"):
        await page.click("#open-made-session")
    assert posted[1] == ("/new", {
        "folder": "/data/new", "calibration": "/data/cameras.toml", "footage": "/data/videos", "people": ["ann", "bob"],
        "heights_m": [1.7, 1.585], "up": "z", "units": None, "fps": None, "background": None,
    })  # fmt: skip
    assert posted[2] == ("/open", {"folder": "/data/new"})
