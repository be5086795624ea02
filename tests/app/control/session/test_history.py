"""Back and forth along the history, by one entry or many, also after a restart; and edits that cannot be written."""

import numpy as np
import pytest
from full_disks import full_disk
from gestures import drag_on

from tracker.errors import SessionError


def labels(controller, limit=100):
    return [(e.label, e.undone) for e in controller.history.entries(limit)]


@pytest.fixture
def edited(controller):
    """A controller with five edits on as many frames."""
    for frame in range(5):
        drag_on(controller, frame, "torso", (5.0 + frame, 0.0))
    return controller


def test_the_history_can_be_gone_along_to_any_entry(edited):
    entries = edited.history.entries(100)
    assert [e.label for e in entries] == [f"drag torso, frame {k}" for k in (4, 3, 2, 1, 0)]
    edited.history.go_to(entries[3].edit)
    assert labels(edited) == [(f"drag torso, frame {k}", k > 1) for k in (4, 3, 2, 1, 0)]
    assert set(edited.stored_poses.timeline()) == {0, 1}
    assert edited.state.frame == 4  # the nearest frame that changed
    edited.history.go_to(entries[0].edit)
    assert set(edited.stored_poses.timeline()) == {0, 1, 2, 3, 4}
    edited.history.go_to(None)
    assert set(edited.stored_poses.timeline()) == set()
    assert edited.state.redo == "drag torso, frame 0"
    with pytest.raises(SessionError, match="cannot be reached"):
        edited.history.go_to(987)


@pytest.mark.slow
def test_the_history_lives_on_after_a_restart(edited, opened):
    edited.history.go_to(edited.history.entries(100)[2].edit)
    controller = opened()
    assert labels(controller)[2] == ("drag torso, frame 2", False)
    assert labels(controller)[1] == ("drag torso, frame 3", True)
    controller.history.go_to(controller.history.entries(100)[0].edit)
    assert set(controller.stored_poses.timeline()) == {0, 1, 2, 3, 4}


@pytest.mark.slow
def test_an_edit_on_a_full_disk_is_shown_and_saved_by_hand(edited, opened):
    with full_disk(0):
        drag_on(edited, 6, "torso", (30.0, 0.0))
        moved = edited.state.poses[0]
        edited.pinning.begin(1, 6, 0, 0, "left_wrist", (200.0, 200.0), False)
        edited.pinning.end(1)
        assert "check the disk" in edited.state.save_error
        drag_on(edited, 2, "torso", (30.0, 0.0))
        edited.navigation.seek(6)
        assert np.array_equal(edited.state.poses[0], moved)
        assert len(edited.state.pins[0]) == 1
        with pytest.raises(SessionError, match="not saved"):
            edited.history.undo()
        edited.history.save()
        assert edited.state.save_error is not None
    edited.history.save()
    assert edited.state.save_error is None
    assert [label for label, _ in labels(edited)[:3]] == [
        "drag torso, frame 2", "set pin left wrist in FRONT, frame 6", "drag torso, frame 6",
    ]  # fmt: skip
    controller = opened()
    controller.navigation.seek(6)
    assert np.array_equal(controller.state.poses[0], moved)
    assert len(controller.state.pins[0]) == 1


@pytest.mark.slow
def test_a_gesture_that_goes_on_after_the_disk_has_room_is_one_entry(edited):
    pixel = (200.0, 200.0)
    for frame in (8, 7):  # the first has the kernels compiled, whose cache wants a disk too
        edited.navigation.seek(frame)
        edited.pinning.begin(1, frame, 0, 0, "left_wrist", pixel, True)
        edited.pinning.move(1, (210.0, 205.0))
        edited.pinning.end(1)
    before = len(edited.history.entries(100))
    with full_disk(0):
        edited.pinning.begin(1, 7, 0, 0, "left_wrist", pixel, True)
        edited.pinning.move(1, (220.0, 210.0))
    edited.pinning.move(1, (230.0, 215.0))
    edited.pinning.end(1)
    assert edited.state.save_error is None
    assert len(edited.history.entries(100)) == before + 1
