"""The demo opens from files and from a plain web server, plays and turns, and complains of nothing."""

import threading
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer

import pytest
from demo import PARTS, make_demo
from page_driver import shows


@pytest.fixture(scope="module")
def demo(tmp_path_factory, kernels):
    folder = tmp_path_factory.mktemp("site") / "demo"
    make_demo(folder)
    return folder


class Quiet(SimpleHTTPRequestHandler):
    def log_message(self, format, *args):
        """Say nothing."""


@pytest.mark.slow
@pytest.mark.parametrize("is_served", [False, True])
async def test_each_page_plays_and_turns_with_an_empty_console(browser, demo, is_served):
    server = ThreadingHTTPServer(("127.0.0.1", 0), partial(Quiet, directory=str(demo)))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    context = await browser.new_context(viewport={"width": 1280, "height": 720})
    page, said = await context.new_page(), []
    page.on("console", lambda message: said.append(message.text))
    page.on("pageerror", lambda error: said.append(str(error)))
    page.on("requestfailed", lambda request: said.append(request.url))
    root = f"http://127.0.0.1:{server.server_port}" if is_served else demo.as_uri()
    try:
        for part in PARTS:
            await page.goto(f"{root}/index.html")
            await page.click(f"text={part.title}")
            await shows(page, "document.querySelector('#frame').textContent.startsWith('frame ')")
            before = await page.inner_text("#frame")
            await page.keyboard.press(" ")
            await shows(page, f"document.querySelector('#frame').textContent !== '{before}'")
            await page.keyboard.press(" ")
            box = await page.locator("#scene").bounding_box()
            await page.mouse.move(box["x"] + 100, box["y"] + 100)
            await page.mouse.down()
            await page.mouse.move(box["x"] + 180, box["y"] + 110, steps=4)
            await page.mouse.up()
        doubts = await page.locator("#remarks li").count()
        assert doubts > 0
    finally:
        await context.close()
        server.shutdown()
    assert said == []
