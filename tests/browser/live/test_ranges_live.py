"""Range actions against the real program on the sample: what is on the page, in the store, and after undo."""

import shutil

import numpy as np
import pytest
import pytest_asyncio
from page_driver import command, dragging, frame_place, go_to, shows
from program import ROOT, started, visited
from run_with_doubt import store_run

from tracker.session.store.annotation_store import AnnotationStore


@pytest_asyncio.fixture(loop_scope="session")
async def live(browser, tmp_path):
    folder = shutil.copytree(ROOT / "sample_sessions" / "elbow_rotation", tmp_path / "session")
    async with started(folder) as program, visited(browser, program.address) as page:
        yield page, folder


@pytest.mark.slow
async def test_a_range_is_interpolated_reviewed_cleared_and_given_back(live):
    page, folder = live
    await page.keyboard.press("k")  # the draft as it stands
    await shows(page, "quadrille.state.timeline[0]?.keyframe", 30)
    await go_to(page, 10)
    async with dragging(page, 0, "left_wrist", (10, -20), (30, -60)):
        pass
    await shows(page, "quadrille.state.timeline[10]?.keyframe", 30)
    await page.mouse.dblclick(*await frame_place(page, 5))
    await shows(page, "quadrille.state.range?.first === 0 && quadrille.state.range.last === 10")
    await command(page, "Interpolate the marked range")
    await shows(page, "document.querySelector('#range-work').textContent === 'interpolated 9 frames'", 30)
    sources = "[0, 1, 9, 10].map((k) => quadrille.state.timeline[k]?.source).join()"
    await shows(page, f"{sources} === 'manual,interpolated,interpolated,manual'")
    await page.locator("#range-reviewed").click()
    await shows(page, "quadrille.state.timeline[4]?.reviewed", 30)
    await page.locator("#range-clear").click()
    await shows(page, "Object.keys(quadrille.state.timeline).length === 2", 30)
    with AnnotationStore(folder / "annotations.sqlite", read_only=True) as store:
        assert [row.frame for row in store.frames("person")] == [0, 10]
        for expected in ("quadrille.state.timeline[4]?.reviewed", "!quadrille.state.timeline[4].reviewed",
                         "!quadrille.state.timeline[4] && quadrille.state.timeline[10]"):  # fmt: skip
            await page.keyboard.press("Control+z")
            await shows(page, expected, 30)
        assert [row.frame for row in store.frames("person")] == [0, 10]


@pytest.mark.slow
async def test_the_poses_around_a_correction_are_estimated_again_and_given_back(browser, tmp_path):
    folder = shutil.copytree(ROOT / "sample_sessions" / "elbow_rotation", tmp_path / "session")
    store_run(folder)
    async with started(folder) as program, visited(browser, program.address) as page:
        await go_to(page, 30)
        async with dragging(page, 0, "left_wrist", (0, 15), (0, 45)):
            pass
        await shows(page, "quadrille.state.timeline[30]?.keyframe", 30)
        before = poses_of(folder)
        await command(page, "Estimate the poses here again")
        await shows(page, "document.querySelector('#range-work').textContent === 'estimated 8 frames'", 120)
        after = poses_of(folder)
        assert {k for k in before if not np.array_equal(before[k], after[k])} == {*range(26, 35)} - {30}
        await page.keyboard.press("Control+z")
        await shows(page, "quadrille.state.state.redo === 'estimate frames 26 to 34'", 30)
        np.testing.assert_array_equal([*poses_of(folder).values()], [*before.values()])


def poses_of(folder):
    with AnnotationStore(folder / "annotations.sqlite", read_only=True) as store:
        return {frame: record.values for frame, record in store.poses("person", range(50)).items()}
