"""How likely a limb of imported joints is off, by the joints that the footage shows, and why, in words."""

from collections.abc import Mapping, Sequence
from types import MappingProxyType

import numpy as np

from tracker.body.limbs import display_name
from tracker.estimation.tracking.pose_errors import OFF_M
from tracker.geometry.arrays import Array, Mask

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


_CLEARER = 0.5
"""Share of the distance that is left after an exchange of sides from which it is one."""
_JUMP = 5.0
"""Second differences of an imported joint, in the usual ones of the run, from which it jumps: of normal errors one in a
million is as large."""
_LEAST_M = 1e-3
"""Least usual second difference, metres, where a path has been smoothed."""


def exchanged(imported: Array, tracked: Array) -> float | None:
    """Return the share of the distance that is left where left and right are exchanged; None where too little is known.

    Args:
        imported: joints of the left limb, then those of the right one, (2, N, 3), metres.
        tracked: the same.
    """
    apart, crossed = (np.linalg.norm(i - tracked, axis=-1) for i in (imported, imported[::-1]))
    known = np.isfinite(apart) & np.isfinite(crossed)
    return float(crossed[known].sum() / apart[known].sum()) if known.sum() > 2 else None


def is_exchanged(imported: Array, tracked: Array) -> bool:
    """Return whether left and right limbs are exchanged; arguments of `exchanged`."""
    share = exchanged(imported, tracked)
    return share is not None and share < _CLEARER


def jumps(joints_world: Array) -> Mask:
    """Return whether each point jumps on each frame, (F, N), by the second differences of its path.

    Args:
        joints_world: (F, N, 3), metres.
    """
    second = np.full(joints_world.shape[:2], np.nan)
    second[1:-1] = np.linalg.norm(joints_world[2:] - 2 * joints_world[1:-1] + joints_world[:-2], axis=-1)
    usual = np.array(
        [np.median(column[np.isfinite(column)]) if np.isfinite(column).any() else 0 for column in second.T]
    )
    out = np.nan_to_num(second) > _JUMP * np.maximum(usual, _LEAST_M)
    out[:-1] |= out[1:]  # the frame before and after a jump differ as much; the middle one is the largest
    return np.asarray(out)


def outside(part: str, views: Sequence[str]) -> str:
    """Return the sentence on a part that lies outside the person in some views."""
    return f"{display_name(part)} outside the person in {' and '.join(views)}"
