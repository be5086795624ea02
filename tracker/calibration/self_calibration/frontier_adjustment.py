"""Least squares over cameras and frontier points, with lenses and borders of silhouettes that are not quite known.

A mask places the border of a person alike on all frames: its outermost pixels lie within the person, and a segmentation
leaves a rim or cuts one. Such an error does not average out, and cameras move with it. The distance of the borders from
the true ones is therefore unknown in each camera. Lenses that are unknown have some distortion, too. Frontier points
are precise enough to find part of both; the rest is in the covariance.
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from tracker.calibration.check.lens_priors import UNKNOWN_LENS, prior_sigmas
from tracker.calibration.check.reprojection import OUTLIER_SIGMAS, column_ends, inverse
from tracker.calibration.self_calibration.frontier_equations import BORDER, FrontierEquations, frontier_equations
from tracker.calibration.self_calibration.frontier_points import FrontierPoints, frontier_points
from tracker.calibration.self_calibration.joint_adjustment import AdjustedJoints, Gauge, UnknownLenses
from tracker.calibration.self_calibration.person_calibration import adjusted_to, undetermined
from tracker.calibration.self_calibration.seen_joints import SeenJoints
from tracker.errors import CalibrationError
from tracker.evidence.images.working_view import working_scale
from tracker.geometry.arrays import Array, Mask
from tracker.geometry.camera_columns import FOCAL, POSE, camera_difference, moved_camera
from tracker.geometry.cameras import Camera


def adjust_frontier(
    cameras: Sequence[Camera],
    hulls_px: Sequence[Sequence[Array]],
    gauge: Gauge,
    lenses: UnknownLenses | None,
    rounds: int,
) -> tuple[AdjustedJoints, SeenJoints]:
    """Fit cameras, borders and frontier points, which are found again in each round.

    Args:
        cameras: where to begin.
        hulls_px: by frame and camera, vertices of the convex hull, (n, 2), original pixels; none where unknown.
        gauge: what stays.
        lenses: knowledge of the lenses; None for lenses that are known.
        rounds: number of rounds.

    Returns:
        The adjustment and the points that it was made with. Its covariance heeds borders, lenses and errors that agree.

    Raises:
        CalibrationError: the silhouettes do not determine the cameras, or contradict each other.
    """
    points, borders_px = frontier_points(hulls_px, cameras), np.zeros(len(cameras))
    found, seen = _fitted(cameras, points, borders_px, gauge, lenses)
    for _ in range(rounds - 1):
        step, _ = _improved(found, frontier_equations(found, points), borders_px, lenses)
        *parts, more_px = np.split(step, column_ends(found.cameras)[1:])
        cameras = [moved_camera(c, part) for c, part in zip(found.cameras, parts, strict=True)]
        points, borders_px = frontier_points(hulls_px, cameras), borders_px + more_px
        found, seen = _fitted(cameras, points, borders_px, gauge, lenses)
    _require_agreement(found)
    _, covariance = _improved(found, frontier_equations(found, points), borders_px, lenses)
    return replace(found, fit=found.fit._replace(covariance=covariance)), seen


def _fitted(
    cameras: Sequence[Camera], points: FrontierPoints, borders_px: Array, gauge: Gauge, lenses: UnknownLenses | None
) -> tuple[AdjustedJoints, SeenJoints]:
    """Fit cameras to frontier points whose borders are moved outwards, and return these, too."""
    seen = replace(points.seen, px=points.seen.px + borders_px[:, None, None] * points.outward)
    return adjusted_to(cameras, seen, gauge, lenses, partial(undetermined, len(cameras))), seen


def _require_agreement(found: AdjustedJoints) -> None:
    """Refuse frontier points whose usual error would be a gross error of a border."""
    pixel = 1 / min(working_scale(c) for c in found.cameras)
    most_px = OUTLIER_SIGMAS * BORDER.common_px * pixel
    if found.sigma_px > most_px:
        raise CalibrationError(
            f"expected silhouettes of one whole person that agree to {most_px:.0f} px, found that they contradict each "
            f"other by {found.sigma_px:.0f} px; check that they show the whole person: one who stays in place becomes "
            "part of the background that footage alone shows, so let the person leave each place, or give masks"
        )


def _improved(
    found: AdjustedJoints, equations: FrontierEquations, borders_px: Array, lenses: UnknownLenses | None
) -> tuple[Array, Array]:
    """Return the step of cameras and borders to their best, (n + V,), and the covariance of the cameras, (n, n).

    The fit has balanced poses and focal lengths, which the step leaves out.
    """
    n, is_fitted = len(found.fit.covariance), np.diag(found.fit.covariance) > 0
    known = inverse(found.fit.covariance[np.ix_(is_fitted, is_fitted)])
    hessian = equations.hessians.sum(axis=0)
    # Poses have no prior. They show how much information the fit counts the weighted equations for.
    is_pose = np.zeros(n, dtype=bool)
    is_pose[np.add.outer(column_ends(found.cameras)[:-1], np.arange(n)[POSE]).ravel()] = True
    ratios = np.diag(known) / np.diag(hessian)[:n][is_fitted]
    counted = float(np.median(ratios[is_pose[is_fitted]]))
    precision, offsets = np.zeros_like(hessian), np.concatenate([_lens_offsets(found.cameras, lenses), borders_px])
    scales = np.array([working_scale(c) for c in found.cameras])
    sigmas = np.concatenate([_lens_sigmas(found.cameras, lenses), BORDER.common_px / scales])
    is_moved = sigmas > 0
    precision[is_moved, is_moved] = sigmas[is_moved] ** -2.0
    fitted = np.flatnonzero(is_fitted)
    precision[np.ix_(fitted, fitted)] = known - counted * hessian[np.ix_(fitted, fitted)]
    free: Mask = is_moved.copy()
    free[fitted] = True
    data, prior = equations.weighted(counted, free), precision[np.ix_(free, free)]
    data = data.weighted(1 / data.agreement(prior))
    covariance = inverse(data.hessians.sum(axis=0) + prior)
    pull = np.where(is_moved[free], data.gradients.sum(axis=0) + prior @ offsets[free], 0.0)
    step, whole = np.zeros(len(offsets)), np.zeros_like(hessian)
    step[free] = -covariance @ pull
    by_place = covariance @ data.by_place * _place_sigma_px(found)
    whole[np.ix_(free, free)] = covariance + by_place @ by_place.T
    return step, whole[:n, :n]


def _lens_sigmas(cameras: Sequence[Camera], lenses: UnknownLenses | None) -> Array:
    """Return what is known of lenses besides focal lengths, which the fit has, as standard deviations, (n,)."""
    sigmas = [prior_sigmas(c, UNKNOWN_LENS, pose=False, lens=lenses is not None) for c in cameras]
    for own in sigmas:
        own[FOCAL] = 0.0
    return np.concatenate(sigmas)


def _lens_offsets(cameras: Sequence[Camera], lenses: UnknownLenses | None) -> Array:
    """Return by how much cameras differ from what is known of their lenses, (n,)."""
    means = cameras if lenses is None else lenses.means
    return np.concatenate([camera_difference(mean, now) for mean, now in zip(means, cameras, strict=True)])


def _place_sigma_px(found: AdjustedJoints) -> float:
    """Return by how much borders lie elsewhere at one place of the body than at another, on all frames, px.

    The outermost pixel centres of a shape lie nothing (along a slope) to half a pixel (along a row) within its border.
    The hull of a border with noise lies nothing (at a tip) to a standard deviation (along a flat part) outside of it.
    Both are taken for uniform, with a variance of a twelfth.
    """
    pixel = 1 / min(working_scale(c) for c in found.cameras)
    return float(np.hypot(pixel / 2, found.sigma_px) / np.sqrt(12))
