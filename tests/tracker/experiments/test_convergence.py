"""The paper's minimization and that of the contour tracker on single frames."""

import numpy as np
import pytest
from staging import cameras_around, own_evidence, posed

from tracker.body.model import PosedBody
from tracker.experiments.contour_experiment import ContourExperiment, make_scene
from tracker.experiments.convergence import (
    BACK,
    KINDS,
    MAX_ITERATIONS,
    ContourFit,
    Convergence,
    fit_contours,
    measure_convergence,
)
from tracker.formats.model_toml import load_model

BODY = load_model("knossow54", 1.75)


@pytest.mark.parametrize("kind", KINDS)
def test_it_comes_near_the_contours_within_the_joint_limits(kind):
    body, cameras = PosedBody(BODY, posed(BODY, 4)), cameras_around(4)
    start = body.values.copy()
    start[:3] += [0.03, -0.02, 0.02]
    found = fit_contours(BODY, start, own_evidence([body], cameras), kind)
    assert 1 <= found.iterations <= MAX_ITERATIONS
    assert found.rms_px[-1] < 0.2 * found.rms_px[0]
    np.testing.assert_array_equal(BODY.clip(found.pose), found.pose)


def test_a_body_that_no_view_shows_stays_where_it_is():
    views = own_evidence([PosedBody(BODY, BODY.neutral())], cameras_around(1))
    away = BODY.neutral()
    away[2] = 50.0
    found = fit_contours(BODY, away, views, "with sliding")
    np.testing.assert_array_equal(found.pose, away)
    assert found.iterations == 0


def test_all_kinds_of_fits_begin_at_the_same_poses():
    scene = make_scene(ContourExperiment(n_frames=5, n_cameras=2, camera_counts=(2,)), "own shape", 2)
    found = {(c.back, c.kind): c for c in measure_convergence(scene)}
    assert found.keys() == {(back, kind) for back in BACK for kind in KINDS}
    for back in BACK:
        assert len({found[back, kind].mean_rms_px[0] for kind in KINDS}) == 1
        assert len(found[back, "with sliding"].mean_rms_px) == MAX_ITERATIONS + 1
        assert found[back, "with sliding"].mean_iterations >= 1


def test_fits_that_end_early_keep_their_distance():
    fits = (ContourFit(np.zeros(1), (2.0, 0.6)), ContourFit(np.zeros(1), (4.0, 3.0, 1.0, 0.8, 0.75, 0.71, 0.6)))
    found = Convergence(1, "with sliding", fits)
    np.testing.assert_allclose(found.mean_rms_px[[0, 1, 6, 15]], [3.0, 1.8, 0.6, 0.6])
    assert (found.mean_iterations, found.share_within(5), found.share_within(6)) == (3.5, 0.5, 1.0)
