"""Poses of a range that are estimated again after a correction: what changes, what stays, and how it ends."""

import threading

import numpy as np
import pytest
from gestures import wait_for
from run_poses import Estimate

from app.state.run_choices import RunChoices
from tracker.errors import TrackerError
from tracker.pipeline import audit
from tracker.session.store.records import PoseChange, PoseRecord

FRAMES, CORRECTED, STEP_M = range(3, 12), 7, 0.1


class HeldEstimate(Estimate):
    """Goes on from its third step when it is let go."""

    def __init__(self):
        super().__init__(STEP_M)
        self.go_on = threading.Event()

    def __call__(self, run):
        steps = super().__call__(run)
        for _ in range(3):
            yield next(steps)
        self.go_on.wait(60)
        return (yield from steps)


@pytest.fixture
def estimate(monkeypatch):
    """Stands for the estimate: each pose but keyframes moves by a step."""
    held_estimate = Estimate(STEP_M)
    monkeypatch.setattr(audit, "estimate_run", held_estimate)
    return held_estimate


@pytest.fixture
def held(monkeypatch):
    found = HeldEstimate()
    monkeypatch.setattr(audit, "estimate_run", found)
    yield found
    found.go_on.set()


@pytest.fixture
def corrected(controller):
    """A controller whose body is tracked on some frames, one of which is a keyframe by now."""
    put(controller, FRAMES)
    controller.ranges.mark(CORRECTED, CORRECTED, "keyframe")
    return controller


def put(controller, frames, height_m=1.0):
    """Store poses of a run; heights tell them apart."""
    session_state, values = controller.session_state, controller.models[0].neutral()
    values[1] = height_m
    revision = session_state.saver.revisions.current(0)
    record = PoseRecord(values, ("tracked",) * len(values), revision, settings={"method": "chamfer"})
    names = [p.name for p in session_state.session.people]
    with controller.lock:
        changes = [PoseChange(name, k, record) for name in names for k in frames]
        session_state.saver.write("track", changes, None, by_program=True)
        session_state.refresh_saving()


def heights(controller, person=0):
    found = {k: controller.session_state.saver.record(person, k) for k in FRAMES}
    return {k: None if record is None else float(record.values[1]) for k, record in found.items()}


def done(controller):
    wait_for(lambda: not controller.state.ranges.running)
    return controller.state.ranges.message


def test_all_poses_but_keyframes_are_estimated_as_one_entry(corrected, estimate):
    corrected.ranges.estimate(FRAMES[-1], FRAMES[0])
    assert done(corrected) == "estimated 8 frames"
    (asked,) = estimate.asked
    assert (sorted(asked.poses), list(asked.subjects.keyframes), asked.stays) == ([*FRAMES], [CORRECTED], False)
    moved = {k: pytest.approx(1.0 + STEP_M * (k != CORRECTED)) for k in FRAMES}
    assert heights(corrected) == moved
    record = corrected.session_state.saver.record(0, CORRECTED)
    assert (record.keyframe, record.status) == (True, "good")
    assert corrected.state.undo == "estimate frames 3 to 11"
    corrected.history.undo()
    assert heights(corrected) == dict.fromkeys(FRAMES, 1.0)
    assert corrected.session_state.saver.record(0, CORRECTED).status == ""


def test_progress_is_shown_and_nothing_written_before_the_end(corrected, held):
    corrected.navigation.seek(5)
    corrected.ranges.estimate(3, 11)
    wait_for(lambda: corrected.state.ranges.done == 2)  # of eight poses, after three of nine frames
    ranges = corrected.state.ranges
    assert (ranges.running, ranges.what, ranges.total, ranges.frames) == (True, "estimating", 8, range(3, 12))
    assert heights(corrected) == dict.fromkeys(FRAMES, 1.0)
    corrected.navigation.seek(6)  # looking around does not stop it
    held.go_on.set()
    assert done(corrected) == "estimated 8 frames"
    assert corrected.state.poses[0][1] == pytest.approx(1.0 + STEP_M)


def test_a_stop_leaves_all_poses(corrected, held):
    corrected.ranges.estimate(3, 11)
    wait_for(lambda: corrected.state.ranges.done)
    threading.Timer(0.05, held.go_on.set).start()  # the step that is being done ends
    corrected.ranges.stop()
    assert corrected.state.ranges.message == "stopped: estimated 0 of 8 frames"
    assert heights(corrected) == dict.fromkeys(FRAMES, 1.0)
    assert corrected.state.undo == "mark frame 7 as keyframe"


def test_poses_that_change_meanwhile_keep_the_change(corrected, held):
    corrected.ranges.estimate(3, 11)
    wait_for(lambda: corrected.state.ranges.done)
    put(corrected, [4, CORRECTED], 2.0)  # as another program does
    corrected.session_state.saver.write("clear", [PoseChange("person", 5, None)], None, by_program=True)
    held.go_on.set()
    assert done(corrected) == "estimated 6 frames"
    statures = heights(corrected)
    assert (statures[4], statures[5], statures[CORRECTED]) == (2.0, None, 1.0)
    assert statures[6] == pytest.approx(1.0 + STEP_M)


def test_too_little_is_refused_at_once(corrected, estimate):
    with pytest.raises(TrackerError, match="expected two frames in a row on which all these people have a pose"):
        corrected.ranges.estimate(11, 15)
    with pytest.raises(TrackerError, match="found none"):
        corrected.ranges.estimate(20, 30)
    corrected.tracking.choose(RunChoices(cameras=corrected.session.camera_names[:1]))
    with pytest.raises(TrackerError, match="expected two cameras or more"):
        corrected.ranges.estimate(3, 11)
    assert not corrected.state.ranges.running
    assert estimate.asked == []


def test_only_one_of_two_people_is_estimated_if_that_is_asked(couple, estimate):
    put(couple, FRAMES)
    couple.ranges.estimate(3, 11, [1])
    assert done(couple) == "estimated 9 frames"
    assert couple.state.undo == "bob: estimate frames 3 to 11"
    assert estimate.asked[0].subjects.tracked == (1,)
    assert heights(couple) == dict.fromkeys(FRAMES, 1.0)
    couple.ranges.estimate(3, 11)
    assert done(couple) == "estimated 9 frames of 2 people"
    np.testing.assert_allclose([*heights(couple, 1).values()], 1.0 + 2 * STEP_M)
