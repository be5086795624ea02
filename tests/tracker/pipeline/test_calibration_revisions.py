"""Revisions of the calibration: entries of the history, undone and redone, and named by poses."""

import operator
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from stored_motions import put_poses

from tracker.calibration.check.diagnosis import CameraFinding
from tracker.calibration.check.fault_search import Fault
from tracker.errors import SessionError
from tracker.footage.camera_source import Clock, LostFrames
from tracker.formats.anipose import read_calibration, write_calibration
from tracker.geometry.camera_correction import DRIFT, N_CORRECTIONS, TIME
from tracker.pipeline.calibration_check import CalibrationCheck
from tracker.pipeline.calibration_revisions import (
    apply_check,
    change_calibration,
    follow_history,
    outdated_frames,
    starts_by_motion,
    with_corrections,
)
from tracker.session.session import load_session, save_camera_files
from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.store.calibration_log import CALIBRATION_EDITS, CALIBRATIONS, present_revision, revisions_of_poses
from tracker.session.store.records import AssessmentChange
from tracker.session.synchronize import with_starts


@pytest.fixture
def store(session):
    with AnnotationStore(session.annotations_path) as opened:
        yield opened


def turned(session, by_rad=0.02):
    corrections = np.zeros((len(session.cameras), N_CORRECTIONS))
    corrections[0, 1] = by_rad
    return with_corrections(session, corrections)


def stands(session):
    """Return the pose of the first camera of the file on disk."""
    return read_calibration(session.folder / "calibration.toml")[0].T_world_camera


def set_pose(session, store, frame):
    person = session.people[0]
    put_poses(store, person, {frame: person.model.neutral()}, label="pose")


def test_a_changed_calibration_follows_undo_and_redo(session, store):
    before, after = stands(session), turned(session).cameras[0].camera.T_world_camera
    changed = change_calibration(session, store, turned(session), "FRONT corrected")
    np.testing.assert_allclose(stands(session), after, atol=1e-9)
    assert store.undo() == "FRONT corrected"
    changed = follow_history(changed, store)
    np.testing.assert_allclose(stands(session), before, atol=1e-9)
    store.redo()
    changed = follow_history(changed, store)
    np.testing.assert_allclose(changed.cameras[0].camera.T_world_camera, after, atol=1e-9)
    np.testing.assert_allclose(stands(session), after, atol=1e-9)


def test_a_drift_that_was_told_about_the_middle_is_stored_from_frame_0(session):
    corrections = np.zeros((len(session.cameras), N_CORRECTIONS))
    corrections[1, [TIME, DRIFT]] = 0.01, 0.004
    clock = with_corrections(session, corrections, middle_s=2.0).cameras[1].clock
    late_s = [clock.offset_frames(t * session.fps) / session.fps for t in (0.0, 2.0, 3.0)]
    assert late_s == pytest.approx([0.002, 0.01, 0.014])


def test_lost_frames_follow_undo_and_redo(session, store):
    nothing = np.zeros((len(session.cameras), N_CORRECTIONS))
    late = nothing.copy()
    late[0, TIME] = 1 / session.fps  # As it was found; the lost frame states it exactly.
    lost = {session.cameras[0].camera.name: LostFrames(30, 1)}
    changed = change_calibration(session, store, with_corrections(session, late, 1.0, lost), "FRONT corrected")
    assert changed.cameras[0].clock == Clock(0.0, 0.0, (LostFrames(30, 1),))
    assert load_session(session.folder).cameras[0].clock == changed.cameras[0].clock
    store.undo()
    changed = follow_history(changed, store)
    assert load_session(session.folder).cameras[0].clock == Clock()
    store.redo()
    changed = follow_history(changed, store)
    assert load_session(session.folder).cameras[0].clock.lost == (LostFrames(30, 1),)
    assert present_revision(store) == 2


def test_poses_name_the_calibration_that_they_were_made_with(session, store):
    name = session.people[0].name
    set_pose(session, store, 3)
    assert revisions_of_poses(store, name) == {}
    changed = change_calibration(session, store, turned(session), "first")
    set_pose(session, store, 4)
    changed = change_calibration(changed, store, turned(changed), "second")
    set_pose(session, store, 5)
    assert revisions_of_poses(store, name) == {3: 1, 4: 2, 5: 3}
    assert present_revision(store) == 3
    assert outdated_frames(changed, store) == {name: [3, 4]}
    store.undo()
    store.undo()
    assert present_revision(store) == 2
    assert outdated_frames(changed, store) == {name: [3]}


