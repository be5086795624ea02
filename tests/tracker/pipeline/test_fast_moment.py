"""A moment at which something moves fast in two views: by joints, key points and pictures."""

import numpy as np
import pytest
from command_line import SAMPLE
from stored_motions import store_poses

from tracker.errors import TrackerError
from tracker.footage.recording import Recording
from tracker.formats.joint_maps import JointMap
from tracker.formats.pose_csv import read_pose_table
from tracker.interchange.observations.observed import ObservationSet, ObservedPoints
from tracker.interchange.observations.stored import save_observations
from tracker.pipeline.fast_moment import find_fast_moment
from tracker.session.session import load_session

VIEWS = (0, 2)


@pytest.fixture(scope="module")
def recording():
    with Recording(load_session(SAMPLE).cameras) as opened:
        yield opened


def test_tracked_joints_show_the_fastest_frame(session, recording):
    person, truth = session.people[0], read_pose_table(SAMPLE / "truth.csv").values
    store_poses(session, dict(enumerate(truth[:30])), source="tracked")
    found = find_fast_moment(session, recording, VIEWS)
    assert found.source == "tracked joints"
    assert 10 <= found.frame <= 16  # the arms turn fastest at frame 12
    cameras = [session.cameras[i].camera.pinhole for i in VIEWS]
    points_world = person.model.points_world(truth[found.frame])
    gaps = [np.abs(c.project(points_world) - at).sum(axis=1) for c, at in zip(cameras, found.centers_px, strict=True)]
    assert sum(gaps).min() < 1e-6  # one joint in both views


def test_a_key_point_that_jumps_is_not_fast(session, recording):
    n = session.n_frames
    points = np.full((n, len(session.cameras), 1, 2, 2), 50.0)
    points[:, :, 0, 0, 0] += np.cumsum(np.where(abs(np.arange(n) - 20) < 4, 5.0, 1.0))[:, None]
    points[30, :, 0, 1] += 200.0  # for one frame
    points[35:, :, 0, 1] += 100.0  # from then on
    seen = ObservedPoints(("a", "b"), tuple(session.camera_names), points, np.ones(points.shape[:-1]))
    joint_map = JointMap("points", {"left_wrist": "a"})
    observed = ObservationSet(
        "points", "openpose", (session.people[0].name,), joint_map, seen, None, (np.arange(n, dtype=float),)
    )
    save_observations(session, observed, {})
    found = find_fast_moment(session, recording, VIEWS)
    assert (found.source, abs(found.frame - 20) < 4) == ("key points", True)


@pytest.mark.slow
def test_without_both_the_pictures_show_one(session, recording):
    found = find_fast_moment(session, recording, VIEWS)
    assert found.source == "pictures"
    assert recording.read_view(0, found.frame).any()


def test_a_still_scene_is_refused(session, recording, monkeypatch):
    monkeypatch.setattr(recording, "read", lambda k, views: [np.zeros((480, 640, 3), np.uint8)] * 2)
    with pytest.raises(TrackerError, match="expected something that moves in both views, found nothing"):
        find_fast_moment(session, recording, VIEWS)
