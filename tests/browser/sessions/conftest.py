import re

import pytest_asyncio
from form_program import STARTED, Program


@pytest_asyncio.fixture(loop_scope="session")
async def form(fresh_page):
    """The page with the open form, and the program behind it."""
    page, program = fresh_page, Program()
    await page.route(re.compile(r"/sessions(/|[?]|$)"), program.answer)
    await page.route("**/starting.json", lambda route: route.fulfill(json=STARTED))
    await page.set_viewport_size({"width": 1280, "height": 720})
    await page.keyboard.press("Control+k")
    await page.keyboard.type("new session")
    await page.keyboard.press("Enter")
    await page.locator("#new-session[open]").wait_for()
    return page, program
