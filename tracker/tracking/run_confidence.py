"""Classify the poses of a finished run, of which the frames around each are known.

The log odds that a limb is off are linear, as in `confidence`: one set of weights serves both thresholds. Two features
are of the run. A wrong limb seldom moves smoothly, so that smoothing moves it far. A body of wrong sizes fits badly on
all frames. The weights were fitted as those of `confidence` were (`tests/benchmarks/calibrate_status.py`).
"""

import numpy as np

from tracker.body.limbs import limbs
from tracker.body.model import BodyModel
from tracker.geometry.arrays import Array
from tracker.tracking.confidence import FEATURES, LOST_ODDS, NEXT_TO_NOTHING, OFF_ODDS, StatusModel, probabilities

RUN_MODEL = StatusModel(np.array([1.623, 2.136, -1.529, -1.445, 4.644, -1.302, 1.014, 0.628]), 5.433, 3.683)
"""Log odds by `run_features`, fitted by `tests/benchmarks/calibrate_status.py`."""
N_FEATURES = len(RUN_MODEL.weights)
_TRUNK = FEATURES.index("trunk_forward")
_OF_FRAME = [i for i, name in enumerate(FEATURES) if name not in ("innovation", "trunk_forward")]
"""Features of `confidence` that are features of a run too."""
_AROUND = 2
"""Number of frames before and after a frame whose steps by smoothing count for it."""
_MAX_STEP = 0.5
"""Larger steps count as this one, body heights."""

DOUBTFUL_FROM, LOST_FROM = probabilities(np.array([OFF_ODDS + RUN_MODEL.lost - RUN_MODEL.off, LOST_ODDS])).tolist()
"""Probabilities of a lost limb above which it is doubtful, and lost."""


def smoothing_steps(model: BodyModel, tracked: Array, smoothed: Array) -> Array:
    """Return how far smoothing moves each limb on each frame, (T, n_limbs), body heights.

    Args:
        model: the body.
        tracked: poses, (T, n_values).
        smoothed: the same poses after smoothing, (T, n_values).
    """
    before, after = (np.array([model.points_world(p) for p in poses]) for poses in (tracked, smoothed))
    steps = np.linalg.norm(after - before, axis=-1) / model.height_m
    return np.stack([steps[:, np.isin(model.point_parts, x.parts)].max(axis=1) for x in limbs(model)], axis=1)


def run_features(frame_features: Array, steps: Array) -> Array:
    """Return the features of all limbs from which their final statuses follow, (T, n_limbs, 8).

    Args:
        frame_features: those of `confidence.features` on each frame, (T, n_limbs, 8), in the order of time.
        steps: see `smoothing_steps`, (T, n_limbs).
    """
    padded = np.pad(steps, ((_AROUND, _AROUND), (0, 0)))
    largest = np.lib.stride_tricks.sliding_window_view(padded, 2 * _AROUND + 1, axis=0).max(axis=-1)
    trunk = np.log(frame_features[..., _TRUNK].mean() + NEXT_TO_NOTHING)
    of_run = np.stack([np.log(np.minimum(largest, _MAX_STEP) + NEXT_TO_NOTHING), np.full_like(steps, trunk)], axis=-1)
    return np.concatenate([frame_features[..., _OF_FRAME], of_run], axis=-1)


def log_odds(found: Array) -> Array:
    """Return the log odds of off and lost, (..., 2), of features, (..., 8)."""
    return np.asarray((found @ RUN_MODEL.weights)[..., None] + (RUN_MODEL.off, RUN_MODEL.lost))


def probability_off(lost: Array) -> Array:
    """Return the probabilities that limbs are off by those that they are lost, of any shape."""
    with np.errstate(divide="ignore"):
        odds = np.log(lost) - np.log1p(-lost)
    return probabilities(odds + RUN_MODEL.off - RUN_MODEL.lost)
