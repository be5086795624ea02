"""The check of the cameras in the page's program: progress, stop, a correction, undo, what is refused."""

import threading
import time

import numpy as np
import pytest
from gestures import drag, wait_for

from app.control.tracking import calibrating
from tracker.errors import TrackerError
from tracker.formats.model_toml import load_model
from tracker.geometry.camera_correction import N_CORRECTIONS
from tracker.pipeline.calibration_revisions import change_calibration, with_corrections
from tracker.session.session import save_model


@pytest.fixture
def controller(opened):
    controller = opened()
    drag(controller, "left_wrist", (6.0, -9.0))
    return controller


def test_an_untracked_session_gets_a_sentence(controller):
    controller.calibrating.start()
    wait_for(lambda: not controller.state.calibration.running)
    assert controller.state.calibration.failed
    assert "Expected at least 3 frames with poses" in controller.state.calibration.message


def test_a_check_can_be_stopped(controller, monkeypatch):
    begun = threading.Event()

    def check(recording, report):
        begun.set()
        for _ in range(1000):
            report("fitting", 0.5)
            time.sleep(0.01)

    monkeypatch.setattr(calibrating, "check_calibration", check)
    controller.calibrating.start()
    assert begun.wait(10)
    with pytest.raises(TrackerError, match="no other check"):
        controller.calibrating.start()
    controller.calibrating.stop()
    assert controller.state.calibration.message == "Stopped; nothing was changed."


def corrected(controller):
    """Turn a camera, as a check would, by an entry of the history."""
    saver, session = controller.session_state.saver, controller.session
    corrections = np.zeros((len(session.cameras), N_CORRECTIONS))
    corrections[0, 1] = 0.02
    changed = change_calibration(session, saver.store, with_corrections(session, corrections), "corrected")
    controller.calibrating.exchange_cameras(changed, "")
    wait_for(lambda: controller.state.calibration.revision == 2)


def tracked(controller, tracker, until):
    tracker.track(controller, until=until, frames=until + 1)


@pytest.mark.slow
def test_poses_of_an_earlier_calibration_alone_are_tracked_again(placed, tracker):
    tracked(placed, tracker, 9)
    corrected(placed)
    wait_for(lambda: placed.state.calibration.outdated == {0: (2, 3, 4, 5, 6, 7, 8, 9)})
    tracker.seen.clear()
    placed.calibrating.track_again()
    tracker.go_on(placed, 20)
    assert tracker.seen == [2, 3, 4, 5, 6, 7, 8, 9]
    wait_for(lambda: placed.state.calibration.outdated == {0: (2,)})  # the keyframe
    with pytest.raises(TrackerError, match="keyframes stay as they were set"):
        placed.calibrating.track_again()
    placed.history.undo()
    wait_for(lambda: placed.state.calibration.outdated == {0: (2, 3, 4, 5, 6, 7, 8, 9)})


@pytest.mark.slow
def test_without_a_keyframe_the_first_pose_is_tracked_again_too(placed, tracker):
    tracked(placed, tracker, 5)
    placed.ranges.mark(2, 2, "none")
    corrected(placed)
    wait_for(lambda: placed.state.calibration.outdated == {0: (2, 3, 4, 5)})
    tracker.seen.clear()
    placed.calibrating.track_again()
    tracker.let_go(20)
    wait_for(lambda: placed.state.calibration.outdated == {})
    assert tracker.seen == [2, 3, 4, 5]


def test_nothing_found_cannot_be_applied(controller):
    before = [c.camera.T_world_camera for c in controller.session.cameras]
    with pytest.raises(TrackerError, match="check the cameras first"):
        controller.calibrating.apply()
    after = [c.camera.T_world_camera for c in controller.session.cameras]
    assert all(map(np.array_equal, before, after))


def test_the_shape_of_a_preset_is_said_first_and_acquired_at_the_second_request(controller, monkeypatch):
    preset = load_model(controller.session.people[0].model.name, 1.7)
    controller.session_state.set_body_models(save_model(controller.session, 0, preset))
    asked = []
    monkeypatch.setattr(
        calibrating, "with_acquired_bodies", lambda recording, *rest: asked.append(rest[0]) or recording
    )
    controller.calibrating.start()
    found = controller.state.calibration
    assert (found.running, asked) == (False, [])
    assert found.message.startswith(
        "The shape of person is a preset's, so that a healthy camera may seem off; press Check"
    )
    controller.calibrating.start()
    wait_for(lambda: asked and not controller.state.calibration.running)
    assert controller.state.calibration.message.startswith("Expected at least 3 frames with poses")
