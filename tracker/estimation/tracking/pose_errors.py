"""Errors of joints by all frames of a run, and the status of a pose from them and from what else it may be.

The error of a point is normal. Its covariance is that of the solved path, and what all views share: sizes of the body,
and where its joints lie in the flesh, which `tests/benchmarks/joint_errors.py` measures on simulated people.
"""

from collections.abc import Sequence

import numpy as np

from tracker.body.limbs import limbs
from tracker.body.model import BodyModel
from tracker.estimation.fitting.gauss_newton import OTHER_BODY_M
from tracker.estimation.fitting.hypothesis import CLEAR_NATS, SAME_POSE_M
from tracker.estimation.tracking.confidence import LOST_NATS, LOST_ODDS, OFF_ODDS, probabilities
from tracker.geometry.arrays import TINY, Array, Mask

SHARED_M = 0.006
"""Standard deviation along each axis with which sizes acquired from known joints determine the joints, metres. Of those
of 13 simulated people, 88% lie in their 90% ellipsoids (`tests/benchmarks/joint_errors.py`); with half as much 55%,
with twice as much 99%. The covariance of the sizes says 5 to 8 mm (docs/decisions/runs.md)."""
SELDOM_NATS = 10.0
"""How much likelier the colours of the run must find a limb elsewhere until it is off as likely as not, nats. Of 3,354
limbs of twelve simulated people in their place, 0.2% had more; of 83 that were put elsewhere by more than 20 cm, 88%
(`tests/benchmarks/region_evidence.py --displaced`)."""
OFF_M = SAME_POSE_M
"""A limb is off where one of its joints is farther from its true place, metres: in another pose."""
DOUBTFUL_FROM, LOST_FROM = probabilities(np.array([OFF_ODDS - LOST_NATS, LOST_ODDS])).tolist()
"""Probabilities of a lost limb above which it is doubtful, and lost."""


def acquired_sigma_m(joints_are_given: bool) -> float:
    """Return `BodyModel.joint_sigma_m` of an acquired body, metres.

    Contours show the flesh. Without known joints, those of a person also lie elsewhere in it.
    """
    return SHARED_M if joints_are_given else float(np.hypot(SHARED_M, OTHER_BODY_M))


def point_covariances(model: BodyModel, errors_m2: Array | float = 0.0) -> Array:
    """Return the covariances of the points of a body, (n_points, 3, 3), m^2.

    Args:
        model: the body.
        errors_m2: those of the pose alone, likewise.
    """
    shared_m = OTHER_BODY_M if model.joint_sigma_m is None else model.joint_sigma_m
    return np.asarray(errors_m2 + np.tile(shared_m**2 * np.eye(3), (len(model.point_names), 1, 1)))


def limb_odds(model: BodyModel, covariances: Array) -> Array:
    """Return the log odds that each limb is off and lost, (n_limbs, 2).

    Args:
        model: the body.
        covariances: of its points, (n_points, 3, 3), m^2.
    """
    from scipy.special import logit  # imported lazily, as below

    sigmas = np.sqrt(np.trace(covariances, axis1=1, axis2=2) / 3)
    worst = np.array([sigmas[np.isin(model.point_parts, limb.parts)].max() for limb in limbs(model)])
    return np.asarray(logit(beyond(OFF_M, worst))[:, None] + (0.0, -LOST_NATS))


def elsewhere_odds(nats: Array, is_searched: Sequence[bool]) -> Array:
    """Return the log odds that each limb is off and lost, (n_limbs, 2), by the colours of the run.

    A limb may look unusual because it is partly occluded. If a search has compared its place with others on that
    frame, and found none within `CLEAR_NATS`, the log odds are lower by as much.

    Args:
        nats: how much likelier each limb is elsewhere, (n_limbs,); see `region_model.elsewhere_nats`.
        is_searched: whether a search has left each limb where it is, (n_limbs,).
    """
    odds = nats - SELDOM_NATS - np.where(is_searched, CLEAR_NATS, 0.0)
    return np.asarray(odds[:, None] + (0.0, -LOST_NATS))


def mass_odds(masses: Array) -> Array:
    """Return the log odds that each limb is off and lost, (n_limbs, 2), by the mass of the paths on which it is
    elsewhere, (n_limbs,)."""
    from scipy.special import logit  # imported lazily, as above

    least = np.finfo(np.float64).eps
    odds = np.asarray(logit(np.clip(masses, least, 1 - least)))
    return odds[:, None] + (0.0, -LOST_NATS)


def even_odds(is_known: Mask) -> Array:
    """Return the log odds that each limb is off and lost, (n_limbs, 2), where nothing says where it is, (n_limbs,).

    It is then off as likely as not. Nothing follows of the other limbs.
    """
    return np.where(is_known, -np.inf, 0.0)[:, None] + (0.0, -LOST_NATS)


def beyond(radius_m: float, sigma_m: Array) -> Array:
    """Return the probability that a normal error in three dimensions is longer than a radius, metres.

    Args:
        radius_m: the radius, metres.
        sigma_m: standard deviation along each axis, of any shape, metres.
    """
    from scipy.special import erfc  # imported lazily: loading takes 0.1 s

    x = radius_m / np.maximum(sigma_m, TINY)
    return np.asarray(erfc(x / np.sqrt(2)) + np.sqrt(2 / np.pi) * x * np.exp(-(x**2) / 2))


def probability_off(lost: Array) -> Array:
    """Return the probabilities that limbs are off by those that they are lost, of any shape."""
    with np.errstate(divide="ignore"):
        return probabilities(np.log(lost) - np.log1p(-lost) + LOST_NATS)
