"""The poses of a range against those that they replaced: figures, the ghost, and taking them back."""

import numpy as np
import pytest
from gestures import drag_on, wait_for

from app.control.tracking.comparing_runs import method_of
from app.state.comparison import Stretch
from tracker.errors import TrackerError
from tracker.session.store.records import PoseChange, PoseRecord

RANGE = range(3, 7)


def written(controller, method, turned, status):
    """Store poses of a run over the range, one degree of freedom turned by radians; return them."""
    saver, model = controller.session_state.saver, controller.models[0]
    pose = model.neutral()
    pose[model.value_names.index("left_elbow.extension")] = turned
    record = PoseRecord(
        pose, ("tracked",) * len(pose), saver.revisions.current(0), status=status, cost_px=turned,
        settings={"method": method},
    )  # fmt: skip
    with controller.lock:
        saver.write(method, [PoseChange("person", f, record) for f in RANGE], None, by_program=True)
        controller.session_state.refresh_saving()
    return pose


@pytest.fixture
def twice(controller):
    """A controller whose range was tracked by two methods, and the poses of both."""
    return controller, written(controller, "chamfer", 0.5, "lost"), written(controller, "contour", 0.8, "good")


def test_a_range_is_compared_with_the_poses_that_it_replaced(twice):
    controller, before, after = twice
    controller.comparing_runs.compare(0, 10)
    (frames,) = controller.state.range_comparison.frames
    assert [f.frame for f in frames] == list(RANGE)
    one, model = frames[0], controller.models[0]
    assert (one.method, one.other_method) == ("contour", "chamfer")
    assert (one.cost_px, one.other_cost_px, one.status, one.other_status) == (0.8, 0.5, "good", "lost")
    apart_m = np.linalg.norm(model.points_world(after) - model.points_world(before), axis=1)
    assert one.apart_mm == pytest.approx(1000 * apart_m.mean())
    assert one.farthest_mm == pytest.approx(1000 * apart_m.max())
    assert one.farthest == "left wrist"
    np.testing.assert_array_equal(controller.state.range_comparison.others[3][0], before)
    controller.comparing_runs.leave()
    assert controller.state.range_comparison is None


def test_the_other_poses_are_taken_with_one_undo_and_the_comparison_follows(twice):
    controller, before, after = twice
    controller.comparing_runs.compare(3, 6)
    controller.ranges.take_replaced(3, 6)
    assert controller.state.undo == "take the other poses of frames 3 to 6"
    for frame in RANGE:
        np.testing.assert_array_equal(controller.stored_poses.on_frame(frame)[0].values, before)
    wait_for(lambda: controller.state.range_comparison.frames[0][0].method == "chamfer")
    np.testing.assert_array_equal(controller.state.range_comparison.others[3][0], after)
    controller.history.undo()
    np.testing.assert_array_equal(controller.stored_poses.on_frame(3)[0].values, after)


def test_marks_do_not_count_and_keyframes_stay(twice):
    controller, before, after = twice
    controller.ranges.mark(4, 4, "keyframe")
    controller.comparing_runs.compare(3, 6)
    assert len(controller.state.range_comparison.frames[0]) == len(RANGE)
    np.testing.assert_array_equal(controller.state.range_comparison.others[4][0], before)
    controller.ranges.take_replaced(3, 6)
    np.testing.assert_array_equal(controller.stored_poses.on_frame(4)[0].values, after)
    np.testing.assert_array_equal(controller.stored_poses.on_frame(5)[0].values, before)


def test_frames_without_former_poses_are_refused_with_a_reason(controller):
    written(controller, "chamfer", 0.5, "good")
    with pytest.raises(TrackerError, match="frames among 3 to 6 whose pose replaced another, found none"):
        controller.comparing_runs.compare(3, 6)
    with pytest.raises(TrackerError, match="found none"):
        controller.ranges.take_replaced(3, 6)
    assert controller.state.range_comparison is None


def test_a_pose_by_hand_is_named_by_its_source(twice):
    controller, _, _ = twice
    drag_on(controller, 5, "left_wrist", (5.0, 5.0))
    controller.comparing_runs.compare(5, 5)
    ((one,),) = controller.state.range_comparison.frames
    assert one.other_method == "contour"
    assert one.method in ("manual", "ik")
    assert method_of(PoseRecord(np.zeros(2), ("tracked", "tracked"), 1)) == "chamfer"


def test_a_run_tells_gain_and_harm_and_a_stretch_is_taken_back(twice):
    controller, before, after = twice
    controller.comparing_runs.compare_run(RANGE)
    wait_for(lambda: controller.state.range_comparison is not None)
    found = controller.state.range_comparison
    assert (found.first, found.last, found.run) == (3, 6, 1)
    assert found.stretches == (Stretch(0, 3, 6, 4, "better"),)
    controller.ranges.take_replaced(3, 4, [0])
    wait_for(lambda: controller.state.range_comparison.frames[0][0].method == "chamfer")
    now = controller.state.range_comparison
    assert now.stretches == found.stretches  # those of the run's end
    assert [p.method for p in now.frames[0]] == ["chamfer", "chamfer", "contour", "contour"]
    np.testing.assert_array_equal(controller.stored_poses.on_frame(3)[0].values, before)
    np.testing.assert_array_equal(controller.stored_poses.on_frame(6)[0].values, after)


def test_a_run_over_frames_without_poses_and_keyframes_is_not_compared(controller):
    written(controller, "chamfer", 0.5, "lost")
    controller.comparing_runs._work(RANGE)
    assert controller.state.range_comparison is None
    written(controller, "contour", 0.8, "good")
    controller.ranges.mark(3, 6, "keyframe")
    controller.comparing_runs._work(RANGE)
    assert controller.state.range_comparison is None
    controller.ranges.mark(4, 4, "none")
    controller.comparing_runs._work(RANGE)
    assert controller.state.range_comparison.stretches == (Stretch(0, 4, 4, 1, "better"),)
