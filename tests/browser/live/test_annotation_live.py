"""The real program: frames are planned, annotated, verified and rejected in the page, and a restart keeps that."""

import pytest
from page_driver import command, dragging, shows

from tracker.annotation.plan import read_comments, read_tasks
from tracker.session.session import load_session
from tracker.session.store.annotation_store import AnnotationStore

pytestmark = pytest.mark.slow

COUNTER = "document.querySelector('.plan-counter b').textContent"


async def at(page, frame):
    await shows(page, f"quadrille.state.shown.frame === {frame} && quadrille.state.overlay.frame === {frame}")


async def lift(page, px):
    async with dragging(page, 0, "left_wrist", (0, -px / 2), (0, -px)):
        pass


async def test_a_plan_is_annotated_and_reviewed(tab, folder):
    page, section = tab, tab.locator("[data-section=annotation]")
    await command(page, "Plan, tasks and comments")
    await section.get_by_text("Plan frames").click()
    await section.get_by_label("N", exact=True).fill("20")
    await section.get_by_role("button", name="Plan", exact=True).click()
    await shows(page, f"{COUNTER} === '0 of 3 verified'")
    await page.evaluate("document.activeElement.blur()")

    await lift(page, 20)
    await shows(page, "document.querySelector('.plan-strip').ariaLabel.includes('1 annotated')")
    await page.keyboard.press("Alt+t")
    await at(page, 20)
    await lift(page, 20)
    await shows(page, "document.querySelector('.plan-strip').ariaLabel.includes('2 annotated')")

    values = "JSON.stringify(quadrille.state.state.dofs)"
    before = await page.evaluate(values)
    await page.keyboard.press("Alt+k")
    await shows(page, f"{COUNTER} === '1 of 3 verified'")
    await at(page, 0)  # the next pose to review
    await command(page, "Reject the planned pose")
    await page.keyboard.type("left elbow too high")
    await page.keyboard.press("Enter")
    await section.get_by_text("left elbow too high").first.wait_for()
    await command(page, "Comment on the selected limb")
    await page.keyboard.type("see the hand")
    await page.keyboard.press("Enter")
    await section.get_by_role("button", name="see the hand").wait_for()

    await section.get_by_label("Tasks to list").select_option("rejected")
    await page.locator(".plan-tasks button").click()
    await at(page, 0)
    await page.evaluate("document.activeElement.blur()")
    await command(page, "Next best click")
    await section.get_by_text("expected error").wait_for()
    await lift(page, 30)  # the annotator corrects it
    await shows(page, "document.querySelector('.plan-strip').ariaLabel.startsWith('0 rejected, 1 draft, 1 annotated')")
    await section.get_by_text("mm expected:").wait_for()
    await page.locator("#frame").fill("20")
    await page.keyboard.press("Enter")
    await at(page, 20)
    assert await page.evaluate(values) == before  # a verdict changes no pose

    with AnnotationStore(load_session(folder).annotations_path, read_only=True) as store:
        assert [(t.row.frame, t.state) for t in read_tasks(store)] == [
            (0, "annotated"),
            (20, "verified"),
            (40, "draft"),
        ]
        assert [c.row.text for c in read_comments(store)] == ["see the hand"]
