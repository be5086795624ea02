import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from staging import posed

from tracker.body.limbs import limbs
from tracker.tracking.confidence import classify_limbs
from tracker.tracking.run_confidence import (
    DOUBTFUL_FROM,
    LOST_FROM,
    N_FEATURES,
    log_odds,
    run_features,
    smoothing_steps,
)

CLEAR = np.array([np.log(1.5), 0.06, 1.0, 1.0, 0.0, np.log(0.015), 0.02, np.log(4)])
"""Features of a limb on a frame that speak for it."""


def test_steps_of_the_limb_that_smoothing_moves(gavrila):
    tracked = np.array([posed(gavrila, 1)] * 3)
    smoothed = np.array(tracked)
    smoothed[1, gavrila.dof_names.index("left_elbow.extension")] += 0.2
    steps = smoothing_steps(gavrila, tracked, smoothed)
    arm = [x.name for x in limbs(gavrila)].index("left_forearm")
    assert np.flatnonzero(steps.any(axis=1)).tolist() == [1]
    assert np.flatnonzero(steps.any(axis=0)).tolist() == [arm]
    assert 0.01 < steps[1, arm] < 0.1  # of the height


def test_a_step_counts_on_the_frames_around():
    steps = np.zeros((9, 2))
    steps[4, 1] = 0.1
    found = run_features(np.tile(CLEAR, (9, 2, 1)), steps)
    assert found.shape == (9, 2, N_FEATURES)
    odds = log_odds(found)[..., 0]
    assert np.flatnonzero(odds[:, 1] > odds[:, 0]).tolist() == [2, 3, 4, 5, 6]


def test_a_body_that_fits_badly_everywhere_is_doubted_on_all_frames():
    features, steps = np.tile(CLEAR, (9, 2, 1)), np.full((9, 2), 0.002)
    well = log_odds(run_features(features, steps))
    features[0, :, 6] = 0.5  # the trunk on one frame
    badly = log_odds(run_features(features, steps))
    assert np.all(badly > well)
    np.testing.assert_allclose(badly, np.broadcast_to(badly[0, 0], badly.shape))  # all alike: that frame as well


@given(worse=st.tuples(*[st.floats(0, 2)] * 8), step=st.floats(0, 0.3), more=st.floats(0, 0.3), frame=st.integers(0, 5))
def test_worse_figures_never_clear_a_limb(worse, step, more, frame):
    features, steps = np.tile(CLEAR, (6, 1, 1)), np.full((6, 1), step)
    before = log_odds(run_features(features, steps))
    features[frame, 0] += np.array([1, 1, -1, -1, 1, 1, 1, -1]) * worse
    steps[frame] += more
    after = log_odds(run_features(features, steps))
    assert np.all(after[frame] >= before[frame] - 1e-9)
    order = ("good", "doubtful", "lost")
    assert order.index(classify_limbs(after[frame])) >= order.index(classify_limbs(before[frame]))


def test_a_limb_is_never_more_likely_lost_than_off():
    odds = log_odds(np.random.default_rng(1).normal(size=(20, N_FEATURES)))
    assert np.all(odds[:, 1] < odds[:, 0])


@pytest.mark.parametrize("limb", range(3))
def test_limbs_are_doubtful_and_lost_from_the_probabilities_that_make_the_pose_so(limb):
    seen = set()
    for step in np.geomspace(1e-3, 20, 40):
        features = np.tile(CLEAR, (1, 3, 1))
        features[0, limb, 1] += step
        odds = log_odds(run_features(features, np.zeros((1, 3))))[0]
        p = (1 / (1 + np.exp(-odds[:, 1]))).max()
        seen.add(classify_limbs(odds))
        assert classify_limbs(odds) == ("lost" if p > LOST_FROM else "doubtful" if p > DOUBTFUL_FROM else "good")
    assert seen == {"good", "doubtful", "lost"}


def test_the_worst_limb_decides():
    for several in itertools.product((-9.0, -2.5, 1.0), repeat=3):
        odds = np.stack([several, np.array(several) - 1.5], axis=-1)
        expected = "lost" if 1.0 in several else "doubtful" if -2.5 in several else "good"
        assert classify_limbs(odds) == expected
