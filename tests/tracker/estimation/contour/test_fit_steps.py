"""The minimization as steps that are watched: iterations, and the residuals that are drawn."""

from dataclasses import replace

import numpy as np
import pytest
from staging import cameras_around, in_posture, own_evidence

from tracker.body.model import PosedBody
from tracker.estimation.by_frame.incremental_fit import fit_by_chains, fit_chains
from tracker.estimation.contour.fit_steps import (
    FitPlan,
    contour_steps,
    paper_residuals,
    residual_segments,
    unlimited_views,
)
from tracker.estimation.contour.paper import paper_settings
from tracker.formats.model_toml import load_model

BODY = load_model("gavrila22_cones")


@pytest.fixture(scope="module")
def views():
    return own_evidence([PosedBody(BODY, in_posture(BODY))], cameras_around(3))


def moved(metres):
    return in_posture(BODY) + np.where(BODY.dof_is_length, metres, 0.0)


def test_every_iteration_is_a_step(views):
    plan = FitPlan([BODY], [np.ones(BODY.n_dofs, bool)])
    steps = list(contour_steps(views, [moved(0.02)], plan))
    px = [s.best_px for s in steps]
    assert px == sorted(px, reverse=True)
    assert px[-1] < 0.3 * px[0]
    assert [s.evaluations for s in steps] == list(range(len(steps)))
    assert [s.stage_done for s in steps] == [False] * (len(steps) - 1) + [True]
    np.testing.assert_array_equal(steps[0].best[0], moved(0.02))


def test_locked_degrees_of_freedom_stay(views):
    active = np.array([not n.startswith("torso") for n in BODY.dof_names])
    *_, last = contour_steps(views, [moved(0.02)], FitPlan([BODY], [active]))
    np.testing.assert_array_equal(last.best[0][~active], moved(0.02)[~active])
    assert FitPlan([BODY], [np.zeros(BODY.n_dofs, bool)]).stages == []


def test_a_rough_pose_is_fitted_chain_by_chain(views):
    """Root, limbs, whole body: each stage moves its own chain alone, and ends as the tracker's start does."""
    rough = moved(0.03) + np.where(np.char.find(BODY.dof_names, "left_elbow") >= 0, 0.3, 0.0)
    plan = FitPlan([BODY], [np.ones(BODY.n_dofs, bool)], by_chains=True)
    names = [name for name, dofs in fit_chains(BODY) if dofs.any()]  # this body has no joints in the trunk
    assert [s.name for s in plan.stages] == names
    assert (names[0], names[-1]) == ("root", "whole body")
    steps, before, left = list(contour_steps(views, [rough], plan)), rough, {n: 0 for n in names}
    for step in steps:
        moves = np.flatnonzero(step.best[0] != before)
        assert set(np.array(BODY.dof_names)[moves]) <= set(step.stage.group.dofs)
        before, left[step.stage.name] = step.best[0], left[step.stage.name] + 1
    assert min(left.values()) >= 1
    assert [s.evaluations for s in steps] == sorted(s.evaluations for s in steps)
    assert [s.stage.name for s in steps if s.stage_done] == names
    px = [s.best_px for s in steps]
    assert px == sorted(px, reverse=True)
    assert px[-1] < 0.3 * px[0]
    unlimited, settings = unlimited_views(views, paper_settings()), paper_settings()
    residuals = paper_residuals(unlimited, [PosedBody(BODY, rough)], 0, settings)
    *_, last = fit_by_chains(BODY, rough, [residuals])
    np.testing.assert_allclose(steps[-1].best[0], last.fit.pose, atol=2e-3)


def test_locked_chains_are_left_out(views):
    active = np.array([not n.startswith("torso") for n in BODY.dof_names])
    plan = FitPlan([BODY], [active], by_chains=True)
    assert "root" not in [s.name for s in plan.stages]
    *_, last = contour_steps(views, [moved(0.02)], plan)
    np.testing.assert_array_equal(last.best[0][~active], moved(0.02)[~active])


def test_residuals_end_on_the_image_contours(views):
    at = residual_segments([PosedBody(BODY, moved(0.02))], views[0])
    assert len(at) > 50
    lengths = np.linalg.norm(at[:, 2:] - at[:, :2], axis=1)
    assert np.median(lengths) > 1
    assert np.median(np.linalg.norm(np.diff(residual_segments([PosedBody(BODY, moved(0.0))], views[0])
                                            .reshape(-1, 2, 2), axis=1), axis=-1)) < 1  # fmt: skip
    rows, columns = np.rint(at[:, [3, 2]]).astype(int).T
    inside = (rows >= 0) & (rows < 480) & (columns >= 0) & (columns < 640)
    assert np.mean(views[0].distance[rows[inside], columns[inside]] < 1.5) > 0.9


def test_residuals_are_in_pixels_of_the_footage(views):
    body = [PosedBody(BODY, moved(0.02))]
    plain, shifted = residual_segments(body, views[0]), residual_segments(body, replace(views[0], corner_px=(10, 20)))
    np.testing.assert_allclose(shifted - plain, np.tile([10, 20, 10, 20], (len(plain), 1)), atol=1e-3)
