"""Curves that are edited, against the real program: the pose follows, the frame is a keyframe, undo gives it back."""

import asyncio
import json

import numpy as np
import pytest
from page_driver import drag_up, go_to, handle_of, point_of_curve, shows, state_of
from program import started, visited
from run_with_doubt import store_run

from tracker.session.store.annotation_store import AnnotationStore

FRAME, EXTENSION = 40, 3


@pytest.mark.slow
async def test_a_dragged_curve_moves_the_pose_of_one_frame(browser, folder):
    store_run(folder)
    async with started(folder) as program, visited(browser, program.address) as page:
        await go_to(page, FRAME)
        await page.keyboard.press("c")
        await shows(page, "quadrille.state.curves?.group === 'arms'")
        first_undo = (await state_of(page))["state"]["undo"]
        before, wrist = poses_of(folder), await handle_of(page, 0, "left_wrist")
        await drag_up(page, await point_of_curve(page, EXTENSION, FRAME), -12)
        await shows(page, f"quadrille.state.timeline[{FRAME}].keyframe", 30)
        while np.hypot(*np.subtract(await handle_of(page, 0, "left_wrist"), wrist)) < 5:  # while the button is held
            await asyncio.sleep(0.02)
        await page.mouse.up()
        assert (await state_of(page))["state"]["undo"] == f"drag left elbow extension, frame {FRAME}"
        assert changed(before, poses_of(folder)) == {FRAME}
        await page.keyboard.press("ArrowUp")
        await shows(page, "quadrille.state.state.undo.startsWith('nudge left elbow')", 30)
        await page.keyboard.press("Control+z")
        await page.keyboard.press("Control+z")
        await shows(page, f"quadrille.state.state.undo === {json.dumps(first_undo)}", 30)
        assert changed(before, poses_of(folder)) == set()


def poses_of(folder):
    with AnnotationStore(folder / "annotations.sqlite", read_only=True) as store:
        return {frame: record.values for frame, record in store.poses("person", range(50)).items()}


def changed(before, after):
    return {frame for frame in before if not np.array_equal(before[frame], after[frame])}
