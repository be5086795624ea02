"""The check of the cameras in the page's program: progress, stop, a correction, undo, what is refused."""

import threading

import numpy as np
import pytest
from gestures import drag, wait_for

from app.control.tracking import calibrating
from tracker.errors import TrackerError


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
    begun, stopping = threading.Event(), controller.calibrating._stopping

    def check(recording, report):
        begun.set()
        assert stopping.wait(10)
        report("fitting", 0.5)

    monkeypatch.setattr(calibrating, "check_calibration", check)
    controller.calibrating.start()
    assert begun.wait(10)
    with pytest.raises(TrackerError, match="no other check"):
        controller.calibrating.start()
    controller.calibrating.stop()
    assert controller.state.calibration.message == "Stopped; nothing was changed."


def test_nothing_found_cannot_be_applied(controller):
    before = [c.camera.T_world_camera for c in controller.session.cameras]
    with pytest.raises(TrackerError, match="check the cameras first"):
        controller.calibrating.apply()
    after = [c.camera.T_world_camera for c in controller.session.cameras]
    assert all(map(np.array_equal, before, after))
