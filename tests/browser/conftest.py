import os
import subprocess
import sys
from pathlib import Path

import pytest
import pytest_asyncio
from aiohttp import web
from chromium import FLAGS, chromium_path
from fake_endpoint import FakeEndpoint
from page_driver import OPENED, shows
from playwright.async_api import Error, async_playwright
from serving import listening

from app.server.access import Access
from app.server.key_routes import KEYS_FILE, KeyRoutes
from app.server.private_viser import ViserPlace
from app.server.server import create_app
from app.server.static_files import static_folder

BLANK = "<!doctype html><title>3-D</title><link rel=icon href='data:,'><body tabindex=0>"
WITH_KERNELS = [Path(__file__).parent / room for room in ("live", "share")]
"""Folders of tests that need compiled kernels."""
VIEWPORT = {"width": 1440, "height": 900}
WHOLE_IMAGES = "localStorage.setItem('quadrille.views.elbow_rotation', '{}')"
"""JavaScript: the user has seen the session before, and left all views at the whole image."""


def pytest_collection_modifyitems(items):
    for item in items:
        if Path(__file__).parent in item.path.parents:
            item.add_marker(pytest.mark.browser)
            # One event loop for all: the browser is started once, and the server under test runs beside the test.
            item.add_marker(pytest.mark.asyncio(loop_scope="session"), append=False)
    # Last, because kernels may be compiled meanwhile.
    items.sort(key=lambda item: any(room in item.path.parents for room in WITH_KERNELS))


@pytest.fixture(scope="session")
def kernels():
    """Compile the kernels, or wait for another program that compiles them."""
    subprocess.run([sys.executable, "-m", "app.bench.compile_kernels"], check=True)


@pytest_asyncio.fixture(loop_scope="session", scope="session")
async def browser():
    async with async_playwright() as playwright:
        try:
            browser = await playwright.chromium.launch(executable_path=chromium_path(), args=FLAGS)
        except Error as error:
            why = f"no Chromium to drive the page with (`make test` finds or installs one): {error}"
            pytest.fail(why) if os.environ.get("CI") == "true" else pytest.skip(why)
        yield browser
        await browser.close()


@pytest_asyncio.fixture(loop_scope="session", scope="session")
async def blank_viser(tmp_path_factory):
    """A 3-D view that is an empty page: quick, and the shell's tests need no more."""

    async def answer(_request):
        return web.Response(text=BLANK, content_type="text/html")

    path = tmp_path_factory.mktemp("viser") / "viser"
    app = web.Application()
    app.router.add_get("/{path:.*}", answer)
    runner = web.AppRunner(app, shutdown_timeout=0.1)
    await runner.setup()
    await web.UnixSite(runner, path).start()
    yield ViserPlace(path, 0, "")
    await runner.cleanup()


class _Server:
    """Serves the page at one address to all tests; who answers its socket changes from test to test."""

    def __init__(self):
        self.endpoint = None
        self.address = ""

    async def serve(self, socket, role, name):
        await self.endpoint.serve(socket, role, name)

    async def thumbnail(self, request):
        return await self.endpoint.thumbnail(request)


@pytest_asyncio.fixture(loop_scope="session", scope="session")
async def server(blank_viser, tmp_path_factory):
    server = _Server()
    app = create_app(server, blank_viser, Access(), static_folder())
    app.router.add_get("/thumbnail/{person}/{frame}", server.thumbnail)
    server.state_folder = tmp_path_factory.mktemp("state")
    KeyRoutes(server.state_folder, has_token=True).add_to(app)
    async with listening(app) as port:
        server.address = f"http://127.0.0.1:{port}/"
        yield server


@pytest.fixture
def keys_file(server):
    """The user's keys, which the page reads when it is loaded; there are none."""
    path = server.state_folder / KEYS_FILE
    yield path
    path.unlink(missing_ok=True)


@pytest.fixture
def endpoint(request):
    """What answers the page, made with the keywords of a test's mark `endpoint`."""
    mark = request.node.get_closest_marker("endpoint")
    return FakeEndpoint(**(getattr(request, "param", None) or (mark.kwargs if mark else {})))


@pytest_asyncio.fixture(loop_scope="session")
async def address(endpoint, server):
    server.endpoint = endpoint
    yield server.address
    await endpoint.rest()


async def _blank_tab(browser, server):
    context = await browser.new_context(viewport=VIEWPORT, color_scheme="dark")
    page = await context.new_page()
    page.errors = []
    page.on("pageerror", lambda error: page.errors.append(str(error)))
    page.on("console", lambda message: page.errors.append(message.text) if message.type == "error" else None)
    await page.goto(server.address + "viser/")
    return page


@pytest_asyncio.fixture(loop_scope="session", scope="session")
async def tabs(browser, server):
    """The tab that `page` uses, if there is one: a list of at most one."""
    tabs = []
    yield tabs
    for page in tabs:
        await page.context.close()


@pytest_asyncio.fixture(loop_scope="session")
async def page(browser, server, address, tabs):
    """The page with its first frame on the screen; fails the test where the page reports an error.

    Tests share a tab, whose cache makes loading the page four times as quick. A test that changes what outlives a page
    (init scripts, routes, listeners that answer) takes `fresh_page`.
    """
    if not tabs:
        tabs.append(await _blank_tab(browser, server))
    page = tabs[0]
    page.errors.clear()
    await page.evaluate(WHOLE_IMAGES)
    await page.goto(address)
    await shows(page, OPENED)
    yield page
    tabs.clear()  # a tab that cannot be put back is not used again
    try:
        await _leave(page, server)
        tabs.append(page)
    except Error:
        await page.context.close()
    assert page.errors == []


async def _leave(page, server):
    """Leave the page for an empty one of the same origin, and forget what pages store there."""
    await page.goto(server.address + "viser/", timeout=10_000)
    await page.evaluate("localStorage.clear(), sessionStorage.clear()")
    await page.mouse.up()
    await page.mouse.move(0, 0)
    await page.emulate_media(color_scheme="dark", reduced_motion="null")
    if page.viewport_size != VIEWPORT:
        await page.set_viewport_size(VIEWPORT)


@pytest_asyncio.fixture(loop_scope="session")
async def fresh_page(browser, server, address):
    """As `page`, in a tab of its own."""
    page = await _blank_tab(browser, server)
    await page.evaluate(WHOLE_IMAGES)
    await page.goto(address)
    await shows(page, OPENED)
    yield page
    await page.context.close()
    assert page.errors == []
