"""The real program with two people: each page has its own frame and undo, sees the other, and edits in turn."""

from contextlib import asynccontextmanager

import pytest
import pytest_asyncio
from page_driver import OPENED, command, dragging, go_to, shows
from program import WITHOUT_3D, started

from tracker.session.session import load_session
from tracker.session.store.annotation_store import AnnotationStore

pytestmark = pytest.mark.slow

OTHERS = "document.querySelectorAll('#participant-chips .participant-chip').length"


@pytest_asyncio.fixture(loop_scope="session", scope="module")
async def program(folder):
    async with started(folder, "--annotator", "Anna") as running:
        yield running


@asynccontextmanager
async def opened(browser, address):
    """A page in a browser of its own."""
    context = await browser.new_context(viewport={"width": 1280, "height": 720})
    await context.add_init_script(WITHOUT_3D)
    page, errors = await context.new_page(), []
    page.on("pageerror", lambda error: errors.append(str(error)))
    try:
        await page.goto(address)
        await shows(page, OPENED, 60)
        yield page
        assert errors == []
    finally:
        await context.close()


async def join(page, name):
    await command(page, "People on this session, and your name")
    await page.keyboard.type(name)
    await page.keyboard.press("Enter")
    await shows(page, f"quadrille.state.presence?.name.toLowerCase() === '{name.lower()}' && quadrille.state.connected")
    await page.keyboard.press("Escape")
    await shows(page, OPENED)


async def test_two_pages_work_on_one_session(browser, program, folder):
    async with opened(browser, program.address) as anna, opened(browser, program.address) as ben:
        await join(ben, "Ben")
        await shows(anna, f"{OTHERS} === 1")
        await go_to(ben, 20)
        await shows(anna, "document.querySelector('.place-mark').title === 'Ben is on frame 20'")
        assert await anna.evaluate("quadrille.state.shown.frame") == 0

        async with dragging(ben, 0, "left_wrist", (0, -10), (0, -25)):
            pass
        async with dragging(anna, 0, "left_wrist", (0, -10), (0, -25)):
            await shows(ben, "document.querySelector('.participant-chip.is-at-work') !== null")
            await go_to(ben, 0)
            async with dragging(ben, 0, "right_wrist", (0, -10), (0, -20)):
                pass
            await ben.get_by_text("Anna drags on frame 0").first.wait_for()
        await shows(ben, "quadrille.state.state.source === 'manual'")
        assert await ben.evaluate("quadrille.state.state.dofs") == await anna.evaluate("quadrille.state.state.dofs")

        await anna.keyboard.press("Control+z")
        await shows(anna, "quadrille.state.state.undo === null")
        await shows(ben, "quadrille.state.state.undo?.startsWith('drag left wrist, frame 20')")
        await shows(ben, "quadrille.state.state.source !== 'manual'")
        with AnnotationStore(load_session(folder).annotations_path, read_only=True) as store:
            assert [row.frame for row in store.frames("person")] == [20]

        await ben.reload()
        await shows(ben, "window.quadrille?.state.presence?.name === 'Ben' && quadrille.state.shown?.frame === 0")
        await join(ben, "anna")  # the host's name is the host's, whose frame it shows
        await shows(ben, "quadrille.state.session.role === 'host'")
