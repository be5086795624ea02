"""Notice that an estimate and its reference are not of the same recording, axes, units or origin."""

from collections.abc import Sequence

import numpy as np

from tracker.errors import Remedy
from tracker.evaluation.metrics import LOST_M, best_rigid, gather_joints
from tracker.formats.joint_maps import LIMB_JOINTS, JointMap
from tracker.formats.trc import MarkerTable, axes_matrix
from tracker.geometry import rigid
from tracker.geometry.arrays import Array
from tracker.geometry.ground_plane import floor_plane
from tracker.interchange.plausibility.readings import Reading, ReadPoints, read_beside

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
    estimated: MarkerTable, reference: MarkerTable, frames: Sequence[int], axes: str = "x,y,z", up: str = "z"
) -> tuple[str, Remedy] | None:
    """Say that a reference is not of the estimate's frames, or lies metres from it, and what would bring it near.

    Args:
        estimated: joints under the project's names.
        reference: the same.
        frames: the frames to compare.
        axes: the axes as which the reference was read (`axes_matrix`).
        up: world axis that points up.
    """
    names = tuple(j for j in LIMB_JOINTS if j in estimated.names and j in reference.names)
    estimate, truth = (gather_joints(t, names, frames) for t in (estimated, reference))
    both = np.isfinite(estimate + truth).all(axis=-1)
    if not both.any():
        return None
    apart = _median_m(estimate[both], truth[both])
    as_given = Reading(JointMap("the reference", {name: name for name in names}), axes)
    known = {name: estimate[:, i] for i, name in enumerate(names)}
    in_file = truth @ axes_matrix(axes)  # the inverse of a rotation is its transpose
    vertical, is_near = floor_plane(up, None).normal, apart <= APART_M
    read = read_beside(known, in_file, frames, vertical, estimated.rate, ignores_offsets=is_near)
    if is_near:
        return _lag_note(read, as_given)
    why, remedy = _explanation(read, as_given, estimate[both], truth[both])
    return f"the reference lies {apart:.2f} m from the poses (median over the joints){why}", remedy


def _lag_note(read: ReadPoints, own: Reading) -> tuple[str, Remedy] | None:
    lag = read.lag(own)
    if lag is None or not lag.frames:
        return None
    return f"the reference fits the poses of {lag} best", Remedy("check_reference_frames")


def _explanation(read: ReadPoints, own: Reading, estimate: Array, truth: Array) -> tuple[str, Remedy]:
    """Say which change of the reference, (n, 3), brings it within `LOST_M` of the estimate, (n, 3)."""
    best = read.likeliest(own, [own.joint_map], in_space=True)[0]
    distance_m = _median_m(estimate, best.scale * truth @ axes_matrix(own.axes) @ axes_matrix(best.axes).T)
    if distance_m < LOST_M and best.scale == own.scale:
        return "", Remedy("reference_axes", axes=best.axes, distance_m=distance_m)
    if best.scale != own.scale:
        size = f"{1 / best.scale:.4g} times as large" if best.scale < 1 else f"{best.scale:.4g} times smaller"
        return f": it is {size}", Remedy("reference_units")
    if len(truth) >= 3 and _median_m(rigid.apply(best_rigid(truth, estimate), truth), estimate) < LOST_M:
        return ": it is of the same motion in a world with another origin or direction", Remedy("align_reference")
    return "", Remedy("check_reference")


def _median_m(a: Array, b: Array) -> float:
    return float(np.median(np.linalg.norm(a - b, axis=-1)))
