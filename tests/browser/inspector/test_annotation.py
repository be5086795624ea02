"""The section of annotation: the counter, the list, the reviewer's two keys, comments, and the next best click."""

import pytest
from page_driver import command, shows, until

SESSION = "document.querySelector('[data-section=annotation]')"


def task(frame, state="draft", annotator="", comment="", by=""):
    return {
        "person": 0, "frame": frame, "annotator": annotator, "state": state, "comment": comment, "by": by,
        "is_disagreement": False, "pose": f"{frame:032x}",
    }  # fmt: skip


NOTHING_PROPOSED = {
    "number": 0, "running": False, "message": "", "click": None, "error_mm": None, "interval_mm": None,
    "after_mm": None,
}  # fmt: skip
TASKS = [
    task(4, "draft", "anna"), task(8, "annotated", "ben", by="ben"), task(12, "verified", "anna", by="rita"),
    task(16, "rejected", "anna", "left elbow too high", "rita"), task(20, "annotated", by="cid"),
]  # fmt: skip
PLAN = {
    "type": "annotation", "annotator": "anna", "tasks": TASKS, "proposal": NOTHING_PROPOSED,
    "comments": [
        {
            "uid": "a" * 32, "person": 0, "frame": 9, "limb": "left arm", "text": "hidden", "author": "rita",
            "resolved": False,
        }
    ],
    "speeds": [
        {
            "name": "anna", "verified": 1, "seconds_per_verified": 31.25, "edits_per_verified": 4.0, "decisions": 0,
            "seconds_per_decision": None,
        }
    ],
}  # fmt: skip


@pytest.fixture
def section(page):
    return page.locator("[data-section=annotation]")


async def opened(page, endpoint, message=PLAN):
    await endpoint.broadcast(message)
    await shows(page, "quadrille.state.annotation")
    await command(page, "Plan, tasks and comments")
    await shows(page, f"{SESSION}.open")


async def sent(endpoint, **fields):
    await until(lambda: {"type": "annotation", **fields} in endpoint.received)


async def at(page, frame):
    await shows(page, f"quadrille.state.target === {frame} && quadrille.state.state.frame === {frame}")


@pytest.mark.slow
async def test_tasks_are_counted_filtered_and_gone_through_by_a_key(page, endpoint, section):
    height = await page.locator("#timeline").evaluate("(element) => element.offsetHeight")
    await opened(page, endpoint)
    assert await page.locator(".plan-counter b").inner_text() == "1 of 5 verified"
    assert (
        await page.locator(".plan-strip").get_attribute("aria-label") == "1 rejected, 1 draft, 2 annotated, 1 verified"
    )
    assert await page.locator("#timeline").evaluate("(element) => element.offsetHeight") > height  # the lane of tasks
    assert await page.locator(".plan-tasks button").all_inner_texts() == [
        "4\nanna\ndraft", "16\nanna: left elbow too high (rita)\nrejected",
    ]  # fmt: skip
    await page.keyboard.press("Alt+t")
    await at(page, 16)  # the page shows frame 12 first
    await section.get_by_text("Rejected by rita: left elbow too high.").wait_for()
    await page.keyboard.press("Alt+t")
    await at(page, 4)  # round the end
    await section.get_by_label("Tasks to list").select_option("review")
    assert len(await page.locator(".plan-tasks button").all()) == 2
    assert "31.3" in await section.locator(".plan-speed").text_content()


@pytest.mark.endpoint(n_people=2)
async def test_the_list_marks_the_task_of_the_active_person(page, endpoint, section):
    await opened(page, endpoint, PLAN | {"tasks": [task(4, "draft"), task(4, "draft") | {"person": 1}]})
    marked = section.locator(".plan-tasks [aria-current]")
    for person in (0, 1, 0):
        await page.keyboard.press("Alt+t")
        await marked.get_by_text(f"person {person}").wait_for()


async def test_a_reviewer_accepts_and_rejects_pose_by_pose(page, endpoint, section):
    await opened(page, endpoint)
    await section.get_by_label("Tasks to list").select_option("review")
    await page.keyboard.press("Alt+t")
    await at(page, 20)
    await page.keyboard.press("Alt+k")
    await sent(endpoint, action="verify", person=0, frame=20, comment="", pose=f"{20:032x}")
    await at(page, 8)
    await command(page, "Reject the planned pose")
    await page.keyboard.type("right knee")
    await page.keyboard.press("Enter")
    await sent(endpoint, action="reject", person=0, frame=8, comment="right knee", pose=f"{8:032x}")
    await at(page, 20)


