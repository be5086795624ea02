"""First poses and evidence from imported key points, in sessions without footage."""

import numpy as np
import pytest
from observed_people import BODY_25, make_session, seen, walking, write_openpose
from stored_motions import put_poses

from tracker.body.model import PosedBody
from tracker.errors import TrackerError
from tracker.formats.joint_maps import LIMB_JOINTS
from tracker.formats.model_toml import load_model
from tracker.interchange.observations.importing import plan_import, store_import
from tracker.interchange.observations.plans import ImportRequest
from tracker.pipeline import keypoint_evidence as module
from tracker.pipeline.keypoint_evidence import (
    SEEN_BODIES,
    find_by_keypoints,
    keypoint_evidence,
    learn_seen_bodies,
    read_points,
    seen_bodies_record,
    seen_joints,
    stored_seen_bodies,
)
from tracker.pipeline.keypoint_poses import store_keypoint_poses
from tracker.session.session import save_model
from tracker.session.store.annotation_store import AnnotationStore

N = 10


def imported(folder, people=("ann",), motions=None, spoil=lambda points: None):
    """A session with key points of people who walk."""
    session = make_session(folder / "session", N, people=people)
    motions = motions or [walking(N, (-0.5, 1.2 * i, 0.0)) for i in range(len(people))]
    points = seen(session, motions, noise_px=1.5)
    spoil(points)
    files = write_openpose(folder / "points", session.camera_names, points)
    store_import(session, plan_import(session, ImportRequest("net", (files,), tuple(people))))
    return session, motions


def joints_of(motion, frame):
    names = list(BODY_25.points)
    where = BODY_25.counterparts(names)
    return {
        where[n][0]: motion[frame, i] for i, n in enumerate(names) if len(where[n]) == 1 and where[n][0] in LIMB_JOINTS
    }


def off(body, motion, frame):
    """Mean distance of the limb joints of a body, metres."""
    found = dict(zip(body.model.point_names, body.joint_centers_world, strict=True))
    return np.mean([np.linalg.norm(found[n] - p) for n, p in joints_of(motion, frame).items()])


@pytest.mark.slow
def test_people_are_found_on_a_frame_without_gross_errors(tmp_path):
    def spoil(points):
        points[:7, 0, :, :, :2] += 80.0  # a view that is far off on most frames

    session, motions = imported(tmp_path, ("ann", "bob"), spoil=spoil)
    start = find_by_keypoints(session, (0, 1), range(N), "net")
    assert start.frame >= 7
    assert set(start.poses) == {0, 1}
    for i, first in start.poses.items():
        assert off(first.start.body, motions[i], start.frame) < 0.05
        assert (first.status, first.start.source) == ("doubtful", "key points")


def test_some_frames_of_a_long_recording_are_fitted(tmp_path, monkeypatch):
    session, _ = imported(tmp_path)
    fitted = []

    def fit(model, seen, frames=None):
        fitted.extend(range(N) if frames is None else frames)
        return {k: PosedBody(model, model.neutral()) for k in fitted}

    monkeypatch.setattr(module, "fit_to_keypoints", fit)
    monkeypatch.setattr(module, "MAX_FRAMES", 4)
    assert find_by_keypoints(session, (0,), range(2, N), "net").frame in fitted
    assert (len(fitted), min(fitted), max(fitted)) == (4, 2, N - 1)


@pytest.mark.slow
def test_a_preset_body_takes_the_height_of_the_points(tmp_path):
    motion = walking(N) * 0.8
    session, _ = imported(tmp_path, motions=[motion])
    preset = load_model("gavrila38")
    small = find_by_keypoints(save_model(session, 0, preset), (0,), range(N), "net").poses[0].model
    other = save_model(imported(tmp_path / "usual")[0], 0, preset)
    usual = find_by_keypoints(other, (0,), range(N), "net").poses[0].model
    assert small.height_m == pytest.approx(0.8 * usual.height_m, rel=0.02)


@pytest.mark.slow
def test_people_without_key_points_are_named(tmp_path):
    session, _ = imported(tmp_path)
    other = make_session(tmp_path / "other", N, people=("ann", "bob"))
    (tmp_path / "session" / "observations").rename(tmp_path / "other" / "observations")
    with pytest.raises(TrackerError, match="expected key points of 'bob' in 'net', found none"):
        find_by_keypoints(other, (0, 1), range(N), "net")
    assert set(read_points(other, "net")) == {0}
    assert session.people[0].name == "ann"


@pytest.mark.slow
def test_a_detector_that_was_learnt_is_read_again_for_the_same_body_alone(tmp_path):
    session, _ = imported(tmp_path)
    learnt = learn_seen_bodies(session, read_points(session, "net"))
    with AnnotationStore(session.annotations_path) as store:
        assert stored_seen_bodies(session, store, "net") is None
        store.set_setting(SEEN_BODIES, seen_bodies_record(session, "net", learnt, {}))
        again = stored_seen_bodies(session, store, "net")
        np.testing.assert_allclose(again[0].offsets_part, learnt[0].offsets_part)
        np.testing.assert_allclose(again[0].sigmas, learnt[0].sigmas)
        taller = save_model(session, 0, session.people[0].model.with_height(1.8))
        assert stored_seen_bodies(taller, store, "net") is None


@pytest.mark.slow
def test_evidence_is_of_the_cameras_of_the_run(tmp_path):
    session, _ = imported(tmp_path)
    views = [session.camera_names[i] for i in (3, 1)]
    seen_points = read_points(session, "net")
    evidence = keypoint_evidence(session, seen_points, learn_seen_bodies(session, seen_points), views)
    camera = session.cameras[1].camera.pinhole
    shown = evidence.in_view(4, 1, camera)[0]
    points = read_points(session, "net")[0].known_to(session.people[0].model)
    expected = points.seen[4, 1] @ camera.K[:2, :2].T + camera.K[:2, 2]
    np.testing.assert_allclose(shown.positions_px, expected)


def test_joints_for_sizes_count_as_one_altogether(tmp_path):
    session, _ = imported(tmp_path)
    points, model = read_points(session, "net")[0], session.people[0].model
    one, many = (seen_joints(model, points, n)[2].weights for n in (1, 9))
    np.testing.assert_allclose(9 * many**2, one**2)


@pytest.mark.slow
def test_poses_of_key_points_are_stored_and_keyframes_stay(tmp_path):
    session, (motion,) = imported(tmp_path)
    model = session.people[0].model
    with AnnotationStore(session.annotations_path) as store:
        put_poses(store, session.people[0], {3: model.neutral()}, keyframe=True)
        assert store_keypoint_poses(session, store, (0,), range(2, 8), "net") == {0: 5}
        records = store.poses("ann", range(N))
        assert sorted(records) == [2, 3, 4, 5, 6, 7]
        np.testing.assert_array_equal(records[3].values, model.neutral())
        assert set(records[4].sources) == {"imported"}
        poses = find_by_keypoints(session, (0,), range(N), "net").poses[0]
        assert off(poses.start.body, motion, poses.frame) < 0.05
        store.undo()
        assert sorted(store.poses("ann", range(N))) == [3]
