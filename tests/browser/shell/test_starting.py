"""The page that is opened while the program starts: it is loaded once, and connects when the program serves it."""

import asyncio
from contextlib import asynccontextmanager

import pytest
from aiohttp import web
from fake_endpoint import FakeEndpoint
from page_driver import OPENED, reloaded, shows
from serving import listening

from app.server.address import Serving
from app.server.server import create_app, serve_forever
from app.server.startup_server import STEPS, StartupServer
from app.server.static_files import static_folder

COVERED = "getComputedStyle(document.querySelector('#starting')).display !== 'none'"


@pytest.fixture
def doorway(monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    with StartupServer(Serving(port=0, browser=False)) as doorway:
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


@pytest.mark.slow
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


@pytest.mark.slow
async def test_a_page_whose_program_has_ended_says_so(browser, doorway):
    async with opened(browser, doorway.address) as page:
        await shows(page, "document.querySelector('#steps li')")
        doorway.__exit__(None, None, None)
        await shows(page, f"{COVERED} && document.querySelector('#start-note').innerText.includes('does not answer')")


@asynccontextmanager
async def another_port():
    """The server of another account of this machine; gives its port and the cookies that browsers send it."""
    heard = []

    async def hear(request):
        heard.append(request.headers.get("Cookie"))
        return web.Response(text="hello")

    app = web.Application()
    app.router.add_get("/{path:.*}", hear)
    async with listening(app) as port:
        yield port, heard


@pytest.mark.slow
@pytest.mark.parametrize("name", ["127.0.0.1", "localhost"])
async def test_other_ports_of_this_machine_get_no_cookie(browser, doorway, blank_viser, name):
    address = doorway.address.replace("127.0.0.1", name)
    async with program(doorway, blank_viser), another_port() as (port, heard), opened(browser, address) as page:
        await page.wait_for_url(f"http://{name}:{doorway.port}{doorway.access.root}")
        await shows(page, OPENED)
        assert [c["path"] for c in await page.context.cookies(page.url)] == [doorway.access.root]
        await reloaded(page)
        assert page.errors == []
        other = await page.context.new_page()
        await other.goto(f"http://{name}:{port}/any/path")
        assert set(heard) == {None}


@pytest.mark.slow
async def test_an_open_page_comes_back_after_a_restart(browser, doorway, blank_viser):
    async with opened(browser, doorway.address) as page:
        await shows(page, "document.querySelector('#steps li')")
        async with program(doorway, blank_viser):
            await shows(page, OPENED)
        doorway.__exit__(None, None, None)
        with StartupServer(Serving(port=doorway.port, browser=False)) as again:
            assert again.access.root == doorway.access.root
            await reloaded(page, "document.querySelector('#steps li')")
            async with program(again, blank_viser):
                await shows(page, OPENED)
                assert page.errors == []
