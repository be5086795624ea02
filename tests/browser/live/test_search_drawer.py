"""Searches in the drawer, with the real program on the sample: stages, replay, comparison, landscape."""

import asyncio
import shutil

import numpy as np
import pytest
import pytest_asyncio
from page_driver import command, drag_mouse, reloaded, shows, state_of, toggle_layer
from program import ROOT, started, visit_again, visited

pytestmark = pytest.mark.slow

RUNS = "quadrille.state.searchRuns?.runs"
OVER = f"{RUNS}?.at(-1)?.state === 'over'"


@pytest_asyncio.fixture(loop_scope="session", scope="module")
async def address(tmp_path_factory):
    folder = tmp_path_factory.mktemp("drawer") / "session"
    shutil.copytree(ROOT / "sample_sessions" / "elbow_rotation", folder)
    for path in (folder, *folder.rglob("*")):
        path.chmod(path.stat().st_mode | 0o200)
    async with started(folder) as program:
        yield program.address


@pytest_asyncio.fixture(loop_scope="session", scope="module")
async def tab(browser, address):
    async with visited(browser, address) as page:
        yield page


@pytest_asyncio.fixture(loop_scope="session")
async def page(tab, address, request):
    """The page with the search tab open, on a frame of the test's own; the 3-D view is left out."""
    page = tab
    await visit_again(page, address)
    frame = 2 * 1 + 3 * list(request.session.items).index(request.node) % 47
    await page.locator("#frame").fill(str(frame))
    await page.keyboard.press("Enter")
    await shows(page, f"quadrille.state.shown?.frame === {frame} && quadrille.state.state.cost_px", 120)
    await command(page, "Search panel")
    await shows(page, f"quadrille.state.searchSetup && {RUNS}", 20)
    yield page
    assert page.errors == []


async def searched(page):
    await page.keyboard.press("f")
    await shows(page, f"{OVER} && quadrille.state.state.job.message.startsWith('done')", 60)
    await shows(page, "quadrille.state.state.undo?.startsWith('search') && quadrille.state.overlay.job === false", 20)
    number = await page.evaluate(f"{RUNS}.at(-1).number")
    await shows(page, f"quadrille.state.searchSteps.get({number})?.count === {RUNS}.at(-1).steps", 20)
    return number


async def drawn(page, kind):
    """Segments of a kind over the first view, as last drawn, (N, 4); in one order, as a body is drawn side by side."""
    rows = np.array(
        await page.evaluate(
            """(kind) => {
              const { paths, segments } = quadrille.state.overlay;
              const of = paths.filter((path) => path.kind === kind && path.camera === 0);
              return of.flatMap(({ first, count }) => [...segments.slice(4 * first, 4 * (first + count))]);
            }""",
            kind,
        )
    ).reshape(-1, 4)
    return rows[np.lexsort(rows.T)]


async def test_a_search_goes_stage_by_stage_and_the_tree_marks_where_it_is(page):
    passes, strip = page.locator(".tree-pass"), page.locator("#candidates")
    assert not await strip.is_visible()  # empty before a search
    await command(page, "Search: to the end of the stage")
    await strip.wait_for(state="visible")
    await shows(page, f"{RUNS}[0]?.stages[0].done && !quadrille.state.state.job.running", 30)
    await shows(page, "document.querySelectorAll('.tree-pass.is-done').length === 1")
    stages = (await state_of(page))["searchRuns"]["runs"][0]["stages"]
    assert [s["evaluations"] > 0 for s in stages] == [True] + [False] * (len(stages) - 1)
    assert await passes.first.inner_text() == f"{stages[0]['evaluations']} · −{stages[0]['gain_px']:.2f}"
    await page.keyboard.press("s")
    await shows(page, f"{RUNS}[0].stages[1].evaluations > 0 && {RUNS}[0].state === 'paused'", 30)
    # The stage at work is marked, as long as it takes; a speed that is chosen counts at once.
    await page.get_by_label("Expansions per second").select_option("1")
    await shows(page, "quadrille.state.searchSetup.speed === 1")
    await page.keyboard.press("f")
    await shows(page, "quadrille.state.state.job.running", 10)  # the stage was marked before, while the search stood
    await shows(page, "document.querySelectorAll('.tree-pass.is-running').length === 1", 10)
    assert await page.locator("#search-controls").get_by_text("Stage", exact=True).is_disabled()
    await page.get_by_label("Expansions per second").select_option("0")
    await shows(page, f"{OVER} && document.querySelectorAll('.tree-pass:not(.is-done)').length === 0", 60)


