"""Two people in the page: chosen, dimmed, hidden; whom searches move, and who is in the hand's reach."""

import pytest
import pytest_asyncio
from fake_endpoint import COLORS
from page_driver import command, drag_mouse, frame_place, handle_of, shows, state_of, to_client, toggle_layer, until

pytestmark = pytest.mark.endpoint(n_people=2)


@pytest_asyncio.fixture(loop_scope="session")
async def couple(page):
    """The page on two people, of whom person 0 is worked on."""
    await page.set_viewport_size({"width": 1280, "height": 720})
    return page


async def drag_wrist(page, person):
    x, y = await to_client(page, 0, *await handle_of(page, 0, "r_wrist", person))
    await drag_mouse(page, (x, y), (x + 12, y))


async def test_solo_keeps_the_others_out_of_reach(couple, endpoint):
    await command(couple, "Solo: dim other people (toggle)")
    await shows(couple, "quadrille.state.state.solo")
    assert await couple.locator("#solo").get_attribute("aria-pressed") == "true"
    await drag_wrist(couple, 1)
    assert not endpoint.heard("drag")  # the view has moved
    await couple.keyboard.press("p")
    await shows(couple, "quadrille.state.state.person === 1")
    await drag_wrist(couple, 1)
    await until(lambda: endpoint.heard("drag"))
    assert {m["person"] for m in endpoint.heard("drag")} == {1}
    await couple.click("#solo")
    await shows(couple, "!quadrille.state.state.solo")


@pytest.mark.slow
async def test_searches_and_fits_are_of_everybody_or_of_one(couple, endpoint):
    for key in ("s", "g", "Search and fit everyone or only the active person (toggle)", "s", "g"):
        await command(couple, key)
    await until(lambda: len(endpoint.heard("fit")) == 2)
    assert [m["person"] for m in endpoint.heard("search")] == [None, 0]
    assert [m["person"] for m in endpoint.heard("fit")] == [None, 0]
    await shows(couple, "document.querySelector('#search-scope').selectedOptions[0].textContent === 'Only person 0'")
    await couple.select_option("#search-scope", "all")
    await couple.keyboard.press("s")
    await until(lambda: len(endpoint.heard("search")) == 3)
    assert endpoint.heard("search")[-1]["person"] is None


async def test_the_list_chooses_hides_and_copies(couple, endpoint):
    await command(couple, "List of people")
    await couple.get_by_label("Show person 1", exact=True).click()
    await shows(couple, "!quadrille.state.state.people[1].shown")
    assert await couple.get_by_label("Copy the pose of person 0", exact=True).is_disabled()
    await couple.get_by_label("Copy the pose of person 1", exact=True).click()
    await couple.locator("#people-list").get_by_text("person 1").click()
    await shows(couple, "quadrille.state.state.person === 1")
    await couple.keyboard.press("Escape")
    await command(couple, "Copy the next person's angles")
    await command(couple, "Show or hide the active person")
    await shows(couple, "quadrille.state.state.people[1].shown")
    copies = [(m["person"], m["from"]) for m in endpoint.heard("pose") if m["action"] == "copy_person"]
    assert copies == [(0, 1), (1, 0)]


LANE = """([lane, frame]) => {
  const canvas = document.querySelector("#timeline canvas");
  const { n_frames } = quadrille.state.session;
  const pitch = (canvas.clientWidth - 60) / n_frames;
  const [x, y] = [52 + frame * pitch + 1, 44 + 18 * lane + 1];
  const [width, height] = [Math.floor(pitch - 3), 8].map((size) => size * devicePixelRatio);
  const { data } = canvas.getContext("2d").getImageData(x * devicePixelRatio, y * devicePixelRatio, width, height);
  const colors = new Set();
  let dark = 0;
  for (let i = 0; i < data.length; i += 4) {
    colors.add(`#${[...data.slice(i, i + 3)].map((one) => one.toString(16).padStart(2, "0")).join("")}`);
    dark += data[i] + data[i + 1] + data[i + 2] < 250;
  }
  return [[...colors], dark / (width * height)];
}"""
"""JavaScript: colours in the lane of a person at a frame, and the dark share of it: stripes."""


