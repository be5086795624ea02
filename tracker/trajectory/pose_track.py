"""Smooth poses that were estimated one by one: the most likely path of a person by them and by how people move.

A pose is a measurement with the covariance of its estimate. A limb that is not trusted follows its motion before and
after. See `tracker.trajectory.solve`.
"""

from collections.abc import Generator
from dataclasses import dataclass

import numpy as np

from tracker.body.model import BodyModel
from tracker.fitting.gauss_newton import GaussianPrior
from tracker.geometry.arrays import Array, Mask
from tracker.motion.prediction import MAX_ORDER
from tracker.trajectory.motion_model import FLOOR_M2, FREEDOM
from tracker.trajectory.solve import PosedPath, solve_path

_LINEAR = 0.05
"""Largest standard deviation of a measurement, rad or metres. Its covariance is linearized at the tracked pose; a
rotation that the images do not show would otherwise take the pose out of the range where it holds."""


@dataclass(frozen=True, eq=False)
class PoseTrack:
    """Poses of one person over time, in the order of time."""

    model: BodyModel
    times_s: Array
    """Ascending, (T,), seconds."""
    poses: Array
    """(T, n_values)."""
    covariances: Array
    """Of each pose, (T, n_dofs, n_dofs), rad and metres."""
    fixed: Mask
    """Whether a pose is exact, (T,): a keyframe."""
    trusted: Mask
    """Whether a degree of freedom is measured, (T, n_dofs): not in a lost limb. All of a fixed pose are."""
    active_dofs: Mask | None = None
    """Degrees of freedom that may change, (n_dofs,); None: all."""


def smooth_poses(track: PoseTrack, freedom: float = FREEDOM) -> Generator[int, None, Array]:
    """Smooth poses within the joint limits; fixed poses are returned as they are.

    Frames of which nothing is trusted are interpolated where trusted ones lie on both sides; before the first and after
    the last trusted frame they stay as they are. So do all where too few are trusted to show any motion.

    Args:
        track: the poses.
        freedom: see `PosedPath.freedom`.

    Yields:
        The number of frames whose evidence was read so far.

    Returns:
        The smoothed poses, (T, n_values).
    """
    known, out = np.flatnonzero(track.trusted.any(axis=1) | track.fixed), np.array(track.poses)
    if len(known) > MAX_ORDER:
        used = slice(known[0], known[-1] + 1)

        path = PosedPath(
            track.model, track.times_s[used], track.poses[used], lambda t: [_measurement(track, t + used.start)],
            track.fixed[used], track.active_dofs, track.trusted[used], freedom,
        )  # fmt: skip
        out[used] = (yield from solve_path(path)).poses
    return out


def _measurement(track: PoseTrack, t: int) -> GaussianPrior:
    """Return what the estimate of a pose says about what of it is trusted."""
    variances, directions = np.linalg.eigh(track.covariances[t])
    covariance = directions * np.clip(variances, FLOOR_M2, _LINEAR**2) @ directions.T
    own = np.ix_(track.trusted[t], track.trusted[t])
    information = np.zeros_like(covariance)
    information[own] = np.linalg.inv(covariance[own])
    return GaussianPrior(track.poses[t], information)