async def test_a_search_is_replayed_and_left_as_it_was(page):
    await searched(page)
    before, true = await state_of(page), await drawn(page, "model")
    assert before["state"]["cost_px"] is not None
    box = await page.locator("#cost-curve").bounding_box()
    await page.mouse.click(box["x"] + 60, box["y"] + 50)
    await shows(page, "quadrille.state.state.replay", 10)
    await page.locator("#replay-bar").get_by_label("Start of the search").click()
    await shows(page, "quadrille.state.state.replay?.step === -1", 10)
    start = (await state_of(page))["searchRuns"]["runs"][0]["start_px"]
    assert (await state_of(page))["state"]["cost_px"] == pytest.approx(start)
    await page.locator("#replay-bar").get_by_label("One step forward").click()
    await shows(page, "quadrille.state.state.replay?.step === 0", 10)
    await shows(page, "quadrille.state.overlay.paths.some(({ kind }) => kind === 'candidate')", 10)
    assert not np.array_equal(await drawn(page, "model"), true)
    await page.locator("#replay-bar input").focus()
    await page.keyboard.press("ArrowRight")
    await shows(page, "quadrille.state.state.replay?.step === 1", 10)
    await page.get_by_label("Replay the search").click()
    await shows(page, "quadrille.state.state.replay?.step > 4", 20)
    legend = page.locator("#pose-legend")
    assert "Replay of run" in await legend.inner_text()
    assert "tested" in await legend.inner_text()
    await toggle_layer(page, "contours")
    await shows(page, "document.querySelector('#pose-legend').innerText.includes('contours are hidden')")
    await toggle_layer(page, "contours")
    await page.keyboard.press("Escape")
    await shows(page, "quadrille.state.state.replay === null && quadrille.state.overlay.handles.length > 0", 10)
    await asyncio.sleep(0.2)
    after = await state_of(page)
    assert {k: after["state"][k] for k in ("cost_px", "undo", "source")} == {
        k: before["state"][k] for k in ("cost_px", "undo", "source")
    }
    np.testing.assert_array_equal(await drawn(page, "model"), true)


async def test_runs_are_compared_in_cost_and_pose_and_one_is_taken(page):
    first = await searched(page)
    theta = page.locator("#search-controls input")
    await theta.fill("-3")
    await theta.press("Enter")
    await page.locator("#advice").get_by_text("expected theta to be above 0 px").wait_for()
    await theta.fill("9")
    await theta.press("Enter")
    await shows(page, "quadrille.state.settings.search.theta_px === 9", 10)
    await command(page, "Search: repeat from the same start")
    await shows(page, f"{RUNS}.length === 2 && {OVER}", 60)
    rows = page.locator(".run-row")
    assert await page.locator(".run-differs").all_inner_texts() == ["theta 9 px", "theta default"]
    await rows.nth(1).get_by_text("Compare").click()
    await shows(page, "quadrille.state.overlay.paths.some(({ kind }) => kind === 'compared')", 10)
    ghost = await drawn(page, "compared")
    assert not np.array_equal(ghost, await drawn(page, "model"))
    await rows.nth(1).get_by_text("Apply").click()
    await shows(page, f"quadrille.state.state.undo?.startsWith('take run {first}')", 10)
    await shows(page, "quadrille.state.state.saved")
    await asyncio.sleep(0.2)
    np.testing.assert_array_equal(await drawn(page, "model"), ghost)
    await page.keyboard.press("Control+z")
    await shows(page, "quadrille.state.state.redo?.startsWith('take run')", 10)
    await theta.fill("")
    await theta.press("Enter")
    await shows(page, "quadrille.state.settings.search.theta_px === null", 10)


async def test_a_candidate_is_seen_under_the_pointer_and_taken_by_a_click(page):
    await searched(page)
    strip = page.locator(".candidate")
    await shows(page, "document.querySelectorAll('.candidate').length > 1")
    await strip.nth(1).hover()
    await shows(page, "quadrille.state.overlay.paths.some(({ kind }) => kind === 'preview')", 10)
    await shows(page, "document.querySelector('#pose-legend').innerText.includes('candidate 2 of run')")
    await strip.nth(1).click()
    await shows(page, "quadrille.state.state.undo?.startsWith('take candidate 2')", 10)
    await page.mouse.move(600, 20)
    await shows(page, "quadrille.state.overlay.paths.every(({ kind }) => kind !== 'preview')", 10)
    await page.keyboard.press("Control+z")
    await shows(page, "quadrille.state.state.undo?.startsWith('search')", 10)


