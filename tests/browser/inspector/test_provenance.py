"""Provenance: what the page asks for, the words beside a joint and in the section, and the filter of the timeline."""

import json

import pytest
from page_driver import command, handle_of, shows, state_of, to_client, until

NO_ONE = {"source": "tracked", "author": "", "time": "", "views": [], "lost": None}
POINTS = [
    {"point": "l_wrist", "source": "manual", "author": "anna", "time": "2026-03-03T12:00:00+00:00",
     "views": ["FRONT", "LEFT"], "lost": None},
    NO_ONE | {"point": "torso"},
    NO_ONE | {"point": "head", "lost": 0.4},
]  # fmt: skip
NOTHING_PROPOSED = {
    "number": 0, "running": False, "message": "", "click": None, "error_mm": None, "interval_mm": None,
    "after_mm": None,
}  # fmt: skip


def message(frame, **more):
    return {
        "type": "provenance", "frame": frame, "person": 0, "source": "manual", "author": "ben",
        "time": "2026-03-04T12:00:00+00:00", "program": "0.1.0", "keyframe": True, "reviewed": True,
        "method": "contour", "between": [0, 15], "seam_mm": 12.3, "imported_from": "", "taken_from": "",
        "body": "gavrila34", "body_revision": 2, "is_earlier_body": True, "calibration_revision": 1,
        "is_earlier_calibration": False, "points": POINTS, **more,
    }  # fmt: skip


@pytest.fixture
def section(page):
    return page.locator("[data-section=provenance]")


async def opened(page, endpoint):
    await command(page, "Inspector: sizes, settings (toggle)")
    await page.evaluate("document.querySelector('[data-section=provenance]').open = true")
    await until(lambda: endpoint.asked[-1] == {"type": "provenance", "person": 0, "annotators": True})


async def test_nothing_is_asked_for_until_the_section_or_a_joint_is_in_sight(page, endpoint):
    assert endpoint.asked == []
    x, y = await to_client(page, 0, *await handle_of(page, 0, "l_wrist"))
    await page.mouse.move(x, y)
    await until(lambda: endpoint.asked == [{"type": "provenance", "person": 0, "annotators": False}])
    await page.mouse.move(x, y - 200)
    await until(lambda: endpoint.asked[-1]["person"] is None)


async def test_the_section_says_who_verified_the_pose_as_long_as_that_holds(page, endpoint):
    await opened(page, endpoint)
    frame = (await state_of(page))["state"]["frame"]
    await endpoint.broadcast(message(frame))
    plan = {"type": "annotation", "annotator": "anna", "comments": [], "speeds": [], "proposal": NOTHING_PROPOSED}
    said = "document.querySelector('[data-section=provenance]').innerText.match(/(Verified|Rejected) by [^\\n]*/)"
    for state, by, words in (
        ("verified", "rita", "Verified by rita"),
        ("annotated", "anna", None),
        ("rejected", "tom", "Rejected by tom"),
    ):
        task = {
            "person": 0, "frame": frame, "annotator": "", "state": state, "comment": "", "by": by,
            "is_disagreement": False, "pose": "",
        }  # fmt: skip
        elsewhere = task | {"frame": frame + 1, "state": "verified", "by": "sue"}
        await endpoint.broadcast(plan | {"tasks": [task, elsewhere]})
        await shows(page, f"({said}?.[0] ?? null) === {json.dumps(words)}")


async def test_the_section_groups_joints_by_origin_and_selects_them(page, endpoint, section):
    await opened(page, endpoint)
    frame = (await state_of(page))["state"]["frame"]
    await endpoint.broadcast(message(frame))
    await section.get_by_text("By hand by anna, 3 Mar 2026").wait_for()
    text = await section.inner_text()
    assert "Keyframe by ben, 4 Mar 2026" in text
    assert "Both passes lie up to 12 mm apart" in text
    assert "revision 2: earlier than the present one" in text
    assert "in FRONT and LEFT" in text
    assert "Tracked by contour from frames 0 and 15\ntorso" in text
    assert "40 % chance that the limb is lost\nhead" in text
    await section.get_by_role("button", name="torso").click()
    await until(lambda: endpoint.received[-1] == {"type": "select", "person": 0, "point": "torso"})
    await endpoint.broadcast(message(frame, source=None, points=[]))
    await section.get_by_text("No pose is stored on this frame.").wait_for()


async def test_the_filter_dims_other_frames_and_leads_to_the_next_of_its_kind(page, endpoint, section):
    await opened(page, endpoint)
    await endpoint.broadcast({"type": "annotators", "people": [{"anna": [3, 40], "": [5]}]})
    cell = """(frame) => {
      const canvas = document.querySelector("#timeline canvas");
      const x = 52 + (canvas.clientWidth - 60) * (frame + 0.5) / 120;
      return [...canvas.getContext("2d").getImageData(x * devicePixelRatio, 50 * devicePixelRatio, 1, 1).data];
    }"""
    by_hand, tracked = [await page.evaluate(cell, frame) for frame in (2, 35)]
    await section.get_by_label("Filter").select_option("hand")
    await shows(page, "quadrille.state.provenanceFilter?.kind === 'hand'")
    assert await page.evaluate(cell, 2) == by_hand
    assert await page.evaluate(cell, 35) != tracked
    await section.get_by_label("Filter").select_option("interpolated")
    await page.locator("body").click(position={"x": 2, "y": 2})
    await command(page, "Next frame of the chosen provenance")
    await shows(page, "quadrille.state.target === 60")
    await section.get_by_label("Filter").select_option("keyframes of nobody named")
    assert "annotators" in endpoint.asked[-1]
    await section.get_by_label("Filter").select_option("all")
    await shows(page, "quadrille.state.provenanceFilter === null")
    assert await page.evaluate(cell, 35) == tracked


async def test_the_label_of_a_joint_says_who_put_it_there(page, endpoint):
    frame = (await state_of(page))["state"]["frame"]
    x, y = await to_client(page, 0, *await handle_of(page, 0, "l_wrist"))
    await page.mouse.move(x, y)
    await until(lambda: endpoint.asked[-1]["person"] == 0)
    drawn = """() => {
      const canvas = document.querySelectorAll(".pane-overlay")[0];
      const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
      let words = 0;
      for (let i = 0; i < data.length; i += 4)
        words += Number(data[i] === 195 && data[i + 1] === 199 && data[i + 2] === 207);
      return words;
    }"""
    before = await page.evaluate(drawn)
    await endpoint.broadcast(message(frame))
    await shows(page, f"({drawn})() > {before} + 50")
    await endpoint.broadcast(message(frame + 1))  # of another frame: nothing is said
    await shows(page, f"({drawn})() === {before}")
