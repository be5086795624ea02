"""Work on ranges of frames through the controller: what is stored, what stays, and how it is taken back."""

import numpy as np
import pytest
from gestures import drag_on, wait_for

from app.control.tracking import ranges
from tracker.body.motion.interpolation import interpolate_pose
from tracker.errors import TrackerError
from tracker.session.store.annotation_store import AnnotationStore


@pytest.fixture
def two_keys(controller):
    """A controller whose body stands on frames 2 and 12."""
    drag_on(controller, 2, "torso", (4.0, 0.0))
    drag_on(controller, 12, "left_wrist", (40.0, -60.0))
    return controller


def cells(controller):
    return {
        frame: (c["source"], c["keyframe"], c["reviewed"]) for frame, c in controller.stored_poses.timeline().items()
    }


def stored(session, frame):
    with AnnotationStore(session / "annotations.sqlite", read_only=True) as store:
        return store.pose("person", frame)


@pytest.mark.slow
def test_interpolating_fills_between_the_ends_as_one_entry(two_keys, session):
    model, ends = two_keys.models[0], (stored(session, 2), stored(session, 12))
    two_keys.ranges.interpolate(2, 12)
    assert two_keys.state.undo == "interpolate frames 2 to 12"
    assert two_keys.state.ranges.message == "interpolated 9 frames"
    assert cells(two_keys) == {
        f: ("manual", True, True) if f in (2, 12) else ("interpolated", False, False) for f in range(2, 13)
    }
    truth = interpolate_pose(model, ends[0].values, ends[1].values, np.array([0.3]))[0]
    np.testing.assert_allclose(stored(session, 5).values, truth)
    assert stored(session, 5).settings == {"method": "interpolate", "between": [2, 12]}
    two_keys.history.undo()
    assert set(cells(two_keys)) == {2, 12}
    two_keys.history.redo()
    assert len(cells(two_keys)) == 11


@pytest.mark.slow
def test_keyframes_within_are_passed_through_and_stay(two_keys, session):
    drag_on(two_keys, 6, "right_wrist", (-30.0, -30.0))
    before = stored(session, 6)
    two_keys.ranges.interpolate(12, 2)  # whichever way round it is said
    np.testing.assert_array_equal(stored(session, 6).values, before.values)
    assert cells(two_keys)[6] == ("manual", True, True)
    model = two_keys.models[0]
    truth = interpolate_pose(model, before.values, stored(session, 12).values, np.array([0.5]))[0]
    np.testing.assert_allclose(stored(session, 9).values, truth)


def test_frames_beyond_the_outermost_poses_are_left(two_keys):
    two_keys.ranges.interpolate(0, 20)
    assert set(cells(two_keys)) == set(range(2, 13))


def test_nothing_to_interpolate_is_said(two_keys):
    with pytest.raises(TrackerError, match="poses at both ends of frames 3 to 11"):
        two_keys.ranges.interpolate(3, 11)
    with pytest.raises(TrackerError, match="from 0 to 49, found 60 to 70"):
        two_keys.ranges.interpolate(60, 70)
    with pytest.raises(TrackerError, match="people from 0 to 0"):
        two_keys.ranges.interpolate(2, 12, [3])


def test_clearing_leaves_keyframes(two_keys):
    two_keys.ranges.interpolate(2, 12)
    two_keys.ranges.clear(0, 8)
    assert set(cells(two_keys)) == {2, 9, 10, 11, 12}
    assert two_keys.state.undo == "clear frames 0 to 8"
    with pytest.raises(TrackerError, match="no keyframes"):
        two_keys.ranges.clear(0, 8)
    two_keys.history.undo()
    assert len(cells(two_keys)) == 11


@pytest.mark.slow
def test_marks_of_a_range(two_keys, session):
    two_keys.ranges.interpolate(2, 12)
    before = stored(session, 4)
    two_keys.ranges.mark(3, 5, "reviewed")
    assert [cells(two_keys)[f] for f in (2, 4, 6)] == [
        ("manual", True, True), ("interpolated", False, True), ("interpolated", False, False),
    ]  # fmt: skip
    two_keys.ranges.mark(4, 6, "keyframe")
    assert [cells(two_keys)[f][1] for f in range(3, 8)] == [False, True, True, True, False]
    np.testing.assert_array_equal(stored(session, 4).values, before.values)
    two_keys.ranges.mark(2, 12, "unreviewed")
    assert [f for f, (_, _, seen) in sorted(cells(two_keys).items()) if seen] == [2, 4, 5, 6, 12]  # the keyframes
    two_keys.ranges.mark(2, 12, "none")
    assert not any(key or seen for _, key, seen in cells(two_keys).values())
    for _ in range(4):
        two_keys.history.undo()
    assert [f for f, (_, key, _) in sorted(cells(two_keys).items()) if key] == [2, 12]
    with pytest.raises(TrackerError, match="to mark"):
        two_keys.ranges.mark(20, 30, "reviewed")


