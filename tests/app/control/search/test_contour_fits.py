"""A fit by contours is watched as a search: one step for each iteration, replayed with vectors to the edges."""

import itertools

import numpy as np
import pytest
from gestures import wait_for

from app.drawing import overlays
from app.state.page_view import View
from tracker.body.model import PosedBody
from tracker.tracking.contour.fit_steps import residual_vectors

CONTOURS = View(layers=frozenset({"contours"}), reductions=(1, 1, 1, 1))


@pytest.fixture
def fitted(opened):
    """A fit from a pose beside the person, and its run."""
    controller = opened()
    controller.tracking.set_method("contour")
    controller.search.run()
    wait_for(lambda: controller.state.search.message)
    with controller.lock:
        return controller, controller.replay.runs()[-1]


def test_each_step_is_an_iteration(fitted):
    controller, run = fitted
    assert run.method == "contour"
    assert [s.name for s in run.stages] == ["fit"]
    assert [s.evaluations for s in run.steps] == list(range(1, len(run.steps) + 1))
    assert 2 <= len(run.steps) <= 50
    poses = [run.poses_of(s.best)[0] for s in run.steps]
    assert all(np.abs(a - b).max() > 0 for a, b in itertools.pairwise(poses))
    np.testing.assert_array_equal(run.best[0], controller.state.poses[0])
    assert run.counts[0].done


def test_a_replay_shows_each_pose_with_vectors_to_the_edges(fitted):
    controller, run = fitted
    views = controller.frames.evidence(controller.state.frame)

    def vectors(step):
        controller.replay.show(run.number, step)
        drawn = overlays.paths(controller.session, controller.state, CONTOURS, views)
        return [p.segments_px for p in drawn if p.kind == "residual"]

    assert not any(p.kind == "residual" for p in overlays.paths(controller.session, controller.state, CONTOURS, views))
    before, after = vectors(-1), vectors(len(run.steps) - 1)
    assert len(before) == len(after) == len(views)
    np.testing.assert_allclose(controller.state.drawn.poses[0], run.best[0], atol=1e-6)
    without = View(layers=frozenset({"skeleton"}), reductions=(1, 1, 1, 1))
    assert not any(p.kind == "residual" for p in overlays.paths(controller.session, controller.state, without, views))


def test_vectors_end_at_edges(fitted):
    controller, run = fitted
    view = controller.frames.evidence(controller.state.frame)[0]
    vectors = residual_vectors(view, [PosedBody(controller.models[0], run.start[0])])
    assert len(vectors) > 10
    ends = (vectors[:, 2:] + 0.5) * view.scale - 0.5 - np.array(view.corner_px)
    u, v = np.rint(ends).astype(int).T
    inside = (u >= 0) & (v >= 0) & (u < view.distance.shape[1]) & (v < view.distance.shape[0])
    assert np.median(view.distance[v[inside], u[inside]]) < 1.5


def test_one_iteration_at_a_time(opened):
    controller = opened()
    controller.tracking.set_method("contour")
    for n in (1, 2):
        controller.search.step()
        wait_for(lambda n=n: controller.replay.runs() and len(controller.replay.runs()[-1].steps) == n)
    assert controller.state.search.kind == "search"
