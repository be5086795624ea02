"""Notice that an estimate and its reference are not of the same recording, axes, units or origin."""

from collections.abc import Iterator, Sequence
from itertools import permutations, product

import numpy as np

from tracker.errors import Remedy
from tracker.evaluation.metrics import LOST_M, best_rigid, gather_joints
from tracker.formats.file_axes import axes_matrix
from tracker.formats.joint_maps import LIMB_JOINTS
from tracker.formats.trc import MarkerTable
from tracker.geometry import rigid
from tracker.geometry.arrays import Array

APART_M = 1.0
"""Median distance above which two motions are not estimates of one."""


def length_note(n_session: int, n_reference: int | None) -> str | None:
    """Say that a session and its reference differ in length; `n_reference` is None where the length is unknown."""
    if n_reference is None or n_reference == n_session:
        return None
    return (
        f"the session has {n_session} frames and the reference {n_reference}: check that it is of this recording and "
        "begins at the same instant"
    )


def distance_note(
    estimated: MarkerTable, reference: MarkerTable, frames: Sequence[int], axes: str = "x,y,z"
) -> tuple[str, Remedy] | None:
    """Say that a reference lies metres from the estimate, and what would bring it near.

    Args:
        estimated: joints under the project's names.
        reference: the same.
        frames: the frames to compare.
        axes: the axes as which the reference was read (`axes_matrix`).
    """
    joints = [j for j in LIMB_JOINTS if j in estimated.names and j in reference.names]
    estimate, truth = (gather_joints(t, joints, frames).reshape(-1, 3) for t in (estimated, reference))
    both = np.isfinite(estimate + truth).all(axis=-1)
    estimate, truth = estimate[both], truth[both]
    if not len(truth) or (apart := _median_m(estimate, truth)) <= APART_M:
        return None
    why, remedy = _explanation(estimate, truth, axes)
    return f"the reference lies {apart:.2f} m from the poses (median over the joints){why}", remedy


def _explanation(estimate: Array, truth: Array, axes: str) -> tuple[str, Remedy]:
    """Say which change of the reference, (n, 3), brings it within `LOST_M` of the estimate, (n, 3)."""
    file_axes = truth @ axes_matrix(axes)  # the inverse of a rotation is its transpose
    found, words = min((_median_m(estimate, file_axes @ axes_matrix(w).T), w) for w in _axes())
    if found < LOST_M:
        return "", Remedy("reference_axes", axes=words, distance_m=found)
    ratio = _spread_m(truth) / max(_spread_m(estimate), 1e-9)
    for factor, name in ((1000.0, "1000 times as large"), (0.001, "1000 times smaller")):
        if 0.5 < ratio / factor < 2:
            return f": it is {name}", Remedy("reference_units")
    if len(truth) >= 3 and _median_m(rigid.apply(best_rigid(truth, estimate), truth), estimate) < LOST_M:
        return ": it is of the same motion in a world with another origin or direction", Remedy("align_reference")
    return "", Remedy("check_reference")


def _axes() -> Iterator[str]:
    """Yield the 24 rotations that map axes to axes, as words such as `x,-z,y`."""
    for order, signs in product(permutations("xyz"), product(("", "-"), repeat=3)):
        words = ",".join(f"{sign}{axis}" for sign, axis in zip(signs, order, strict=True))
        if np.linalg.det(axes_matrix(words)) > 0:
            yield words


def _median_m(a: Array, b: Array) -> float:
    return float(np.median(np.linalg.norm(a - b, axis=-1)))


def _spread_m(points: Array) -> float:
    """Return the median distance of points from their median, metres."""
    return float(np.median(np.linalg.norm(points - np.median(points, axis=0), axis=-1)))
