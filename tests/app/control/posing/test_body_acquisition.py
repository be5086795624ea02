"""Sizes acquired from the footage in the page's program: progress, draft, apply, stop, and what is refused."""

import threading

import numpy as np
import pytest
from gestures import drag, wait_for

from app.control.posing import body_acquisition
from app.page.feeds import inspector
from tracker.errors import TrackerError
from tracker.estimation.acquisition.from_contours import Acquisition
from tracker.estimation.acquisition.size_fit import SizeFit
from tracker.estimation.acquisition.size_parameters import SizeParameters


@pytest.fixture
def posed(controller):
    drag(controller, "left_wrist", (6.0, -9.0))
    return controller


@pytest.fixture
def acquiring(monkeypatch):
    """Stands for the acquisition, which takes many seconds: makes the person 5% larger once it is let go."""
    go = threading.Event()

    def acquire(session, observer, person, frames, settings, report):
        report("fitting sizes to voxels" if settings.voxels else "fitting sizes", 0.5)
        assert go.wait(10)
        report("done", 1.0)
        parameters = SizeParameters(session.people[person].model, settings.coupled)
        sizes = np.zeros(len(parameters.names))
        sizes[0] = 0.05
        body = parameters.body(sizes)
        pose = body.neutral() + 0.01
        fit = SizeFit(sizes, body, (pose,), 1.0, np.diag(parameters.sigmas**2))
        return Acquisition(body, (0,), (pose,), 3.0, 2.0, parameters, fit)

    monkeypatch.setattr(body_acquisition, "acquire_body", acquire)
    return go


def begun(controller, method="contours"):
    controller.body_acquisition.start(0, method)
    wait_for(lambda: controller.state.acquisition.share > 0)


def test_the_result_is_a_draft_that_is_applied_and_undone(posed, acquiring):
    before = posed.models[0]
    begun(posed)
    assert posed.state.acquisition.stage == "fitting sizes"
    assert inspector.acquisition(posed.state.acquisition).result is None
    acquiring.set()
    wait_for(lambda: not posed.state.acquisition.running)
    found = posed.state.acquisition
    assert (found.frames, found.cost_before_px, found.cost_after_px) == ((0,), 3.0, 2.0)
    assert found.message.startswith("The shoulder turned by 0 degrees only, which does not show its centre; ")
    assert posed.models[0] is before  # nothing but the draft has changed
    assert posed.body_sizes.model(0).height_m == pytest.approx(before.height_m * np.exp(0.05))
    message = inspector.acquisition(found)
    assert len(message.result.front.before) > 50 < len(message.result.side.after)
    # The person grows by 5%, and with it the picture's scale.
    tall = [
        max(line[1] for line in side) - min(line[1] for line in side)
        for side in (message.result.front.before, message.result.front.after)
    ]
    assert tall[1] / tall[0] == pytest.approx(1.05, abs=0.01)
    posed.body_sizes.apply(0, refit=True)
    # The keyframe has the pose that was found with the body.
    np.testing.assert_allclose(posed.state.poses[0], posed.models[0].neutral() + 0.01)
    posed.history.undo()
    assert posed.models[0].height_m == before.height_m


@pytest.mark.slow
def test_voxels_are_fitted_first_where_they_are_chosen(posed, acquiring):
    begun(posed, "voxels")
    assert posed.state.acquisition.stage == "fitting sizes to voxels"
    acquiring.set()
    wait_for(lambda: not posed.state.acquisition.running)
    assert posed.state.draft is not None


def test_a_stopped_acquisition_changes_nothing(posed, acquiring):
    begun(posed)
    stopper = threading.Thread(target=posed.body_acquisition.stop)
    stopper.start()
    acquiring.set()
    stopper.join(10)
    assert not posed.state.acquisition.running
    assert posed.state.acquisition.message.startswith("Stopped")
    assert posed.state.draft is None


@pytest.mark.slow
def test_one_at_a_time_and_not_without_a_pose(opened, posed, acquiring):
    begun(posed)
    with pytest.raises(TrackerError, match="no other acquisition"):
        posed.body_acquisition.start(0)
    acquiring.set()
    wait_for(lambda: not posed.state.acquisition.running)


def test_a_person_who_is_nowhere_placed_is_refused(controller):
    with pytest.raises(TrackerError, match="place the body on one first"):
        controller.body_acquisition.start(0)
    assert not controller.state.acquisition.running


def test_an_error_is_shown(posed, monkeypatch):
    def fail(*_):
        raise TrackerError("expected contours, found none")

    monkeypatch.setattr(body_acquisition, "acquire_body", fail)
    posed.body_acquisition.start(0)
    wait_for(lambda: not posed.state.acquisition.running)
    assert posed.state.acquisition.message == "Expected contours, found none."


@pytest.mark.slow
def test_sizes_changed_meanwhile_win(posed, acquiring):
    begun(posed)
    posed.body_sizes.set_height(0, 1.6)
    posed.body_sizes.apply(0, refit=True)
    acquiring.set()
    wait_for(lambda: not posed.state.acquisition.running)
    assert "discarded" in posed.state.acquisition.message
    assert posed.state.draft is None
    assert posed.models[0].height_m == pytest.approx(1.6)


def test_closing_ends_an_acquisition(posed, acquiring):
    begun(posed)
    acquiring.set()
    posed.close()
    assert not posed.state.acquisition.running
