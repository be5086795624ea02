"""Key points of a view that are late against the others: found, refused or moved by choice, never moved silently."""

import json

import numpy as np
import pytest
from observed_people import BODY_25, make_session, seen, walking, write_openpose

from tracker.errors import FormatError, Remedy
from tracker.interchange.exports.like.patched_files import export_patched
from tracker.interchange.observations.checks import view_shifts
from tracker.interchange.observations.importing import plan_import, store_import, stored_pictures
from tracker.interchange.observations.observed import ObservedPoints
from tracker.interchange.observations.plans import ImportRequest
from tracker.interchange.observations.stored import load_observations

N, FPS = 48, 30.0
NOISE_PX = 2.0


def late(points, view, frames):
    """The same points, those of a view later by some frames; those of its first frames are of nobody."""
    out = points.copy()
    rows = np.arange(len(points)) - frames
    inside = (rows >= 0) & (rows < len(points))
    out[:, view] = np.nan
    out[:, view, ..., 2] = 0.0
    out[inside, view] = points[rows[inside], view]
    return out


def observed(session, points):
    return ObservedPoints(BODY_25.points, session.camera_names, points[..., :2], np.nan_to_num(points[..., 2]))


def shifts(session, points, **more):
    return view_shifts(observed(session, points), [c.camera for c in session.cameras], FPS, **more)


@pytest.fixture(scope="module")
def session(tmp_path_factory):
    return make_session(tmp_path_factory.mktemp("session") / "s", N)


@pytest.fixture(scope="module")
def points(session):
    return seen(session, [walking(N)], NOISE_PX)


@pytest.mark.parametrize("frames", [-9, -2, 2, 5])
def test_a_late_view_is_found(session, points, frames):
    assert shifts(session, late(points, 1, frames)) == {"cam1": frames}


def test_nothing_is_said_of_views_in_step_or_without_motion_or_all_late(session, points):
    assert shifts(session, points) == {}
    still = np.repeat(points[:1], N, axis=0) + np.random.default_rng(1).normal(0, NOISE_PX, points.shape)
    still[..., 2] = 0.9
    assert shifts(session, late(still, 1, 5)) == {}
    assert shifts(session, np.stack([late(points, v, 5)[:, v] for v in range(4)], axis=1)) == {}
    assert shifts(session, points[:7]) == {}


def test_one_view_that_a_detector_failed_in_is_not_said_to_be_late(session, points):
    other = points.copy()
    other[:, 2, ..., :2] += np.cumsum(np.random.default_rng(2).normal(0, 20, (N, 1, 1, 2)), axis=0)
    assert shifts(session, other) == {}
    assert shifts(session, late(other, 1, 5)) in ({}, {"cam1": 5})


def test_two_of_several_views_are_late(session, points):
    both = late(late(points, 1, 4), 2, -3)
    assert shifts(session, both) == {"cam1": 4, "cam2": -3}


def test_of_two_views_and_of_several_people(tmp_path):
    session = make_session(tmp_path / "s", N, n_views=2)
    assert shifts(session, late(seen(session, [walking(N)]), 1, 4)) == {"cam1": 4}
    session = make_session(tmp_path / "t", N, people=("ann", "ben"))
    motions = [walking(N, (-0.6, -0.5, 0)), walking(N, (0.5, 0.6, 0), (-0.03, -0.01, 0))]
    points = seen(session, motions, NOISE_PX)
    assert shifts(session, points) == {}
    points[::2, 3] = points[::2, 3, ::-1]
    assert shifts(session, late(points, 3, -4)) == {"cam3": -4}


def test_the_first_of_three_views_is_late(tmp_path):
    session = make_session(tmp_path / "s", N, n_views=3)
    assert shifts(session, late(seen(session, [walking(N)], NOISE_PX), 0, 4)) == {"cam0": 4}


def test_one_frame_tells_no_shift(session, points):
    assert shifts(session, points[:1]) == {}


def test_known_clocks_are_no_shift(session, points):
    """Footage that is known to be late by whole frames shows later instants, and so do its key points."""
    early = late(points, 1, -3)
    assert shifts(session, early, ahead=[0, 3, 0, 0]) == {}
    assert shifts(session, points, ahead=[0, 3, 0, 0]) == {"cam1": 3}


def test_late_key_points_are_refused_until_the_user_decides(tmp_path, points):
    session = make_session(tmp_path / "s", N)
    folder = write_openpose(tmp_path / "k", session.camera_names, late(points, 1, 3))

    def plan(**choices):
        return plan_import(session, ImportRequest("mp", (folder,), ("ann",), **choices))

    (problem,) = plan().problems
    assert str(problem).startswith("camera 'cam1': expected key points that fit the other views on the same frame")
    assert "found that those of 3 frames later fit the other views best" in str(problem)
    assert problem.remedy == Remedy("shift_keypoints", camera="cam1", frames="3")
    with pytest.raises(FormatError):
        store_import(session, plan())
    stays = plan(offsets={"cam1": 0})
    assert not stays.problems
    assert (
        "camera 'cam1': of its key points, those of 3 frames later fit the other views best" in stays.observations.notes
    )
    moved = plan(offsets={"cam1": 3})
    assert not moved.problems
    assert "camera 'cam1': 3 frames were taken off, as chosen" in moved.observations.notes
    np.testing.assert_allclose(
        moved.observations.points.points_px[: N - 3, 1, 0], points[: N - 3, 1, 0, :, :2], atol=1e-3
    )
    with pytest.raises(FormatError, match=r"expected offsets of the cameras cam0, .* found one of 'cam9'"):
        plan(offsets={"cam9": 1})
    store_import(session, moved)
    observations = load_observations(session, "mp")
    assert json.loads(dict(observations.options)["offsets"]) == {"cam1": 3}
    first = {s.camera: int(s.frames[0]) for s in stored_pictures(session, observations)}
    assert first == {"cam0": 0, "cam1": -3, "cam2": 0, "cam3": 0}
    done = export_patched(session, observations, tmp_path / "back")
    assert not done.changed
    assert len(done.paths) == 4 * N
