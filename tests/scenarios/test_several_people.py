"""Several people at a time: no identity swaps, and no refinement without effect."""

from dataclasses import replace

import numpy as np
import pytest
from staging import at, cameras_around, filmed, own_evidence, posed, solid
from tracking_runs import track

from tracker.body.model import PosedBody
from tracker.body.motion.pose_steps import PredictSettings
from tracker.estimation.by_frame.frame_estimator import FrameEstimator
from tracker.estimation.by_frame.frame_problem import FrameProblem
from tracker.estimation.by_frame.limb_recovery import search_limbs
from tracker.estimation.chamfer.settings import TrackSettings
from tracker.estimation.tracking.person_memory import PersonMemory

N_FRAMES = 3
APART_M = 1.0


def crowd(model, n):
    """Poses of n people at the corners of a square, each slightly different, walking 2 cm a frame, (n, frames, ...)."""
    out = []
    for i, (x, y) in enumerate([(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)][:n]):
        start = posed(model, 10 + i)
        start[:2] = APART_M * x, APART_M * y
        step = np.zeros(model.n_dofs)
        step[:2] = 0.02 * np.cos(2.0 * i), 0.02 * np.sin(2.0 * i)
        step[[n.endswith(("elbow.extension", "knee.extension")) for n in model.dof_names]] = np.radians(3)
        out.append([model.clip(model.retract(start, k * step)) for k in range(N_FRAMES)])
    return np.array(out)


@pytest.mark.parametrize("n", [3, pytest.param(4, marks=pytest.mark.slow)])
def test_people_a_metre_apart_stay_who_they_are(gavrila, n):
    truth = crowd(gavrila, n)
    observer = filmed([[PosedBody(gavrila, poses[k]) for poses in truth] for k in range(N_FRAMES)])
    settings = replace(TrackSettings(), predict=PredictSettings(order=0), rounds=1)
    found = list(track(observer, [gavrila] * n, truth[:, 0], range(N_FRAMES), settings))
    for k, estimate in enumerate(found):
        points = np.array([gavrila.points_world(p) for p in estimate.poses])
        true = np.array([gavrila.points_world(p) for p in truth[:, k]])
        off_m = np.linalg.norm(points[:, None] - true, axis=-1)  # (n, n, points): of each to everybody
        assert np.diagonal(off_m.mean(axis=-1)).max() < 0.05
        np.testing.assert_array_equal(off_m.mean(axis=-1).argmin(axis=1), np.arange(n))
        assert len(estimate.statuses) == len(estimate.alternatives) == n
    assert all(o == () for o in found[-1].alternatives)


def estimator_of(model, views, expected, settings):
    """Of several people who have not been seen before."""
    memories = [PersonMemory(model, v, alone=False) for v in expected]
    return FrameEstimator(views, memories, [PosedBody(model, v) for v in expected], settings)


@pytest.mark.parametrize(("off_m", "solves"), [(0.0, 2), (0.05, 4)])
def test_people_are_refined_again_only_where_others_moved(monkeypatch, off_m, solves):
    """Two people at rest are refined once each. If the second is found 5 cm off, both are refined once more."""
    ball, cameras, done = solid((0.15, 0.15, 0.3)), cameras_around(4), []
    values = np.zeros((2, 6))
    values[:, 1] = -0.3, 0.3
    views = own_evidence([at(ball, *v[:3]) for v in values], cameras)
    expected = values.copy()
    expected[1, 0] += off_m
    refine = FrameProblem.refine
    monkeypatch.setattr(FrameProblem, "refine", lambda *a, **k: done.append(a) or refine(*a, **k))
    estimator = estimator_of(ball, views, expected, TrackSettings(recover=None, rounds=5))
    estimator.estimate([0, 1])
    found = np.array([b.values for b in estimator.bodies])
    np.testing.assert_allclose(found[:, :3], values[:, :3], atol=0.005)
    assert len(done) == solves


@pytest.mark.slow
def test_nothing_depends_on_who_is_done_first(gavrila, monkeypatch):
    """Two people, each with an arm that is predicted elsewhere and is searched: in threads, and one by one from the
    last to the first."""
    truth = crowd(gavrila, 2)[:, 0]
    views, expected = own_evidence([PosedBody(gavrila, v) for v in truth], cameras_around(4)), truth.copy()
    for values, side in zip(expected, ("left", "right"), strict=True):
        values[gavrila.dof_names.index(f"{side}_shoulder.elevation")] += 2.0
    searched = []

    def poses():
        estimator = estimator_of(gavrila, views, expected, TrackSettings())
        estimate = estimator.estimate([0, 1])
        return np.array([*(b.values for b in estimator.bodies), *(estimate[p].covariance.sum(axis=1) for p in (0, 1))])

    monkeypatch.setattr(
        "tracker.estimation.by_frame.frame_estimator.search_limbs", lambda *a: searched.append(a) or search_limbs(*a)
    )
    usual = poses()
    assert len(searched) == 2
    one_by_one = lambda work, items: [work(x) for x in items[::-1]][::-1]  # noqa: E731
    monkeypatch.setattr("tracker.estimation.by_frame.frame_estimator.map_parallel", one_by_one)
    np.testing.assert_array_equal(poses(), usual)