def test_verifying_the_shown_frame_and_taking_it_back(two_keys):
    two_keys.ranges.interpolate(2, 12)
    two_keys.navigation.seek(7)
    two_keys.ranges.toggle_reviewed()
    assert cells(two_keys)[7] == ("interpolated", False, True)
    two_keys.ranges.toggle_keyframe()
    assert cells(two_keys)[7] == ("interpolated", True, True)
    two_keys.ranges.toggle_keyframe()
    assert cells(two_keys)[7] == ("interpolated", False, False)
    assert two_keys.state.undo == "mark frame 7 as no keyframe"
    assert two_keys.state.frame == 7


def test_verifying_a_draft_stores_it(two_keys, session):
    two_keys.navigation.seek(30)
    assert two_keys.state.people[0].source is None
    shown = two_keys.state.poses[0]
    two_keys.ranges.toggle_keyframe()
    assert cells(two_keys)[30] == ("manual", True, True)
    np.testing.assert_array_equal(stored(session, 30).values, shown)
    assert two_keys.state.people[0].source == "manual"


def test_a_verified_frame_stays_when_a_program_comes_by(placed, tracker):
    placed.navigation.seek(2)
    placed.tracking.start(backward=False, until=6)
    tracker.let_go(10)
    wait_for(lambda: placed.state.track.first is None)
    placed.navigation.seek(5)
    placed.ranges.toggle_keyframe()
    placed.ranges.track(2, 8, backward=False)
    wait_for(lambda: tracker.run and tracker.run.frames == range(2, 9))  # from a keyframe past another, with both
    assert set(tracker.run.subjects.keyframes) == {2, 5}
    tracker.let_go(20)
    wait_for(lambda: placed.state.track.first is None)
    assert cells(placed)[5] == ("tracked", True, True)
    placed.ranges.track(2, 8, backward=True)
    assert placed.state.frame == 8
    wait_for(lambda: tracker.run and tracker.run.frames == range(7, 1, -1))
    tracker.let_go(20)
    wait_for(lambda: placed.state.track.first is None)


def test_long_work_is_watched_and_stopped_as_one_entry(two_keys, monkeypatch):
    monkeypatch.setattr(ranges, "AT_ONCE", 2)
    seen = []
    two_keys.subscribe(lambda state: seen.append(state.ranges))
    two_keys.ranges.interpolate(2, 12)
    wait_for(lambda: not two_keys.state.ranges.running)
    assert any(r.running and r.what == "interpolating" and 0 < r.done < r.total == 9 for r in seen)
    assert len(cells(two_keys)) == 11
    two_keys.history.undo()
    assert set(cells(two_keys)) == {2, 12}
    two_keys.ranges.interpolate(2, 12)
    two_keys.navigation.seek(4)  # looking around does not stop it
    wait_for(lambda: len(cells(two_keys)) > 2)
    two_keys.history.undo()  # taking back what it stands on does
    assert set(cells(two_keys)) == {2, 12}
    assert not two_keys.state.ranges.running


@pytest.mark.slow
def test_a_frame_that_jumps_is_named_and_no_longer_once_it_is_mended(two_keys):
    two_keys.ranges.interpolate(2, 12)
    assert two_keys.state.inconsistent_frames == ()
    drag_on(two_keys, 7, "torso", (120.0, 0.0))
    wait_for(lambda: two_keys.state.inconsistent_frames)
    assert set(two_keys.state.inconsistent_frames) <= {6, 7, 8}
    two_keys.history.undo()
    wait_for(lambda: not two_keys.state.inconsistent_frames)


def test_work_on_several_people_counts_frames_and_people(couple):
    for frame in (0, 6):
        couple.navigation.seek(frame)
        for person in (0, 1):
            couple.pose_edits.set_dof(person, 3, 0.1 * frame)
    couple.ranges.interpolate(0, 6)
    assert couple.state.ranges.message == "interpolated 5 frames of 2 people"


def test_the_history_names_the_person(couple):
    couple.pose_edits.set_dof(1, 3, 0.1)
    assert couple.state.undo.startswith("bob: set ")
    couple.navigation.select(1, None)
    couple.ranges.toggle_keyframe()
    assert couple.state.undo == "bob: mark frame 0 as no keyframe"
    couple.ranges.mark(0, 0, "keyframe")
    assert couple.state.undo == "mark frame 0 as keyframe"
