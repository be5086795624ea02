"""The paper's minimization on synthetic contours: iteration by iteration, and from a rough guess."""

import numpy as np
import pytest

from tracker.simulate.experiments.contour_experiment import ContourExperiment, make_scene
from tracker.simulate.experiments.convergence import BACK, MAX_ITERATIONS, MODES, fit_from_guess, measure_convergence


@pytest.fixture(scope="module")
def scene():
    return make_scene(ContourExperiment(n_frames=5, n_cameras=2, camera_counts=(2,)), "own shape", 2)


def test_all_kinds_of_fits_begin_at_the_same_poses(scene):
    found = {(c.back, c.mode): c for c in measure_convergence(scene)}
    assert found.keys() == {(back, mode) for back in BACK for mode in MODES}
    for c in found.values():
        assert c.rms_px.shape == (len(c.fits), MAX_ITERATIONS + 1)
        assert c.mean_iterations >= 1
        np.testing.assert_array_equal(c.rms_px[:, 0], found[c.back, "paper"].rms_px[:, 0])
        if c.mode == "default":  # it minimizes more than these distances
            assert c.rms_px[:, -1].max() < 0.7
        else:
            assert np.all(np.diff(c.rms_px) <= 0)


def test_a_rough_guess_is_fitted_chain_by_chain(scene):
    steps, (start, at_once) = fit_from_guess(scene)
    assert [s.name for s in steps][:3] == ["start", "root", "trunk"]
    assert steps[-1].name == "whole body"
    assert steps[0] == start
    assert [s.rms_px for s in steps] == sorted((s.rms_px for s in steps), reverse=True)
    assert steps[-1].rms_px < 0.3 * start.rms_px
    assert at_once.rms_px < start.rms_px
