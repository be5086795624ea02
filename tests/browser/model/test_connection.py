"""The sockets of the page: lost and found, foreign, and that of viser; images that come too fast."""

import asyncio

import pytest
from aiohttp import ClientSession, WSServerHandshakeError
from fake_endpoint import FakeEndpoint
from page_driver import dragging, shows, until
from serving import listening

from app.server.access import Access
from app.server.key_routes import KeyRoutes
from app.server.private_viser import PrivateViser
from app.server.server import create_app
from app.server.static_files import static_folder


@pytest.mark.slow
async def test_after_another_start_the_page_goes_back_to_its_frame_and_person(browser, blank_viser):
    first = FakeEndpoint(n_people=2)
    first.state |= {"frame": 31, "person": 1}
    page = await (await browser.new_context()).new_page()
    async with listening(create_app(first, blank_viser, Access(), static_folder())) as port:
        await page.goto(f"http://127.0.0.1:{port}/")
        await shows(page, "window.quadrille?.state.shown.frame === 31")
    await shows(page, "!quadrille.state.connected")
    second = FakeEndpoint(n_people=2, start="second")
    second.state |= {"frame": 0}
    async with listening(create_app(second, blank_viser, Access(), static_folder()), port):
        await shows(page, "quadrille.state.connected && quadrille.state.shown.frame === 31")
        assert (second.state["frame"], second.state["person"]) == (31, 1)
    await page.context.close()


@pytest.mark.slow
async def test_a_lost_connection_is_said_and_mended_with_the_true_state(browser, endpoint, blank_viser):
    app = create_app(endpoint, blank_viser, Access(), static_folder())
    page = await (await browser.new_context()).new_page()
    async with listening(app) as port:
        await page.goto(f"http://127.0.0.1:{port}/")
        await shows(page, "window.quadrille?.state.shown.frame === 12")
    await shows(page, "!quadrille.state.connected")
    assert await page.locator("#advice-text").inner_text() == "Connection lost. Reconnecting…"
    assert await page.locator("#search-frame").is_disabled()
    endpoint.state |= {"frame": 77, "cost_px": 3.5}
    async with listening(create_app(endpoint, blank_viser, Access(), static_folder()), port):
        await shows(page, "quadrille.state.connected && quadrille.state.overlay.frame === 77", timeout_s=15.0)
        assert await page.locator("#cost").inner_text() == "3.50"
        assert await page.locator("#frame").input_value() == "77"
        await shows(page, "document.querySelector('#advice-text').textContent === ''")
    await page.context.close()


async def test_a_foreign_page_cannot_open_the_socket(browser, endpoint, address):
    async with ClientSession() as session:
        with pytest.raises(WSServerHandshakeError) as caught:
            await session.ws_connect(address + "ws", origin="http://evil.example")
        assert caught.value.status == 403
    page = await (await browser.new_context()).new_page()
    await page.route(
        "http://evil.example/", lambda route: route.fulfill(body="<title>evil</title>", content_type="text/html")
    )
    await page.goto("http://evil.example/")
    opened = await page.evaluate(
        """(url) => new Promise((resolve) => {
          const socket = new WebSocket(url);
          socket.onopen = () => resolve(true);
          socket.onerror = () => resolve(false);
        })""",
        address.replace("http", "ws") + "ws",
    )
    assert opened is False
    assert not endpoint.sockets
    await page.context.close()


@pytest.mark.slow
async def test_viser_runs_in_its_frame_behind_the_proxy(browser, endpoint, tmp_path):
    scene = PrivateViser()
    connected = asyncio.Event()
    loop = asyncio.get_running_loop()
    scene.server.on_client_connect(lambda _client: loop.call_soon_threadsafe(connected.set))
    context = await browser.new_context(color_scheme="light")
    page = await context.new_page()
    errors = []
    page.on("console", lambda message: errors.append(message.text) if message.type == "error" else None)
    try:
        app = create_app(endpoint, scene.place, Access(), static_folder())
        KeyRoutes(tmp_path, has_token=True).add_to(app)
        async with listening(app) as port:
            await page.goto(f"http://127.0.0.1:{port}/")
            await asyncio.wait_for(connected.wait(), 30.0)
            assert errors == []
            await context.close()
    finally:
        scene.stop()


async def test_images_of_a_frame_change_together_and_the_latest_wins(page, endpoint):
    await page.evaluate(
        """() => {
          window.seen = [];
          const watch = () => { window.seen.push(quadrille.state.shown.frame); requestAnimationFrame(watch); };
          requestAnimationFrame(watch);
        }"""
    )

    async def send(frame, n_cameras):
        together = {"set": 1000 + frame, "of": 4}
        for camera in range(n_cameras):
            header, picture = endpoint.header(camera, frame), endpoint.picture(camera, frame, "image")
            await endpoint.send_binary(header | together, picture)

    await send(40, 3)  # never becomes complete
    for frame in (41, 42, 43):
        await send(frame, 4)
    await shows(page, "quadrille.state.shown.frame === 43")
    seen = await page.evaluate("window.seen")
    assert 40 not in seen
    assert seen == sorted(seen)
    # Joints of frame 12 over images of frame 43 must not be grabbed.
    async with dragging(page, 0, "head", (10, 10), (20, 20)):
        pass
    assert not endpoint.heard("drag")


async def test_keys_work_while_the_scene_has_the_focus_except_those_of_its_camera(page, endpoint):
    await page.frame_locator("#scene").locator("body").focus()
    await page.keyboard.press("s")
    await page.keyboard.press("Period")
    await shows(page, "quadrille.state.shown.frame === 13")
    assert endpoint.received == [{"type": "seek", "frame": 13}]


@pytest.mark.slow
async def test_a_page_without_a_graphics_card_asks_the_3d_view_to_wait(page, endpoint):
    """Headless Chromium draws WebGL in software (chromium.FLAGS)."""
    await until(lambda: endpoint.greetings == [{"type": "pause_3d", "pause": True}])


@pytest.mark.slow
async def test_vectors_wait_for_the_images_of_their_own_frame(page, endpoint):
    """A tracker may be some frames ahead of the browser's decoder."""
    for frame in (41, 42):
        endpoint.state["frame"] = frame
        await endpoint.send_overlay()
    await endpoint.send_binary(endpoint.header(0, 41), endpoint.picture(0, 41, "image"))
    await shows(page, "quadrille.state.shown.frame === 41")
    await shows(page, "quadrille.state.overlay.frame === 41")
