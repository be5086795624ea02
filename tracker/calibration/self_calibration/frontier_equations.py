"""Normal equations of frontier points by cameras, lenses and borders of silhouettes, and how far their errors agree."""

from typing import NamedTuple

import numpy as np

from tracker.calibration.check.point_problem import PointProblem
from tracker.calibration.check.reprojection import Prior, column_ends, inverse
from tracker.calibration.self_calibration.frontier_points import FrontierPoints
from tracker.calibration.self_calibration.joint_adjustment import AdjustedJoints
from tracker.geometry.arrays import Array, Mask
from tracker.geometry.camera_columns import ProjectedColumns, n_columns


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
        free = tuple(np.full(n_columns(c) + 1, np.inf) for c in found.cameras)
        super().__init__(found.observed, Prior(found.cameras, free), len(found.fit.rig.own), found.fit.sigmas_px)
        self._outward = outward

    def by_unknowns(self, found: ProjectedColumns, at: slice, camera: int) -> Array:
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
