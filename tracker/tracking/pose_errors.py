"""Errors of joints from how far tracks without a view each lie apart, and the status of a pose from them.

The error of a point is normal. Its covariance is the mean square of the steps to the tracks without a view, and what
all views share: with which standard deviation the sizes determine the point. On simulated people, a joint whose tracks
lie 20, 40 and 80 mm apart is off by as much (`tests/benchmarks/joint_errors.py`).
"""

import numpy as np

from tracker.body.limbs import limbs
from tracker.body.model import BodyModel
from tracker.fitting.gauss_newton import OTHER_BODY_M
from tracker.geometry.arrays import Array
from tracker.tracking.run_confidence import RUN_MODEL

SELDOM_NATS = 10.0
"""How much likelier the colours of the run must find a limb elsewhere until it is off as likely as not, nats. Of 1,000
simulated limbs in their place, none had more; of 20 that were put elsewhere, all had
(`tests/benchmarks/region_evidence.py --displaced`)."""
OFF_M = 0.10
"""A limb is off where one of its joints is farther from its true place, metres."""


def shared_sigmas_m(model: BodyModel) -> Array:
    """Return the standard deviation along each axis of the error of each point that all views share, (n_points,), m.

    It is that of the sizes. Of sizes that are nobody's own nothing is known but how far joints of people lie from those
    of a typical body.
    """
    if not model.point_sigmas:
        return np.full(len(model.point_names), OTHER_BODY_M)
    return model.height_m * np.array(model.point_sigmas)


def point_covariances(model: BodyModel, steps: Array | float = 0.0) -> Array:
    """Return the covariances of the points of a body, (n_points, 3, 3), m^2.

    Args:
        model: the body.
        steps: mean squares of the steps to other tracks, likewise.
    """
    return np.asarray(steps + shared_sigmas_m(model)[:, None, None] ** 2 * np.eye(3))


def limb_odds(model: BodyModel, covariances: Array) -> Array:
    """Return the log odds that each limb is off and lost, (n_limbs, 2).

    Args:
        model: the body.
        covariances: of its points, (n_points, 3, 3), m^2.
    """
    from scipy.special import logit  # imported lazily, as below

    sigmas = np.sqrt(np.trace(covariances, axis1=1, axis2=2) / 3)
    worst = np.array([sigmas[np.isin(model.point_parts, limb.parts)].max() for limb in limbs(model)])
    return np.asarray(logit(beyond(OFF_M, worst))[:, None] + (0.0, RUN_MODEL.lost - RUN_MODEL.off))


def elsewhere_odds(nats: Array) -> Array:
    """Return the log odds that each limb is off and lost, (n_limbs, 2), by the colours of the run.

    Args:
        nats: how much likelier each limb is elsewhere, (n_limbs,); see `region_deficit.elsewhere_nats`.
    """
    return np.asarray((nats - SELDOM_NATS)[:, None] + (0.0, RUN_MODEL.lost - RUN_MODEL.off))


def beyond(radius_m: float, sigma_m: Array) -> Array:
    """Return the probability that a normal error in three dimensions is longer than a radius, metres.

    Args:
        radius_m: the radius, metres.
        sigma_m: standard deviation along each axis, of any shape, metres.
    """
    from scipy.special import erfc  # imported lazily: loading takes 0.1 s

    x = radius_m / np.maximum(sigma_m, 1e-9)
    return np.asarray(erfc(x / np.sqrt(2)) + np.sqrt(2 / np.pi) * x * np.exp(-(x**2) / 2))
