"""A metric of another package: the mean jerk of the estimate, which `quadrille evaluate` then prints."""

import numpy as np

from quadrille import ComparedJoints, Metric


def jerk(joints: ComparedJoints) -> float:
    """Return the mean norm of the third derivative of the estimated joints, m/s^3."""
    norms = np.linalg.norm(np.diff(joints.estimate, n=3, axis=0), axis=-1) * joints.fps**3
    return float(np.nanmean(norms)) if np.isfinite(norms).any() else float("nan")


JERK = Metric("jerk", "mean jerk", "m/s^3", jerk)
