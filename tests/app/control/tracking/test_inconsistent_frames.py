"""Keyframes are judged in the background, named in the place of their neighbours, and never changed."""

from types import SimpleNamespace

import numpy as np
import pytest
from gestures import wait_for

from app.control.tracking import inconsistent_frames
from app.messages import encoding
from tracker.session.store.records import AssessmentChange, MarkChange, PoseChange, PoseRecord

KEY = 10


@pytest.fixture
def steady(controller):
    """A person who moves steadily on frames 0 to 20; frame 10 is a keyframe."""
    saver, model = controller.session_state.saver, controller.session.people[0].model
    pose = np.array(controller.state.poses[0])
    revision = saver.revisions.current(0)

    def place(frame, keyframe=False, off=0.0, costs=(2.0, 2.0, 2.0, 2.0)):
        values = np.array(pose)
        values[0] += 0.02 * frame
        values[model.value_names.index("left_shoulder.abduction")] += off
        record = PoseRecord(
            values, ("tracked",) * len(values), revision, keyframe=keyframe, status="" if keyframe else "good",
            cost_px=float(np.mean(costs)), view_costs_px=costs,
        )  # fmt: skip
        saver.write("place", [PoseChange("person", frame, record)], None, by_program=False)
        controller.session_state.refresh_saving()
        return values

    for frame in range(21):
        place(frame, frame == KEY)
    return controller, place


def checked(controller):
    checker = controller.inconsistent_frames
    wait_for(lambda: checker._seen == controller.session_state.saver.index.version)
    return encoding.inconsistent(controller.state)


@pytest.mark.slow
def test_a_wrong_keyframe_stands_for_its_neighbours_and_is_left_unchanged(steady):
    controller, place = steady
    assert checked(controller).keyframes == ()
    values = place(KEY, keyframe=True, off=0.9)
    wait_for(lambda: checked(controller).keyframes)
    message = checked(controller)
    (doubt,) = message.keyframes
    assert (doubt.person, doubt.frame, doubt.views) == (0, KEY, ())
    assert doubt.point in ("left wrist", "left elbow")
    assert 20 < doubt.distance_cm < 60
    assert message.frames == (KEY,)
    np.testing.assert_array_equal(controller.session_state.saver.record(0, KEY).values, values)
    place(KEY, keyframe=True)
    wait_for(lambda: not checked(controller).keyframes)
    assert checked(controller).frames == ()


def test_a_view_contradicts_a_keyframe_until_it_is_confirmed_or_changed(steady, opened):
    controller, place = steady
    place(KEY, keyframe=True, costs=(2.0, 6.5, 2.2, 2.1))
    wait_for(lambda: checked(controller).keyframes)
    (doubt,) = checked(controller).keyframes
    assert doubt.distance_cm is None
    assert [(v.camera, v.cost_px, v.usual_px) for v in doubt.views] == [(1, 6.5, 2.0)]
    undo = controller.state.undo
    controller.inconsistent_frames.confirm(0, KEY)
    assert checked(controller).keyframes == ()
    assert controller.state.undo == undo
    again = opened()  # a restart
    assert checked(again).keyframes == ()


@pytest.mark.slow
def test_an_assessment_makes_a_keyframe_doubted_until_it_is_confirmed_marked_or_undone(steady):
    controller, place = steady
    values, saver = place(KEY, keyframe=True), controller.session_state.saver

    def write(change):
        saver.write("audit", [change], None, by_program=True)
        controller.session_state.refresh_saving()

    write(AssessmentChange("person", KEY, values, "lost", "left arm uncertain without FRONT", (0.9,) * 5, None))
    wait_for(lambda: checked(controller).keyframes)
    (doubt,) = checked(controller).keyframes
    assert (doubt.reason, doubt.distance_cm, doubt.views) == ("left arm uncertain without FRONT", None, ())
    assert saver.index.timeline(0, None)[KEY]["status"] == "lost"
    controller.history.undo()
    wait_for(lambda: not checked(controller).keyframes)
    controller.history.redo()
    wait_for(lambda: checked(controller).keyframes)
    write(MarkChange("person", KEY, keyframe=True, reviewed=True))  # the person confirms it
    wait_for(lambda: not checked(controller).keyframes)
    write(AssessmentChange("person", KEY, values, "doubtful", "", (0.3,) * 5, None))
    wait_for(lambda: [d.reason for d in checked(controller).keyframes] == ["doubtful"])
    controller.inconsistent_frames.confirm(0, KEY)
    assert checked(controller).keyframes == ()
    write(AssessmentChange("person", KEY, values, "lost", "", (0.9,) * 5, None))  # audited again: the same pose
    assert checked(controller).keyframes == ()


@pytest.mark.slow
def test_a_confirmed_keyframe_is_judged_again_when_its_pose_changes(steady):
    controller, place = steady
    place(KEY, keyframe=True, off=0.9)
    wait_for(lambda: checked(controller).keyframes)
    controller.inconsistent_frames.confirm(0, KEY)
    assert checked(controller).keyframes == ()
    place(KEY, keyframe=True, off=0.8)
    wait_for(lambda: checked(controller).keyframes)


@pytest.mark.parametrize(("n_frames", "n_rests"), [(10, 0), (100, 2 * 9)])
def test_the_check_of_a_long_recording_rests_between_intervals(couple, monkeypatch, n_frames, n_rests):
    did, clock = [], iter(range(10_000))
    monkeypatch.setattr(inconsistent_frames, "_MAX_INTERVAL", 10)
    found = inconsistent_frames.InconsistentFrames(couple.session_state)
    wait_for(lambda: found._seen)
    monkeypatch.setattr(couple.session_state.saver.index, "timeline", lambda *_: dict.fromkeys(range(n_frames)))
    monkeypatch.setattr(found, "_check_interval", lambda *_: did.append("check"))
    sleeping = SimpleNamespace(monotonic=lambda: next(clock), sleep=lambda s: did.append(s))
    monkeypatch.setattr(inconsistent_frames, "time", sleeping)
    found._check(2)
    found.close()
    assert did.count("check") == 2 * n_frames // 10
    rests = [s for s in did if s != "check"]
    assert rests == n_rests * [inconsistent_frames._REST_SHARE]  # each check takes a second of this clock
