"""Least squares over cameras and the joints that they see, with errors that agree from frame to frame."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from tracker.calibration.check.lens_priors import UNKNOWN_LENS
from tracker.calibration.check.point_problem import PointProblem, triangulate_all
from tracker.calibration.check.rig_adjustment import Observations, Prior, Rig, RigFit, fit_rig
from tracker.errors import CalibrationError
from tracker.geometry.arrays import Array, IntArray
from tracker.geometry.camera_derivatives import FOCAL, POSE, SHIFT, n_camera_parameters
from tracker.geometry.cameras import ROUNDING_PX2, Camera


class Gauge(NamedTuple):
    """Cameras that fix the world and its scale while all others are free."""

    held: int
    """Index of the camera that stays."""
    scale: int
    """Index of the camera whose distance from it stays, along the nearest of its own axes."""


class UnknownLenses(NamedTuple):
    """Lenses of which only the sizes of the pictures are known; a focal length is free, the rest as on average."""

    means: tuple[Camera, ...]
    """Cameras with the means of what is known."""
    alike: tuple[tuple[int, ...], ...] = ()
    """Cameras with lenses of one model: joints hardly tell the focal length of each."""


@dataclass(frozen=True, eq=False)
class AdjustedJoints:
    """Cameras and joints at which the reprojection error is least."""

    cameras: tuple[Camera, ...]
    points_world: Array
    """(P, 3), in the unit of the distance that was held; NaN for joints that two cameras do not determine."""
    numbers: IntArray
    """Rows of `points_world` that two cameras determine, ascending, (G,): the groups of `observed` and `fit`."""
    observed: Observations
    """Observations that took part."""
    fit: RigFit
    """Its covariance heeds that errors agree, and that of rounding at least."""
    share: float
    """By how much errors of a joint in a camera agree from frame to frame, at least 1."""

    @property
    def sigma_px(self) -> float:
        """Standard deviation of a joint along each axis of a picture, px; at least that of rounding to whole pixels."""
        return max(float(np.median(self.fit.sigmas_px)), ROUNDING_PX2**0.5)


def adjust_joints(
    cameras: Sequence[Camera],
    observations: Observations,
    n_joints: int,
    gauge: Gauge,
    lenses: UnknownLenses | None = None,
) -> AdjustedJoints | None:
    """Fit cameras and joints; None where fewer than two cameras see a joint from different sides.

    A detector places a joint beside the anatomical one, alike from frame to frame. Such errors do not average out: the
    covariance is multiplied by the share by which they agree, and the priors weigh as much against the observations.

    Args:
        cameras: where to begin.
        observations: their groups are the joints of all frames, `frame * n_joints + joint`.
        n_joints: number of joints of a frame.
        gauge: what stays.
        lenses: knowledge of the lenses; None for lenses that stay as they are.
    """
    points, determined = triangulate_all(cameras, observations)
    numbers = np.flatnonzero(determined)
    seen = observations.of_groups(determined)
    if not len(seen.px):
        return None
    problem = PointProblem(seen, _prior(cameras, gauge, lenses), len(numbers), np.ones(len(cameras)))
    fit, share = _fitted(problem, Rig(tuple(cameras), points[numbers]), numbers % n_joints)
    out = np.full(points.shape, np.nan)
    out[numbers] = fit.rig.own
    return AdjustedJoints(fit.rig.cameras, out, numbers, seen, fit, share)


def no_common_view() -> CalibrationError:
    """Return the error where no two cameras see a joint from different sides."""
    return CalibrationError(
        "expected joints that two cameras see from different sides, found none; film the person by cameras that stand "
        "at an angle to each other"
    )


def _prior(cameras: Sequence[Camera], gauge: Gauge, lenses: UnknownLenses | None) -> Prior:
    sigmas, sharing = [], {i: len(group) for group in (lenses.alike if lenses else ()) for i in group}
    for i, camera in enumerate(cameras):
        own = np.zeros(n_camera_parameters(camera))
        own[POSE] = 0.0 if i == gauge.held else np.inf
        if i == gauge.scale:
            baseline = camera.T_camera_world[:3, :3] @ (camera.center_world - cameras[gauge.held].center_world)
            own[SHIFT.start + int(np.abs(baseline).argmax())] = 0.0
        if lenses is not None:
            # Lenses of one model are one draw from what is known, not several.
            own[FOCAL] = UNKNOWN_LENS.focal * np.sqrt(sharing.get(i, 1))
        sigmas.append(own)
    means = tuple(
        replace(b, T_world_camera=c.T_world_camera)
        for b, c in zip(lenses.means if lenses else cameras, cameras, strict=True)
    )
    return Prior(means, tuple(sigmas), lenses.alike if lenses else ())


def _fitted(problem: PointProblem, rig: Rig, joints: IntArray) -> tuple[RigFit, float]:
    """Fit a rig, with priors and covariance that heed by how much errors agree; return it with that share."""
    fit = fit_rig(problem, rig)
    share = _agreement(fit, problem.observations, joints)
    if share > 1 and any(0 < s < np.inf for s in np.concatenate(problem.prior.sigmas)):
        sigmas = tuple(s / np.sqrt(share) for s in problem.prior.sigmas)
        fit = fit_rig(problem.with_prior(replace(problem.prior, sigmas=sigmas)), fit.rig)
    errors = np.nan_to_num(fit.errors_px) * fit.weights[:, None]
    exact = max(1.0, ROUNDING_PX2 / max(float(np.mean(errors**2)), np.finfo(float).tiny))
    return fit._replace(covariance=share * exact * fit.covariance), share


def _agreement(fit: RigFit, seen: Observations, joints: IntArray) -> float:
    """Return the variance of the sums of errors of each joint in each camera over that of errors that do not agree.

    Robust weights keep gross errors out. Errors that are alike on n frames count as one observation.
    """
    n_joints = int(joints.max()) + 1
    tracks = seen.cameras * n_joints + joints[seen.groups]
    errors = np.nan_to_num(fit.errors_px) * fit.weights[:, None]
    sums = np.stack([np.bincount(tracks, e) for e in errors.T])
    return max(1.0, float(np.sum(sums**2) / max(np.sum(errors**2), np.finfo(float).tiny)))
