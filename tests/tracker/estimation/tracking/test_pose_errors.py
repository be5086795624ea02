"""Errors of joints, and the status that follows from them."""

from dataclasses import replace

import numpy as np
import pytest

from tracker.body.limbs import limbs
from tracker.estimation.fitting.gauss_newton import OTHER_BODY_M
from tracker.estimation.fitting.hypothesis import CLEAR_NATS
from tracker.estimation.tracking.confidence import classify_limbs, probabilities
from tracker.estimation.tracking.pose_errors import (
    SELDOM_NATS,
    beyond,
    elsewhere_odds,
    even_odds,
    limb_odds,
    mass_odds,
    point_covariances,
)


@pytest.mark.parametrize(("sigma", "radius"), [(0.02, 0.03), (0.05, 0.1), (0.1, 0.1)])
def test_the_probability_of_a_longer_error(sigma, radius):
    errors = np.random.default_rng(1).normal(scale=sigma, size=(200_000, 3))
    share = np.mean(np.linalg.norm(errors, axis=1) > radius)
    assert beyond(radius, np.array(sigma)) == pytest.approx(share, abs=0.004)


def test_the_limb_whose_tracks_lie_apart_is_doubted_then_lost(gavrila):
    arm = next(i for i, x in enumerate(limbs(gavrila)) if x.name == "left_forearm")
    wrist = gavrila.point_names.index("left_wrist")
    statuses = []
    for apart_m in (0.03, 0.08, 0.2):
        steps = np.zeros((len(gavrila.point_names), 3, 3))
        steps[wrist] = np.diag([apart_m**2, 0, 0])
        odds = limb_odds(gavrila, point_covariances(gavrila, steps))
        statuses.append(classify_limbs(odds))
        assert odds[:, 1].argmax() == arm
        assert np.all(odds[:, 1] < odds[:, 0])
    assert statuses == ["good", "doubtful", "lost"]


def test_tracks_that_agree_leave_the_error_that_they_share(gavrila):
    """That of sizes that were fitted, or of a body that is nobody's own."""
    acquired = replace(gavrila, joint_sigma_m=0.004)
    for model, sigma_m in ((gavrila, OTHER_BODY_M), (acquired, 0.004)):
        errors = point_covariances(model)
        assert errors.shape == (len(model.point_names), 3, 3)
        np.testing.assert_allclose(errors, np.broadcast_to(sigma_m**2 * np.eye(3), errors.shape))


def test_a_limb_is_off_as_likely_as_paths_have_it_elsewhere():
    masses = np.array([0.0, 0.02, 0.4, 1.0])
    odds = mass_odds(masses)
    np.testing.assert_allclose(probabilities(odds[:, 0]), masses, atol=1e-9)
    assert np.all(odds[:, 1] < odds[:, 0])
    assert [classify_limbs(odds[i : i + 1]) for i in range(4)] == ["good", "good", "doubtful", "lost"]


def test_colors_count_less_against_a_limb_that_was_searched():
    odds = elsewhere_odds(np.array([SELDOM_NATS] * 2), [False, True])
    assert probabilities(odds[:, 0]) == pytest.approx([0.5, 1 / (1 + np.exp(CLEAR_NATS))])


def test_a_limb_that_one_view_shows_is_off_as_likely_as_not():
    odds = even_odds(np.array([True, False]))
    assert probabilities(odds[:, 0]).tolist() == [0.0, 0.5]
    assert [classify_limbs(odds[i : i + 1]) for i in range(2)] == ["good", "doubtful"]
