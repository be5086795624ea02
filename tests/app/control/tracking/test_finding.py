"""Find people in the page's program: progress, one entry of the history, stop, and what is refused."""

import threading
import time

import numpy as np
import pytest
from gestures import drag, wait_for

from app.drawing import joint_handles, overlays
from app.page.feeds import inspector
from app.state.page_view import View
from tracker.body.model import PosedBody
from tracker.errors import TrackerError
from tracker.estimation.acquisition.from_contours import Acquisition
from tracker.estimation.fitting.hypothesis import Hypothesis
from tracker.estimation.initialization.first_pose import FirstPose, FirstPoses
from tracker.estimation.initialization.frame_trials import TakenError, Trying
from tracker.pipeline import automatic_run

FRAME = 1


def trying(frame, best=None, left_s=None):
    """How far a search of twelve frames is on its fourth one."""
    return Trying(frame, 4, 12, "", 3, left_s, best)


def poses_on(session, frame, status="good"):
    """A person 5% larger, found on a frame."""
    model = session.people[0].model
    body = model.with_height(1.05 * model.height_m)
    lines = {"FRONT": np.array([[[10.0, 20.0], [30.0, 40.0]], [[11.0, 20.0], [29.0, 40.0]]])}
    start = Hypothesis(PosedBody(body, body.neutral()), "axis")
    return FirstPoses(frame, {0: FirstPose(frame, start, status, 1.0, True, (), lines)})


@pytest.fixture
def found(monkeypatch):
    """Stands for the search, which takes many seconds: finds a person 5% larger once it is let go."""
    go = threading.Event()

    def find(session, observer, people, frames, settings, report, show):
        show(trying(FRAME))
        report("finding first poses", 0.25, "frame 1, voxels: good")
        assert go.wait(10)
        return poses_on(session, FRAME)

    monkeypatch.setattr(automatic_run, "find_people", find)
    return go


@pytest.fixture
def tracked(monkeypatch):
    """The runs of the tracker that were asked for; each does nothing and ends well."""
    runs = []

    def start(self, frame, people, edit, on_end, observer):
        runs.append((frame, people, edit))
        on_end(True)

    monkeypatch.setattr("app.control.tracking.tracking.Tracking.start_outward", start)
    return runs


def assert_sizes_follow_the_history(controller, before_m, factor):
    """The entry that made the person larger is the only one; undo and redo change the height."""
    assert controller.session.people[0].model.height_m == pytest.approx(factor * before_m)
    controller.history.undo()
    assert controller.session.people[0].model.height_m == pytest.approx(before_m)
    assert controller.state.undo is None
    controller.history.redo()
    assert controller.session.people[0].model.height_m == pytest.approx(factor * before_m)


def begun(controller):
    controller.finding.start()
    wait_for(lambda: controller.state.finding.share > 0)


def test_one_entry_holds_poses_sizes_and_tracks(found, tracked, controller):
    before = controller.models[0].height_m
    begun(controller)
    assert controller.state.finding.stage == "finding first poses"
    assert controller.state.finding.notes == ("frame 1, voxels: good",)
    found.set()
    wait_for(lambda: not controller.state.finding.running)
    assert controller.state.finding.message == "Done."
    ((frame, people, edit),) = tracked
    assert (frame, people) == (FRAME, (0,))
    assert edit is not None
    assert_sizes_follow_the_history(controller, before, 1.05)


@pytest.fixture
def acquired(monkeypatch):
    """Stands for the acquisition of sizes: finds a body 10% taller once it is let go."""
    go = threading.Event()

    def acquire(session, observer, person, frames, settings, report, known, joints):
        report("fitting", 0.5)
        assert go.wait(10)
        body = session.people[person].model.with_height(1.1 * session.people[person].model.height_m)
        return Acquisition(body, (FRAME,), (body.neutral(),), 2.0, 1.0, None, None)

    monkeypatch.setattr(automatic_run, "acquire_body", acquire)
    monkeypatch.setattr(automatic_run, "has_preset_proportions", lambda model: True)
    return go


