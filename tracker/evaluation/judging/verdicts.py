"""How likely a limb of imported joints is off, by the joints that the footage shows."""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from tracker.estimation.tracking.pose_errors import OFF_M
from tracker.geometry.arrays import Array

LIMBS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        f"{side} {limb}": tuple(f"{side}_{joint}" for joint in joints)
        for limb, joints in (("arm", ("shoulder", "elbow", "wrist")), ("leg", ("hip", "knee", "ankle")))
        for side in ("left", "right")
    }
)
"""Joints of each limb that is judged."""


def probability_beyond(steps: Array, covariances: Array, radius_m: float = OFF_M) -> Array:
    """Return the probability that a true joint is farther from an imported one than a radius.

    The true joint is normal around the tracked one. Its covariance counts as isotropic with the same trace, so that the
    square of the distance is noncentral chi-square of 3 degrees of freedom.

    Args:
        steps: from the tracked joint to the imported one, (..., 3), metres.
        covariances: of the tracked joint, (..., 3, 3), m^2.
        radius_m: the radius, metres.

    Returns:
        (...,); NaN where a step is NaN.
    """
    from scipy.stats import ncx2  # imported lazily: loading takes 0.3 s

    variance = np.trace(covariances, axis1=-2, axis2=-1) / 3
    return np.asarray(ncx2.sf(radius_m**2 / variance, 3, np.sum(steps**2, axis=-1) / variance))


def with_doubt(beyond: Array, lost: Array) -> Array:
    """Return probabilities that limbs are off where the tracked limb itself may be lost: then nothing is known.

    Args:
        beyond: where the tracked limb is in its place, (...,).
        lost: probability that it is not, (...,).
    """
    return (1 - lost) * beyond + lost * 0.5
