"""Least squares over cameras and frontier points, with lenses and borders of silhouettes that are not quite known.

A mask places the border of a person alike on all frames: its outermost pixels lie within the person, and a segmentation
leaves a rim or cuts one. Such an error does not average out, and cameras move with it. The distance of the borders from
the true ones is therefore unknown in each camera. Lenses that are unknown have some distortion, too. Frontier points
are precise enough to find part of both; the rest is in the covariance.

Normal equations of frontier points by cameras, lenses and borders of silhouettes, and how far their errors agree.
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np

from tracker.calibration.check.lens_priors import UNKNOWN_LENS, prior_sigmas
from tracker.calibration.check.point_problem import PointProblem
from tracker.calibration.check.rig_adjustment import OUTLIER_SIGMAS, Prior, column_ends, inverse
from tracker.calibration.self_calibration.frontier_points import FrontierPoints, frontier_points
from tracker.calibration.self_calibration.joint_adjustment import AdjustedJoints, Gauge, UnknownLenses
from tracker.calibration.self_calibration.person_calibration import adjusted_to, undetermined
from tracker.calibration.self_calibration.seen_joints import SeenJoints
from tracker.errors import CalibrationError
from tracker.evidence.images.working_view import working_scale
from tracker.geometry.arrays import Array, Mask
from tracker.geometry.camera_derivatives import (
    FOCAL,
    POSE,
    ProjectionDerivatives,
    camera_difference,
    moved_camera,
    n_camera_parameters,
)
from tracker.geometry.cameras import Camera


class BorderErrors(NamedTuple):
    """Errors of the borders of silhouettes."""

    common_px: float = 1.0
    """Standard deviation of the distance of a border from the true one, working pixels: a mask rounds to pixels, and a
    segmentation that smooths moves its border by about one."""
    stretches: int = 20
    """Most stretches of frames that are left out in turn: variances of as many have errors of a third."""


BORDER = BorderErrors()


class FrontierEquations(NamedTuple):
    """Weighted normal equations by the corrections of all cameras and their borders, n + V; points are eliminated."""

    hessians: Array
    """Of each stretch of frames, (G, n + V, n + V)."""
    gradients: Array
    """Of each stretch of frames, (G, n + V)."""
    by_place: Array
    """Change of the gradient if a camera sees a point of the pairs one pixel farther out on all frames, (n + V, T)."""

    def weighted(self, weight: float, free: Mask | None = None) -> "FrontierEquations":
        """Return the equations of some unknowns, times a weight."""
        at = np.arange(self.by_place.shape[0]) if free is None else np.flatnonzero(free)
        parts = self.hessians[:, at[:, None], at], self.gradients[:, at], self.by_place[at]
        return FrontierEquations(*(weight * each for each in parts))

    def agreement(self, prior: Array) -> float:
        """Return the variance of the unknowns over that of errors that do not agree, at least 1, on average.

        All pairs of a camera touch its silhouette at about the same places, and a foot that stands has one error on
        many frames. Such errors agree within a stretch of frames. Unknowns therefore vary more than expected when
        stretches are left out in turn (block jackknife, Künsch 1989).

        Args:
            prior: precision of the unknowns before, (n, n).
        """
        whole = self.hessians.sum(axis=0) + prior
        expected = float(np.trace(inverse(whole) @ self.hessians.sum(axis=0)))
        moves = [inverse(whole - H) @ g for H, g in zip(self.hessians, self.gradients, strict=True)]
        found = sum(float(move @ whole @ move) for move in moves)
        return max(1.0, (1 - 1 / len(moves)) * found / expected)


class _BorderProblem(PointProblem):
    """Points on borders of silhouettes: cameras see all of them farther out than they are by one distance each."""

    def __init__(self, found: AdjustedJoints, outward: Array) -> None:
        """State the problem of an adjustment, by all corrections of each camera and then its border.

        Args:
            found: the adjustment.
            outward: direction out of the silhouette at each observed point, (N, 2).
        """
        free = tuple(np.full(n_camera_parameters(c) + 1, np.inf) for c in found.cameras)
        super().__init__(found.observed, Prior(found.cameras, free), len(found.fit.rig.own), found.fit.sigmas_px)
        self._outward = outward

    def by_unknowns(self, found: ProjectionDerivatives, at: slice, camera: int) -> Array:
        """See `ReprojectionProblem`."""
        return np.concatenate([found.by_camera, -self._outward[at, :, None]], axis=2)

    def reduced(self, found: AdjustedJoints, chosen: Mask) -> tuple[Array, Array]:
        """Return gradient, (n + V,), and Hessian of some points, (P,), which are eliminated; borders come last."""
        part = self.with_groups(chosen)
        part._outward = self._outward[chosen[self.observations.groups]]
        gradient, hessian = part.observed(found.fit.rig._replace(own=found.fit.rig.own[chosen])).reduced()
        borders = self.ends[1:] - 1
        order = np.concatenate([np.setdiff1d(np.arange(len(gradient)), borders), borders])
        return gradient[order], hessian[np.ix_(order, order)]


def frontier_equations(found: AdjustedJoints, points: FrontierPoints) -> FrontierEquations:
    """Linearize the errors of an adjustment and eliminate its points.

    Args:
        found: the adjustment of frontier points, whose borders may have been moved.
        points: the frontier points.
    """
    frames, joints = np.divmod(found.numbers, points.seen.n_joints)
    at = found.observed
    problem = _BorderProblem(found, points.outward[frames[at.groups], at.cameras, joints[at.groups]])
    n_frames = len(points.outward)
    stretches = frames * min(BORDER.stretches, n_frames) // n_frames
    parts = [problem.reduced(found, stretches == s) for s in range(min(BORDER.stretches, n_frames))]
    gradients, hessians = (np.array(own) for own in zip(*parts, strict=True))
    n, by_place = column_ends(found.cameras)[-1], list[Array]()
    for joint in np.unique(joints):
        hessian = problem.reduced(found, joints == joint)[1]
        by_place += [hessian[:, n + i] for i in np.unique(at.cameras[joints[at.groups] == joint])]
    return FrontierEquations(hessians, gradients, np.array(by_place).T)


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