async def test_without_a_task_a_verdict_says_why(page, endpoint):
    await endpoint.broadcast(PLAN | {"tasks": [], "comments": [], "speeds": []})
    await shows(page, "quadrille.state.annotation")
    await page.keyboard.press("Alt+k")
    await page.get_by_text("Nothing is planned. Plan frames").first.wait_for()
    assert not [m for m in endpoint.received if m["type"] == "annotation"]


async def test_frames_are_planned_from_the_form(page, endpoint, section):
    await opened(page, endpoint)
    await section.get_by_text("Plan frames").click()
    await section.get_by_label("N", exact=True).fill("30")
    await section.get_by_label("To", exact=True).fill("anna, ben")
    await section.get_by_role("button", name="Plan", exact=True).click()
    both = {"action": "plan", "person": None, "to": ["anna", "ben"], "each": False}
    await sent(endpoint, by="every", n=30, frames="", **both)
    await section.get_by_label("Frames", exact=True).select_option("frames")
    assert await section.get_by_label("N", exact=True).is_hidden()
    await section.get_by_label("List", exact=True).fill("0,40")
    await section.get_by_label("List", exact=True).press("Enter")
    await sent(endpoint, by="frames", n=1, frames="0,40", **both)


async def test_comments_are_written_at_the_limb_gone_to_and_resolved(page, endpoint, section):
    await opened(page, endpoint)
    await page.locator(".plan-comments li button").first.click()
    await at(page, 9)
    await shows(page, "quadrille.state.state.point === 'l_wrist'")
    await command(page, "Comment on the selected limb")
    assert await page.evaluate("document.activeElement.placeholder") == "On left arm, frame 9"
    await page.keyboard.type("look again")
    await page.keyboard.press("Enter")
    await sent(endpoint, action="comment", person=0, frame=9, limb=0, text="look again")
    await section.get_by_role("button", name="Resolve", exact=True).click()
    await sent(endpoint, action="resolve", uid="a" * 32)


async def test_reasons_and_comments_of_before_are_offered_latest_first(page, endpoint, section):
    again = [task(24 + k, "rejected", "anna", text, "rita") for k, text in enumerate(("toes", "left elbow too high"))]
    await opened(page, endpoint, PLAN | {"tasks": TASKS + again})
    offered = "(field) => [...field.list.options].map((option) => option.value)"
    reason = section.get_by_label("Correction to be made", exact=True)
    assert await reason.evaluate(offered) == ["left elbow too high", "toes"]
    assert await section.get_by_label("Comment", exact=True).evaluate(offered) == ["hidden"]


CLICK = {
    "frame": 36, "person": 0, "limb": "right arm", "cameras": [3, 0], "gain_mm": 2.97,
    "reason": "right arm, frames 34 to 38, seen best in LEFT: 90 mm expected, 12 mm after the correction",
}  # fmt: skip
PROPOSED = NOTHING_PROPOSED | {"number": 1, "click": CLICK, "error_mm": 16.6, "interval_mm": [13.0, 20.3]}


async def test_the_next_best_click_is_gone_to_explained_and_measured(page, endpoint, section):
    await opened(page, endpoint)
    await command(page, "Next best click")
    await sent(endpoint, action="next_click")
    await endpoint.broadcast(PLAN | {"proposal": NOTHING_PROPOSED | {"running": True}})
    await section.get_by_text("Looking for the next best click").wait_for()
    await endpoint.broadcast(PLAN | {"proposal": PROPOSED})
    await at(page, 36)
    await shows(page, "quadrille.state.state.point === 'r_wrist'")
    await shows(page, "quadrille.state.views.some(({ zoom }) => zoom > 1)")
    await section.get_by_text("Right arm, frames 34 to 38, seen best in LEFT").wait_for()
    await section.get_by_text("Correct it in LEFT and FRONT: gains 2.97 mm").wait_for()
    box, column = [await page.locator(one).bounding_box() for one in (".plan [role=status]", "#inspector")]
    assert box["y"] + box["height"] <= column["y"] + column["height"]  # scrolled to
    await endpoint.broadcast(PLAN | {"proposal": PROPOSED | {"after_mm": 16.7}})
    await section.get_by_text("Now 16.7 mm expected: no gain yet.").wait_for()
    await endpoint.broadcast(PLAN | {"proposal": PROPOSED | {"after_mm": 14.1}})
    await section.get_by_text("Now 14.1 mm expected: 2.50 mm gained.").wait_for()
    await endpoint.broadcast(PLAN | {"proposal": PROPOSED | {"number": 2, "click": None, "error_mm": 9.5}})
    await section.get_by_text("Nothing is left that pays: expected error 9.5 mm (13.0 to 20.3, 90 %).").wait_for()
    await shows(page, "quadrille.state.target === 36")
