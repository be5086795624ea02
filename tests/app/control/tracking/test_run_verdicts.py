"""Gain and harm of a run: by statuses, then by costs, in stretches."""

import pytest

from app.control.tracking.comparing_runs import stretches, verdict
from app.state.comparison import ComparedPose, Stretch


def pose(frame=0, costs=(2.0, 2.0), statuses=("good", "good"), methods=("chamfer", "chamfer"), far_mm=80.0):
    return ComparedPose(frame, *methods, *costs, *statuses, far_mm / 3, far_mm, "left wrist")


@pytest.mark.parametrize(
    ("found", "kind"),
    [
        (pose(costs=(1.8, 2.0)), "better"),
        (pose(costs=(2.0, 1.8)), "worse"),
        (pose(costs=(1.99, 2.0)), "same"),
        (pose(costs=(1.8, 2.0), statuses=("doubtful", "good")), "worse"),
        (pose(costs=(2.0, 1.8), statuses=("doubtful", "lost")), "better"),
        (pose(costs=(2.0, 1.0), statuses=("good", "")), "worse"),
        (pose(costs=(2.0, 1.0), methods=("chamfer", "manual")), "same"),
        (pose(costs=(2.0, None), methods=("chamfer", "interpolated")), "same"),
        (pose(costs=(1.0, 2.0), far_mm=4.0), "same"),
    ],
)
def test_statuses_come_before_costs(found, kind):
    assert verdict(found) == kind


def test_stretches_bridge_few_frames_that_are_the_same():
    better, worse, same = ({"costs": c} for c in ((1.0, 2.0), (2.0, 1.0), (2.0, 2.0)))
    kinds = {3: better, 4: same, 5: same, 6: better, 7: worse, 8: worse, 9: better, 20: better}
    assert stretches(1, [pose(frame, **how) for frame, how in kinds.items()]) == (
        Stretch(1, 3, 6, 2, "better"), Stretch(1, 7, 8, 2, "worse"), Stretch(1, 9, 9, 1, "better"),
        Stretch(1, 20, 20, 1, "better"),
    )  # fmt: skip
