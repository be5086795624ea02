"""The view across is named after drags in opposite views alone, and no longer than its pose is shown."""

import numpy as np
import pytest
from gestures import drag

from app.messages import encoding

FRONT, RIGHT, BACK, LEFT = range(4)


def unseen(controller):
    return controller.state.undetermined_depth


def test_opposite_views_alone_miss_the_depth_until_a_view_across_is_used(controller):
    drag(controller, "left_wrist", (6.0, -9.0), FRONT)
    assert unseen(controller) is None  # the first placement of all
    drag(controller, "left_wrist", (5.0, 3.0), BACK)
    note = unseen(controller)
    assert (note.person, note.unseen.points) == (0, ("left_wrist",))
    assert note.unseen.camera in (RIGHT, LEFT)
    assert encoding.state(controller.session, controller.state).view_across == note.unseen.camera
    drag(controller, "right_wrist", (4.0, 4.0), BACK)
    assert unseen(controller).unseen.points == ("right_wrist", "left_wrist")
    drag(controller, "right_wrist", (4.0, 4.0), note.unseen.camera)
    assert unseen(controller) is None


@pytest.mark.slow
@pytest.mark.parametrize("change", ["undo", "seek", "fit", "edit"])
def test_the_note_ends_with_its_pose(change, controller):
    drag(controller, "left_wrist", (6.0, -9.0), FRONT)
    drag(controller, "left_wrist", (5.0, 3.0), BACK)
    assert unseen(controller) is not None
    if change == "undo":
        controller.history.undo()
    elif change == "seek":
        controller.navigation.seek(3)
    elif change == "fit":
        controller.pinning.fit(0)
    else:
        controller.pose_edits.set_dof(0, 5, 0.1)
    assert unseen(controller) is None
    assert np.isfinite(controller.state.poses[0]).all()
