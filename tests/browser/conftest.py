import os
from pathlib import Path

import pytest
import pytest_asyncio
from aiohttp import web
from chromium import FLAGS, chromium_path
from fake_endpoint import FakeEndpoint
from page_driver import OPENED, listening, shows
from playwright.async_api import Error, async_playwright

from app.server.access import Access
from app.server.server import create_app, static_folder


def pytest_collection_modifyitems(items):
    for item in items:
        if Path(__file__).parent in item.path.parents:
            item.add_marker(pytest.mark.browser)
            # One event loop for all: the browser is started once, and the server under test runs beside the test.
            item.add_marker(pytest.mark.asyncio(loop_scope="session"), append=False)


@pytest_asyncio.fixture(loop_scope="session", scope="session")
async def browser():
    async with async_playwright() as playwright:
        try:
            browser = await playwright.chromium.launch(executable_path=chromium_path(), args=FLAGS)
        except Error as error:
            why = f"no Chromium to drive the page with (`make test` finds or installs one): {error}"
            pytest.fail(why) if os.environ.get("CI") == "true" else pytest.skip(why)
        browser.new_context = _of_a_regular(browser.new_context)
        yield browser
        await browser.close()


def _of_a_regular(new_context):
    """Contexts of users who have put the card with the first steps away; it would lie over the 3-D view."""

    async def of_a_regular(newcomer=False, **options):
        context = await new_context(**options)
        if not newcomer:
            await context.add_init_script(
                "try { localStorage.setItem('quadrille.first_steps', 'seen'); } catch { /* not our page */ }"
            )
        return context

    return of_a_regular


@pytest_asyncio.fixture(loop_scope="session")
async def blank_viser(tmp_path):
    """A 3-D view that is an empty page: quick, and the shell's tests need no more."""

    async def answer(_request):
        return web.Response(text="<!doctype html><title>3-D</title><body tabindex=0>", content_type="text/html")

    app = web.Application()
    app.router.add_get("/{path:.*}", answer)
    runner = web.AppRunner(app, shutdown_timeout=0.1)
    await runner.setup()
    await web.UnixSite(runner, tmp_path / "viser").start()
    yield tmp_path / "viser"
    await runner.cleanup()


@pytest.fixture
def endpoint():
    return FakeEndpoint()


@pytest_asyncio.fixture(loop_scope="session")
async def address(endpoint, blank_viser):
    app = create_app(endpoint, blank_viser, Access(), static_folder())
    async with listening(app) as port:
        yield f"http://127.0.0.1:{port}/"


@pytest_asyncio.fixture(loop_scope="session")
async def page(browser, address):
    """The page with its first frame on the screen; fails the test where the page reports an error."""
    context = await browser.new_context(viewport={"width": 1440, "height": 900}, color_scheme="dark")
    page = await context.new_page()
    errors = []
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.on("console", lambda message: errors.append(message.text) if message.type == "error" else None)
    await page.goto(address)
    await shows(page, OPENED)
    page.errors = errors
    yield page
    await context.close()
    assert not errors
