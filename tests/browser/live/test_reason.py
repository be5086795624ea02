"""From a doubt to its reason: card, limb, view, table, alternative taken, status good."""

import shutil

import pytest
import pytest_asyncio
from page_driver import command, shows, state_of
from program import SAMPLE, visited
from run_with_doubt import WRONG_FRAME, store_run

pytestmark = pytest.mark.slow

EXPLAINED = "quadrille.state.reason?.parts.length > 0 && !quadrille.state.reason.running"
GHOSTS = "quadrille.state.overlay.paths.filter(({ kind, count }) => kind === 'alternative' && count > 0).length"
WORST = ".reason-table td.is-worst"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A tracked copy of the sample, with an arm that is wrong on one frame."""
    folder = shutil.copytree(SAMPLE, tmp_path_factory.mktemp("reason") / "session")
    store_run(folder)
    return folder


@pytest_asyncio.fixture(loop_scope="session")
async def live(browser, program):
    async with visited(browser, program.address) as page:
        yield page


async def test_a_doubt_leads_to_its_reason_and_to_a_good_pose(live):
    await command(live, "Doubtful and lost poses, most severe first")
    card = live.locator("#doubt-list .doubt").first
    assert "left arm: 60 % chance that it is lost" in await card.inner_text()
    await card.click()
    await shows(live, f"quadrille.state.shown.frame === {WRONG_FRAME}")
    await shows(live, "quadrille.state.state.point === 'left_wrist'")
    await live.locator("#show-reason").click()
    await shows(live, EXPLAINED, 120)
    reason = (await state_of(live))["reason"]
    assert "arm: " in reason["sentence"]
    assert reason["sentence"] in await live.locator("#frame-remark").inner_text()
    assert reason["sentence"] in await card.inner_text()

    rows = await live.locator(".tried-table tr").all_inner_texts()
    assert [row.split("\t") for row in rows[1:]] == [
        ["Left arm", "41 → 12", "taken"],
        ["Left arm and left leg, by colours of the run", "−320", "none as good"],
    ]

    camera = reason["camera"]
    await live.keyboard.press("0")  # whole images
    await shows(live, "quadrille.state.views.every(({ zoom }) => zoom === 1)")
    await live.locator(WORST).focus()
    await shows(live, f"quadrille.state.hoverPart?.part === {reason['part']}")
    for key in ("ArrowUp", "ArrowDown", "Enter"):
        await live.keyboard.press(key)
    await shows(live, f"quadrille.state.views[{camera}].zoom > 1.5 && quadrille.state.active === {camera}")
    assert [v["zoom"] for i, v in enumerate((await state_of(live))["views"]) if i != camera] == [1, 1, 1]

    assert reason["alternatives"][0]["nats"] < -6
    assert reason["alternatives"][0]["limbs"] == ["left arm"]
    await shows(live, f"{GHOSTS} > 0")
    await live.locator("[title^='Take this pose, drawn blue with the number 1']").click()
    await shows(live, "quadrille.state.state.status === 'good' && !quadrille.state.state.is_checked", 120)
    await shows(live, f"{EXPLAINED} && quadrille.state.reason.sentence === ''", 60)
    assert await live.evaluate(GHOSTS) == 0
    assert await live.locator("#doubts-empty").is_visible()
    await live.keyboard.press("Control+z")  # one entry of the history
    await shows(live, "quadrille.state.state.status === 'lost'")


async def test_a_sentence_says_that_nothing_was_searched(live):
    await live.locator("#frame").fill("10")
    await live.keyboard.press("Enter")
    await shows(live, "quadrille.state.shown.frame === 10 && quadrille.state.reason.tried?.length === 0")
    tried = live.locator(".tried")
    assert "Nothing: the pose" in await tried.inner_text()
    assert not await tried.locator("table").is_visible()


async def test_the_switch_hides_the_ghosts_of_all_alternatives(live):
    await live.locator("#frame").fill(str(WRONG_FRAME))
    await live.keyboard.press("Enter")
    await shows(live, f"quadrille.state.shown.frame === {WRONG_FRAME}")
    await shows(live, f"{GHOSTS} > 0")
    await live.keyboard.press("a")
    await live.locator("#layers-menu label", has_text="Alternatives").click()
    await shows(live, f"{GHOSTS} === 0")


async def test_a_place_of_the_cost_over_two_angles_is_taken_and_undone(live):
    await live.locator("#frame").fill("10")
    await live.keyboard.press("Enter")
    await shows(live, "quadrille.state.shown.frame === 10 && quadrille.state.state.frame === 10")
    await live.keyboard.press("Control+k")
    await live.keyboard.type("select left shoulder")
    await live.keyboard.press("Enter")
    await shows(live, "quadrille.state.state.point === 'left_shoulder'")
    await live.keyboard.press("Control+k")
    await live.keyboard.type("cost over two angles")
    await live.keyboard.press("Enter")
    await shows(live, "quadrille.state.costMap?.nats.length === 31", 60)
    first, second = (await state_of(live))["costMap"]["dofs"]
    before = (await state_of(live))["state"]["dofs"]
    box = await live.locator(".cost-map canvas").bounding_box()
    await live.mouse.click(box["x"] + 0.25 * box["width"], box["y"] + 0.25 * box["height"])
    values = "quadrille.state.state.dofs"
    await shows(
        live,
        f"Math.abs({values}[{first}] - {before[first]}) > 5 && Math.abs({values}[{second}] - {before[second]}) > 5",
    )
    current = f"Math.abs(quadrille.state.costMap.current[0] - {values}[{first}]) < 0.1"
    await shows(live, current, 60)  # the map follows
    taken = (await state_of(live))["state"]["dofs"]
    await live.locator(".cost-map canvas").focus()
    for key in ("ArrowRight", "ArrowUp", "Enter"):
        await live.keyboard.press(key)
    await shows(live, f"{values}[{first}] > {taken[first]} + 1 && {values}[{second}] > {taken[second]} + 1")
    for _ in range(2):
        await live.keyboard.press("Control+z")
    await shows(live, f"Math.abs({values}[{first}] - {before[first]}) < 0.01")
