"""Curves of a range, smoothed and shifted through the commands of the page."""

import numpy as np
import pytest

from app.messages.parsing import parse
from app.page.commands import dispatch
from tracker.errors import TrackerError


@pytest.fixture
def bent(controller):
    """A controller with poses on frames 2 to 12, keyframes on 2, 7 and 12, and the index of the elbow that bends."""
    elbow = controller.models[0].dof_names.index("left_elbow.extension")
    for frame, angle in ((2, 0.2), (7, 1.4), (12, 0.2)):
        controller.navigation.seek(frame)
        controller.pose_edits.set_dof(0, elbow, angle)
    controller.ranges.interpolate(2, 12)
    return controller, elbow


def edit(controller, action, amount, *dofs):
    dispatch(
        controller, 0,
        parse(f'{{"type": "range", "action": "{action}", "first": 12, "last": 4, "person": 0, "dofs": {[*dofs]}, '
              f'"amount": {amount}}}'),
    )  # fmt: skip


def curves(controller):
    rows = controller.stored_poses.rows(0)[1]
    return {row.frame: row.values for row in rows}


def marks(controller):
    return {f: (c["source"], c["keyframe"]) for f, c in controller.stored_poses.timeline().items()}


def test_a_smoothed_range_keeps_keyframes_and_other_angles(bent):
    controller, elbow = bent
    before = curves(controller)
    edit(controller, "smooth", 3, elbow)
    after = curves(controller)
    assert {f for f in before if not np.array_equal(before[f], after[f])} == {4, 5, 6, 8, 9, 10, 11}
    assert after[6][elbow] < before[6][elbow]  # the kink at the keyframe is round
    np.testing.assert_array_equal(np.delete(after[6], elbow), np.delete(before[6], elbow))
    assert (marks(controller)[6], marks(controller)[7]) == (("interpolated", False), ("manual", True))
    assert controller.state.undo == "smooth curves of frames 4 to 12"
    assert controller.state.ranges.message == "smoothed 7 frames"
    controller.history.undo()
    np.testing.assert_array_equal([*curves(controller).values()], [*before.values()])


def test_a_shifted_range_takes_keyframes_along_to_the_limit(bent):
    controller, elbow = bent
    before, limit = curves(controller), controller.models[0].limits[elbow, 1]
    twist = controller.models[0].dof_names.index("torso.twist")
    edit(controller, "shift", 90, elbow, twist)
    after = curves(controller)
    for frame in range(2, 13):
        by = np.pi / 2 if frame >= 4 else 0.0
        assert after[frame][elbow] == pytest.approx(min(limit, before[frame][elbow] + by))
        assert after[frame][twist] == pytest.approx(before[frame][twist] + by)
    assert (marks(controller)[6], marks(controller)[7]) == (("manual", False), ("manual", True))
    assert controller.state.undo == "shift curves of frames 4 to 12"


def test_curves_that_cannot_change_are_refused(bent):
    controller, elbow = bent
    controller.ranges.mark(4, 12, "keyframe")
    with pytest.raises(TrackerError, match="frames 4 to 12 that can be smoothed, found none; remove the marks"):
        edit(controller, "smooth", 3, elbow)
    controller.dof_locks.set(0, [elbow], True)
    with pytest.raises(TrackerError, match="left elbow extension is locked"):
        edit(controller, "shift", 5, elbow)
    with pytest.raises(TrackerError, match="a degree of freedom of"):
        edit(controller, "shift", 5, 1000)
