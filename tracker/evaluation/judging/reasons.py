"""Reasons why imported joints are off, in words: exchanged limbs, parts outside the person, jumps."""

from collections.abc import Sequence

import numpy as np

from tracker.body.limbs import display_name
from tracker.geometry.arrays import Array, Mask

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