def test_acquired_sizes_belong_to_the_same_entry(found, acquired, tracked, controller):
    before = controller.models[0].height_m
    found.set()
    acquired.set()
    controller.finding.start()
    wait_for(lambda: not controller.state.finding.running)
    ((_, _, edit),) = tracked
    assert edit is not None
    assert controller.state.frame == FRAME
    assert controller.state.people[0].source == "searched"
    assert controller.state.revisions[0] == controller.state.people[0].revision
    assert_sizes_follow_the_history(controller, before, 1.05 * 1.1)


def test_a_pose_that_was_changed_while_sizes_are_acquired_wins(found, acquired, tracked, controller):
    before = controller.models[0].height_m
    found.set()
    controller.finding.start()
    wait_for(lambda: controller.state.finding.stage == "acquiring sizes")
    drag(controller, "left_wrist", (6.0, -9.0))
    pose = controller.state.people[0].values
    acquired.set()
    wait_for(lambda: not controller.state.finding.running)
    assert controller.state.finding.failed
    assert "the acquired sizes are discarded" in controller.state.finding.message
    assert controller.session.people[0].model.height_m == pytest.approx(1.05 * before)
    np.testing.assert_array_equal(controller.state.people[0].values, pose)
    assert tracked == []


@pytest.mark.slow
def test_the_axes_of_the_silhouettes_are_shown_and_kept(opened, found, tracked):
    controller = opened()
    begun(controller)
    found.set()
    wait_for(lambda: not controller.state.finding.running)
    controller = opened()  # a restart
    message = inspector.finding(controller.state.finding, [c.camera.name for c in controller.session.cameras])
    assert message.frame == FRAME
    (axes,) = message.axes
    assert axes.camera == 0
    assert axes.people == (((10.0, 20.0, 30.0, 40.0), (11.0, 20.0, 29.0, 40.0)),)


def test_a_stop_changes_nothing(found, tracked, controller):
    begun(controller)
    stopper = threading.Thread(target=controller.finding.stop)
    stopper.start()
    found.set()
    stopper.join(10)
    assert controller.state.finding.message == "Stopped; nothing was changed."
    assert controller.state.people[0].source is None
    assert tracked == []


@pytest.mark.slow
def test_a_person_who_was_placed_meanwhile_wins(found, tracked, controller):
    begun(controller)
    drag(controller, "left_wrist", (6.0, -9.0))
    found.set()
    wait_for(lambda: not controller.state.finding.running)
    assert controller.state.finding.failed
    assert "placed meanwhile" in controller.state.finding.message
    assert controller.state.undo is not None
    assert tracked == []


def test_one_at_a_time_and_only_where_somebody_is_missing(found, tracked, controller):
    begun(controller)
    with pytest.raises(TrackerError, match="no other search for people"):
        controller.finding.start()
    threading.Timer(0.2, found.set).start()
    controller.finding.stop()
    wait_for(lambda: not controller.state.finding.running)
    drag(controller, "left_wrist", (6.0, -9.0))
    with pytest.raises(TrackerError, match="a person without a pose"):
        controller.finding.start()