@pytest.mark.slow
async def test_a_lane_has_the_colour_of_its_person_and_the_pattern_of_the_status(couple):
    await shows(couple, "document.querySelector('#timeline canvas').width === 1280 * devicePixelRatio")
    for lane, color in enumerate(COLORS[:2]):
        plain, doubtful, lost = [await couple.evaluate(LANE, [lane, frame]) for frame in (15, 31, 50)]
        assert plain == [[color], 0.0]
        assert color in doubtful[0]
        assert min(doubtful[1], lost[1]) > 0.1
        assert color not in lost[0]
    assert (await couple.evaluate(LANE, [0, 110]))[0] == (await couple.evaluate(LANE, [1, 110]))[0]  # no pose
    x, y = await frame_place(couple, 50, 0.0)
    await couple.mouse.move(x, y + 44 + 18 + 7)
    await shows(couple, "!document.querySelector('#cell-tip').hidden")
    lines = (await couple.locator("#cell-tip").inner_text()).split("\n")
    assert [line.split(":")[0] for line in lines] == ["Frame 50", "person 1", "left arm"]


@pytest.mark.slow
async def test_each_has_a_lane_and_two_poses_as_good_are_gone_to(couple, endpoint):
    assert (await state_of(couple))["timeline"]["71"]["ambiguous"]
    height = (await couple.locator("#timeline").bounding_box())["height"]
    assert height > 72
    await command(couple, "Next ambiguous frame")
    await shows(couple, "quadrille.state.state.frame === 71")
    assert not await couple.locator("#take-alternative").is_visible()
    endpoint.state["people"][1]["alternatives"] = 1
    await endpoint.broadcast(endpoint.state)
    await couple.locator("#take-alternative").click()
    await command(couple, "Switch to the alternative pose, or back")
    await until(lambda: [m["action"] for m in endpoint.heard("pose")] == ["alternative", "alternative"])


@pytest.mark.slow
async def test_bars_and_legend_tell_what_is_visible_of_the_person_worked_on(couple, endpoint):
    cell = {
        "source": "manual", "cost_px": 1.0, "keyframe": True, "status": "", "remark": "", "reviewed": False,
        "ambiguous": False, "limbs_lost": [],
    }  # fmt: skip
    for person, is_keyframe in ((None, True), (0, False), (1, True)):
        cells = {12: cell | {"keyframe": is_keyframe}}
        await endpoint.broadcast({"type": "timeline", "person": person, "cells": cells, "replace": False})
    await shows(couple, "document.querySelector('#toggle-keyframe').ariaPressed === 'false'")
    assert await couple.locator("#source").inner_text() == "person 0: manual"
    await couple.keyboard.press("p")
    await shows(couple, "document.querySelector('#toggle-keyframe').ariaPressed === 'true'")
    assert await couple.locator("#source").inner_text() == "person 1: manual"
    stop, legend = couple.locator("#search-stop"), couple.locator("#pose-legend")
    await couple.keyboard.press("s")
    await shows(couple, "quadrille.state.state.job.kind === 'step' && !quadrille.state.state.job.running")
    assert (await stop.get_attribute("title")).startswith("End the paused search")
    assert not await legend.is_visible()
    endpoint.other_kind = "compared"
    await endpoint.tell(compared_run=2, replay={"run": 3, "step": 4, "steps": 9, "stage": "arms"})
    await endpoint.send_overlay(candidate=0.1)
    await shows(couple, "document.querySelectorAll('#pose-legend svg').length === 3")
    texts = await legend.locator("span").all_inner_texts()
    assert texts == ["Replay of run 3, step 5 of 9", "Esc exits", "best pose so far", "tested pose", "run 2"]
    samples = legend.locator("path")
    assert len({await samples.nth(i).get_attribute("stroke-dasharray") for i in (0, 2)}) == 2
    assert await couple.locator("#source").inner_text() == "person 1: replay"
    await toggle_layer(couple, "contours")
    await shows(couple, "document.querySelectorAll('#pose-legend svg').length === 0")
    assert "contours are hidden" in await legend.inner_text()


@pytest.mark.slow
async def test_a_joint_tells_by_whom_it_is_hidden_and_solo_shows_it(couple, endpoint):
    endpoint.hider = 1
    await endpoint.send_overlay()
    await couple.mouse.click(*await to_client(couple, 0, *await handle_of(couple, 0, "r_wrist", 0)))
    corner = couple.locator(".pane-joint").first
    await shows(couple, "document.querySelector('.pane-joint').innerText.includes('hidden by person 1')")
    assert "is occluded by person 1" in await corner.get_attribute("title")
    await command(couple, "Solo: dim other people (toggle)")
    await shows(couple, "document.querySelector('.pane-joint').innerText.includes('behind person 1')")
    assert "who is dimmed" in await corner.get_attribute("title")
