"""Errors of joints, and the status that follows from them."""

from dataclasses import replace

import numpy as np
import pytest

from tracker.body.limbs import limbs
from tracker.body.model import PosedBody
from tracker.fitting.gauss_newton import OTHER_BODY_M
from tracker.fitting.hypothesis import Hypothesis
from tracker.tracking.confidence import classify_limbs, probabilities
from tracker.tracking.pose_errors import alternative_odds, beyond, limb_odds, point_covariances


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


def test_limbs_are_elsewhere_as_likely_as_other_poses_are(gavrila):
    here, names = gavrila.neutral(), [x.name for x in limbs(gavrila)]
    arm = names.index("left_forearm")

    def raised(by_rad, nats):
        pose = here.copy()
        pose[gavrila.value_names.index("left_shoulder.elevation")] += by_rad
        return Hypothesis(PosedBody(gavrila, pose), cost=nats)

    off = probabilities(alternative_odds(gavrila, here, [raised(0.8, 2.0), raised(1.2, 2.0), raised(0.02, 0.0)])[:, 0])
    weight = 2 * np.exp(-2.0)
    assert off[arm] == pytest.approx(weight / (1 + weight))  # the third is in the same place
    assert not np.delete(off, arm).any()
    better = alternative_odds(gavrila, here, [raised(0.8, -4.0)])
    assert probabilities(better[arm, 0]) == pytest.approx(0.5)
    assert classify_limbs(better) == "doubtful"
    assert classify_limbs(alternative_odds(gavrila, here, [raised(0.8, 3.5)])) == "good"
    assert classify_limbs(alternative_odds(gavrila, here, [])) == "good"