def test_candidates_are_drawn_as_they_are_found_and_nobody_is_taken_from_another_frame(opened, monkeypatch):
    go = [threading.Event() for _ in range(3)]

    def find(session, observer, people, frames, settings, report, show):
        best = None
        for frame, event, is_better in zip((2, 3, 5), go, (True, True, False), strict=True):
            show(trying(frame, best))
            assert frame == 2 or controller.state.frame != frame  # what was found stays in sight meanwhile
            best = poses_on(session, frame) if is_better else best
            show(trying(frame, best))
            assert event.wait(10)
        raise TrackerError("expected a body that fills the silhouettes, found none")

    monkeypatch.setattr(automatic_run, "find_people", find)
    controller = opened()
    controller.finding.start()
    wait_for(lambda: controller.state.finding.candidates)
    state = controller.state
    assert (state.frame, state.finding.tried) == (2, 2)
    view = View(frozenset({"contours"}), (1,) * len(controller.session.cameras), False)
    drawn = overlays.paths(controller.session_of(state), state, view, None)
    assert {p.kind for p in drawn} == {"candidate"}  # not the body that nobody has placed
    assert {p.camera for p in drawn} == set(range(len(controller.session.cameras)))
    assert all(len(p.segments_px) > 0 for p in drawn)
    assert joint_handles.handles(controller.session_of(state), state, view.cameras) == []
    go[0].set()
    wait_for(lambda: controller.state.frame == 3)
    assert set(controller.state.finding.candidates) == {3}  # the best alone
    controller.navigation.seek(1)  # the user looks around
    go[1].set()
    wait_for(lambda: controller.state.finding.tried == 5)
    assert controller.state.frame == 1
    assert not [
        p for p in overlays.paths(controller.session_of(state), controller.state, view, None) if p.kind == "candidate"
    ]
    go[2].set()
    wait_for(lambda: not controller.state.finding.running)
    found = controller.state.finding
    assert (found.failed, found.tried, dict(found.candidates)) == (True, 2, {})  # the message is about the first frame
    assert joint_handles.handles(controller.session_of(state), controller.state, view.cameras)  # to be placed by hand


@pytest.fixture
def searching(opened, monkeypatch):
    """Stands for a search that goes on until it is ended: it has a doubtful start on frame 2 once it is let go."""
    go = threading.Event()

    def find(session, observer, people, frames, settings, report, show):
        show(trying(5, left_s=61.2))
        assert go.wait(10)
        best = poses_on(session, 2, "doubtful")
        try:
            while True:
                report("finding first poses", 0.25)
                show(trying(5, best))
                time.sleep(0.01)
        except TakenError:
            return best

    monkeypatch.setattr(automatic_run, "find_people", find)
    return opened(), go


def test_the_best_pose_so_far_is_taken_and_the_chain_goes_on_with_it(searching, tracked):
    controller, go = searching
    controller.finding.start()
    wait_for(lambda: controller.state.finding.trying)
    finding = controller.state.finding
    assert (finding.trying, finding.left_s) == ("trying frame 4 of 12, 3 people's figures seen", 62)
    with pytest.raises(TrackerError, match="a pose that can be taken"):
        controller.finding.take_best()
    go.set()
    wait_for(lambda: controller.state.finding.takable == 2)
    controller.finding.take_best()
    wait_for(lambda: not controller.state.finding.running)
    ((frame, _, edit),) = tracked
    assert (frame, edit is not None) == (2, True)
    assert (controller.state.frame, controller.state.people[0].status) == (2, "doubtful")
    assert (controller.state.finding.takable, controller.state.finding.trying) == (None, "")
    controller.history.undo()
    assert controller.state.people[0].source is None
    assert controller.state.undo is None


def test_an_error_is_one_sentence(opened, monkeypatch):
    def fail(session, observer, people, frames, settings, report, show):
        for frame in (2, 4):
            show(trying(frame))
            wait_for(lambda: controller.state.frame == frame)  # noqa: B023
        raise TrackerError("expected somebody in the silhouettes, found none", camera=camera)

    monkeypatch.setattr(automatic_run, "find_people", fail)
    controller = opened()
    camera = controller.session.cameras[1].camera.name
    controller.finding.start()
    wait_for(lambda: not controller.state.finding.running)
    assert controller.state.finding.message == "Expected somebody in the silhouettes, found none."
    assert controller.state.finding.failed
    assert controller.state.finding.camera == 1
    assert (controller.state.frame, controller.state.finding.tried) == (2, 2)  # the message is about the first frame