def test_a_change_that_was_cut_off_is_finished(session, store):
    """The entry is stored, but the program ended before the file was written."""
    before = (session.folder / "calibration.toml").read_text()
    change_calibration(session, store, turned(session), "corrected")
    after = stands(session)
    (session.folder / "calibration.toml").write_text(before)
    follow_history(load_session(session.folder), store)
    np.testing.assert_allclose(stands(session), after, atol=1e-9)


def test_an_entry_without_its_revisions_changes_nothing(session, store):
    """The program ended between the entry and the setting."""
    before = stands(session)
    change_calibration(session, store, turned(session), "corrected")
    store.set_setting(CALIBRATION_EDITS, {})
    write_calibration(session.folder / "calibration.toml", [c.camera for c in session.cameras])
    follow_history(load_session(session.folder), store)
    np.testing.assert_allclose(stands(session), before, atol=1e-9)


def test_a_calibration_that_somebody_replaced_stays(session, store):
    change_calibration(session, store, turned(session), "corrected")
    other = turned(session, 0.3)
    write_calibration(session.folder / "calibration.toml", [c.camera for c in other.cameras])
    follow_history(load_session(session.folder), store)
    np.testing.assert_allclose(stands(session), other.cameras[0].camera.T_world_camera, atol=1e-9)


def test_nothing_is_corrected_where_no_camera_is_named(session, store):
    class Healthy:
        named = ()

    with pytest.raises(SessionError, match="expected a camera that is off, found none"):
        apply_check(session, store, Healthy())
    assert store.history() == []


def test_a_keyframe_that_was_only_assessed_stays_of_its_calibration(session, store):
    set_pose(session, store, 3)
    change_calibration(session, store, turned(session), "corrected")
    name, values = session.people[0].name, store.pose(session.people[0].name, 3).values
    store.commit("audit", [AssessmentChange(name, 3, values, "good", "", (), None)], by_program=True)
    assert store.pose(name, 3).status == "good"
    assert outdated_frames(session, store) == {name: [3]}


def test_offsets_and_an_amended_change_follow_undo_and_redo(session, store):
    short = replace(session, n_frames=session.n_frames - 3)
    edit, changed = None, save_camera_files(short, short.cameras)
    for start in (1.0, 2.0, 2.5):
        changed = change_calibration(changed, store, with_starts(changed, {"BACK": start}, {}), "clock of BACK", edit)
        (edit,) = store.done_edits()
    assert len(store.setting(CALIBRATIONS)) == 2  # those on the way are forgotten
    for move, start in ((store.undo, 0.0), (store.redo, 2.5)):
        move()
        changed = follow_history(changed, store)
        assert [c.start_frames for c in load_session(session.folder).cameras] == [0.0, 0.0, start, 0.0]
        assert all(map(operator.is_, [c.camera for c in changed.cameras], [c.camera for c in short.cameras]))


def test_revisions_of_former_programs_have_the_offsets_of_the_session(session, store):
    changed = change_calibration(session, store, turned(session), "FRONT corrected")
    former = [{k: v for k, v in c.items() if k != "offsets"} for c in store.setting(CALIBRATIONS)]
    store.set_setting(CALIBRATIONS, former)
    assert follow_history(changed, store) is changed
    change_calibration(changed, store, with_starts(changed, {"BACK": -0.5}, {}), "clock of BACK")
    assert [c["offsets"]["BACK"] for c in store.setting(CALIBRATIONS)] == [0, 0, 0]
    assert present_revision(store) == 3


def test_motion_gives_starts_that_are_clear_where_a_clock_was_named(session):
    correction, sigma = np.zeros(N_CORRECTIONS), np.full(N_CORRECTIONS, 0.002)
    correction[[TIME, DRIFT]] = 0.02, 1e-4
    alone = SimpleNamespace(correction=correction / 2)
    cameras = [CameraFinding(c, (), 0 * correction, sigma, 1.0, 1.0, 1.0, {}, True) for c in session.camera_names]
    cameras[1] = cameras[1]._replace(kinds=("time", "drift"), correction=correction)
    cameras[3] = cameras[3]._replace(is_seen=False)
    check = CalibrationCheck((0,), tuple(cameras), {}, SimpleNamespace(steps={Fault(2, "time"): alone}), 1.0)
    found = starts_by_motion(session, check)
    assert [f.is_clear for f in found] == [False, True, False, False]
    at_frame_0 = (0.02 - 1e-4 * 1.0) * session.fps
    assert [f.start_frames for f in found] == [0, pytest.approx(-at_frame_0), pytest.approx(-at_frame_0 / 2), None]
    assert (found[1].rate, found[1].sigma_ms) == (pytest.approx(1e-4), pytest.approx(2.0))