async def test_bounds_of_a_group_are_edited_in_the_tree(page):
    leaf = page.locator(".tree-table input[aria-label*='Bound'][aria-label*='angle'][aria-label*='arms']")
    await leaf.fill("30")
    await leaf.press("Enter")
    arms = "quadrille.state.searchSetup.leaves.find(({ name }) => name === 'arms')"
    await shows(page, f"Math.abs({arms}.bound_rad - Math.PI / 6) < 1e-6 && {arms}.own", 10)
    await leaf.fill("")
    await leaf.press("Enter")
    await shows(page, f"!{arms}.own", 10)
    assert await leaf.input_value() == "15"


async def test_the_landscape_is_read_and_clicked(page):
    await command(page, "Cost landscape")
    await shows(page, "quadrille.state.landscape", 20)
    await page.get_by_label("Degree of freedom").select_option("left_elbow.extension")
    await shows(page, "quadrille.state.landscape.names[quadrille.state.landscape.dof] === 'left_elbow.extension'", 10)
    found = await page.evaluate("""(() => {
      const { values, total, current, current_px } = quadrille.state.landscape;
      return { values: [...values], total: [...total], current, current_px };
    })()""")
    assert found["current_px"] == pytest.approx((await state_of(page))["state"]["cost_px"])
    box = await page.locator("#landscape").bounding_box()
    at = 80
    x = box["x"] + 44 + (box["width"] - 52) * at / (len(found["values"]) - 1)
    await page.mouse.move(x, box["y"] + 60)
    await shows(page, "true")
    read = await page.locator(".landscape-legend output").all_inner_texts()
    assert read[0] == f"{np.degrees(found['values'][at]):.1f}°"
    assert read[1] == f"{found['total'][at]:.2f}"
    await page.mouse.click(x, box["y"] + 60)
    await shows(page, f"Math.abs(quadrille.state.landscape.current - {found['values'][at]}) < 1e-4", 10)
    assert (await state_of(page))["state"]["undo"].startswith("set left elbow extension")
    await page.keyboard.press("Control+z")
    await shows(page, f"Math.abs(quadrille.state.landscape.current - {found['current']}) < 1e-4", 10)


async def test_the_drawer_keeps_the_height_it_is_given(page):
    await searched(page)  # an empty drawer does not open again
    before = await page.locator("#drawer-stage").bounding_box()
    grip = await page.locator("#drawer-grip").bounding_box()
    await drag_mouse(page, (grip["x"] + 400, grip["y"] + 3), (grip["x"] + 400, grip["y"] - 27))
    after = await page.locator("#drawer-stage").bounding_box()
    assert after["height"] == pytest.approx(before["height"] + 30, abs=6)
    await reloaded(page, f"{RUNS} && document.querySelector('#drawer-stage').clientHeight === {after['height']}", 30)
    await page.locator("#drawer-grip").dblclick()
    await shows(page, f"document.querySelector('#drawer-stage').clientHeight === {before['height']}")


async def test_contours_are_fitted_and_replayed_with_their_residuals(page):
    before = await page.evaluate(f"{RUNS}.length")
    await page.get_by_role("button", name="Contours", exact=True).click()
    await shows(page, f"{RUNS}.length > {before} && {OVER}", 60)
    run = await page.evaluate(f"{RUNS}.at(-1)")
    assert run["steps"] >= 2
    assert run["best_px"] < run["start_px"]
    assert len(await drawn(page, "residual")) == 0
    await page.get_by_role("button", name="Start of the search").click()
    await page.get_by_role("button", name="One step forward").click()
    await shows(page, "quadrille.state.overlay?.paths.some((p) => p.kind === 'residual')", 20)
    assert len(await drawn(page, "compared")) > 10  # the contours at the start
    assert len(await drawn(page, "residual")) > 10


async def test_a_fit_chain_by_chain_is_replayed_from_the_root_on(page):
    before = await page.evaluate(f"{RUNS}.length")
    await page.get_by_role("button", name="Chains", exact=True).click()
    await shows(page, f"{RUNS}.length > {before} && {OVER}", 60)
    await page.get_by_role("button", name="Start of the search").click()
    await page.get_by_role("button", name="One step forward").click()
    await shows(page, "quadrille.state.searchRuns.replay?.stage === 'root'", 20)
    await page.get_by_role("button", name="Last step of the search").click()
    await shows(page, "quadrille.state.searchRuns.replay?.stage === 'whole body'", 20)
