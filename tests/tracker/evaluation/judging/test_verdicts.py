import numpy as np
import pytest

from tracker.estimation.tracking.pose_errors import OFF_M
from tracker.evaluation.judging.verdicts import probability_beyond, with_doubt


@pytest.mark.parametrize("distance_m", [0.0, 0.05, 0.1, 0.15, 0.3])
@pytest.mark.parametrize("sigma_m", [0.006, 0.03, 0.08])
def test_the_probability_is_that_of_many_draws(distance_m, sigma_m):
    true = np.random.default_rng(0).normal(0.0, sigma_m, (100_000, 3))
    step = distance_m * np.array([0.6, 0.0, 0.8])
    expected = np.mean(np.linalg.norm(true - step, axis=1) > OFF_M)
    probability = probability_beyond(step, sigma_m**2 * np.eye(3))
    assert float(probability) == pytest.approx(expected, abs=0.006)


def test_a_tracked_limb_that_is_lost_tells_nothing():
    np.testing.assert_allclose(with_doubt(np.array([0.0, 1.0, 1.0]), np.array([1.0, 1.0, 0.2])), [0.5, 0.5, 0.9])
