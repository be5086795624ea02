"""The page that is opened while the program starts: it is loaded once, and connects when the program serves it."""

import asyncio
from contextlib import asynccontextmanager

import pytest
from fake_endpoint import FakeEndpoint
from page_driver import OPENED, shows

from app.server.address import Serving
from app.server.doorway import STEPS, Doorway
from app.server.server import create_app, serve_forever
from app.server.static_files import static_folder

COVERED = "getComputedStyle(document.querySelector('#starting')).display !== 'none'"


@pytest.fixture
def doorway(monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    with Doorway(Serving(port=0, browser=False)) as doorway:
        yield doorway


@asynccontextmanager
async def opened(browser, address):
    """The page at an address, with its errors."""
    context = await browser.new_context(viewport={"width": 1280, "height": 720})
    try:
        page = await context.new_page()
        page.errors = []
        page.on("pageerror", lambda error: page.errors.append(str(error)))
        await page.goto(address)
        yield page
    finally:
        await context.close()


@asynccontextmanager
async def program(doorway, blank_viser):
    """What serves the doorway's port next."""
    doorway.close()
    app = create_app(FakeEndpoint(), blank_viser, doorway.access, static_folder())
    serving = asyncio.ensure_future(serve_forever(app, [each.dup() for each in doorway.sockets], lambda: None))
    yield
    serving.cancel()
    await asyncio.gather(serving, return_exceptions=True)


async def test_the_page_waits_for_the_program_and_connects_without_being_loaded_again(browser, doorway, blank_viser):
    async with opened(browser, doorway.address) as page:
        doorway.show(STEPS[1])
        await shows(page, f"{COVERED} && document.querySelector('#steps [aria-current]')?.innerText === '{STEPS[1]}'")
        await page.evaluate("window.loadedOnce = true")
        async with program(doorway, blank_viser):
            await shows(page, OPENED)
            assert await page.evaluate(f"window.loadedOnce && !({COVERED})")
            assert "token" not in page.url
        assert page.errors == []


async def test_a_page_without_its_token_is_refused_once_the_program_has_started(browser, doorway, blank_viser):
    async with opened(browser, doorway.address.partition("?")[0]) as page:
        await shows(page, "document.querySelector('#steps li')")
        async with page.expect_event("load") as refused, program(doorway, blank_viser):
            await refused.value
        assert "expected the token of this start" in await page.inner_text("body")


async def test_a_page_whose_program_has_ended_says_so(browser, doorway):
    async with opened(browser, doorway.address) as page:
        await shows(page, "document.querySelector('#steps li')")
        doorway.__exit__(None, None, None)
        await shows(page, f"{COVERED} && document.querySelector('#start-note').innerText.includes('does not answer')")
