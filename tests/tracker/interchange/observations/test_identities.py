"""People stay who they are where they cross closely, and where one was unseen for a while."""

import numpy as np
import pytest
from observed_people import BODY_25, make_session, seen, standing_points, walking

from tracker.interchange.observations.observed import ObservationSet, ObservedPoints, triangulate_observations
from tracker.interchange.observations.stored import load_observations, save_observations

N = 24


def walk_by(start, step, scale, n_frames=N):
    """A person of other size who walks, (n_frames, n_points, 3)."""
    return (
        scale * (walking(n_frames, (0, 0, 0), (0, 0, 0))) + np.array(start) + np.arange(n_frames)[:, None, None] * step
    )


def crossing(scales=(1.1, 0.95)):
    """Two who pass each other within a hand, with steps as long as they are apart: place alone lets them turn back."""
    ways = ((-2.3, 0.06, 0.0), np.array([0.2, 0.0, 0.0])), ((2.3, -0.06, 0.0), np.array([-0.2, 0.0, 0.0]))
    return [walk_by(*way, scale) for way, scale in zip(ways, scales, strict=True)]


def leaving(scales=(1.06, 0.98)):
    """One is unseen for a while; the other walks through that place; the first comes back where the other was."""
    frames = np.arange(N)[:, None, None]
    stays = scales[0] * standing_points() + np.array([-2.2, 0.0, 0.0]) + frames * np.array([0.2, 0.0, 0.0])
    leaves = scales[1] * standing_points() + np.array([1.0, 0.05, 0.0]) * np.where(frames < 12, 0.4, -1.1)
    leaves[6:18] = np.nan
    return [stays, leaves]


def exchanging(scales=(1.06, 0.98)):
    """Both are unseen for a while, and each comes back where the other was."""
    frames = np.arange(N)[:, None, None]
    side = np.array([0.5, 0.0, 0.0]) * np.where(frames < 10, 1.0, -1.0) + np.array([0.0, 0.1, 0.0]) * (frames % 2)
    motions = [scale * standing_points() + sign * side for scale, sign in zip(scales, (1, -1), strict=True)]
    for motion in motions:
        motion[8:14] = np.nan
    return motions


def people_of(session, motions, colors=None, noise_px=1.0, seed=1):
    """Whose each detection is by the program and by the truth, (n_frames, n_views, 2), those that show someone."""
    points = seen(session, motions, noise_px=noise_px)
    n_frames, n_views = points.shape[:2]
    order = np.random.default_rng(seed).permuted(np.tile([0, 1], (n_frames, n_views, 1)), axis=2)
    points = np.take_along_axis(points, order[..., None, None], axis=2)
    mixed = None if colors is None else np.take_along_axis(colors, order[..., None], axis=2)
    known = np.isfinite(points[..., 0])
    observed = ObservedPoints(
        BODY_25.points, session.camera_names, points[..., :2], np.where(known, points[..., 2], 0.0), colors=mixed
    )
    frames = (np.arange(float(n_frames)),)
    observations = ObservationSet("net", "openpose", ("ann", "ben"), BODY_25, observed, None, frames)
    found = triangulate_observations(observations, [c.camera for c in session.cameras]).identities
    return found[known.any(axis=-1)], order[known.any(axis=-1)]


@pytest.fixture
def session(tmp_path):
    return make_session(tmp_path / "s", N, people=("ann", "ben"))


def share_in_order(found, true):
    """Share of the detections of the right person; on the very frame of a crossing, views may contradict each other."""
    share = (found == true).mean()
    return max(share, 1 - share)


@pytest.mark.parametrize("motions", [crossing(), crossing((0.95, 1.1)), leaving(), leaving((0.98, 1.06)), exchanging()])
def test_sizes_tell_who_is_who(session, motions):
    assert share_in_order(*people_of(session, motions)) > 0.95


@pytest.mark.parametrize("motions", [crossing((1.0, 1.0)), leaving((1.0, 1.0)), exchanging((1.0, 1.0))])
def test_colors_tell_who_is_who_of_one_size(session, motions):
    random = np.random.default_rng(3)
    usual, of_cameras = np.array([[90.0, 140.0, 120.0], [120.0, 128.0, 128.0]]), random.normal(0, 20, (4, 1, 3))
    colors = usual + of_cameras + random.normal(0, 8, (N, 4, 2, 3))
    assert share_in_order(*people_of(session, motions, colors)) > 0.95


@pytest.mark.parametrize("motions", [crossing(), exchanging()])
def test_at_a_lower_rate_than_the_session_nothing_else_is_decided(session, motions):
    sparse = [np.full((N, *m.shape[1:]), np.nan) for m in motions]
    for own, motion in zip(sparse, motions, strict=True):
        own[::2] = motion[6:18]
    assert share_in_order(*people_of(session, sparse)) > 0.95


def test_people_of_one_look_who_come_near_each_other_stay_where_they_are(session):
    """Steps are small against their distance: place alone decides."""
    motions = [walk_by((x, 0, 0), np.array([s, 0, 0]), 1.0) for x, s in ((-0.7, 0.03), (0.7, -0.02))]
    colors = np.random.default_rng(3).normal(100, 8, (N, 4, 2, 3))
    assert share_in_order(*people_of(session, motions, colors)) == 1.0


def test_colors_are_stored_with_the_points(session):
    points = seen(session, [walking(N)])
    colors = np.random.default_rng(0).normal(100, 8, (N, 4, 1, 6))
    observed = ObservedPoints(BODY_25.points, session.camera_names, points[..., :2], points[..., 2], colors=colors)
    save_observations(
        session, ObservationSet("net", "x", ("ann",), BODY_25, observed, None, (np.arange(float(N)),)), {}
    )
    np.testing.assert_array_equal(load_observations(session, "net").points.colors, colors)
