"""Normal equations of frontier points by cameras, lenses and borders of silhouettes, and how far their errors agree."""

from typing import NamedTuple

import numpy as np

from tracker.calibration.check.reprojection import column_ends, inverse
from tracker.calibration.self_calibration.frontier_points import FrontierPoints
from tracker.calibration.self_calibration.joint_adjustment import AdjustedJoints
from tracker.geometry.arrays import Array, IntArray, Mask
from tracker.geometry.camera_columns import project_with_columns


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


def frontier_equations(found: AdjustedJoints, points: FrontierPoints) -> FrontierEquations:
    """Linearize the errors of an adjustment and eliminate its points.

    Args:
        found: the adjustment of frontier points, whose borders may have been moved.
        points: the frontier points.
    """
    ends, n_frames = column_ends(found.cameras), len(points.outward)
    size, n_stretches = ends[-1] + len(found.cameras), min(BORDER.stretches, n_frames)
    out = FrontierEquations(
        np.zeros((n_stretches, size, size)), np.zeros((n_stretches, size)), np.zeros((size, 2 * points.seen.n_joints))
    )
    frames, joints = np.divmod(found.observed.groups, points.seen.n_joints)
    for joint in range(points.seen.n_joints):
        rows = [np.flatnonzero((joints == joint) & (found.observed.cameras == i)) for i in range(len(found.cameras))]
        pair = [i for i, at in enumerate(rows) if len(at)]
        if not pair:
            continue
        assert len(pair) == 2, "a frontier point belongs to two cameras"
        columns = [np.array([*range(ends[i], ends[i + 1]), ends[-1] + i]) for i in pair]
        stretches = frames[rows[pair[0]]] * n_stretches // n_frames
        blocks = _blocks(found, points, joint, [(i, rows[i]) for i in pair])
        for a, own in enumerate(columns):
            for b, other in enumerate(columns):
                H = blocks[a][b]
                np.add.at(out.hessians, (stretches[:, None, None], own[:, None], other), H[:, :-1, :-1])
                np.add.at(out.gradients, (stretches[:, None], own), H[:, :-1, -1])
                out.by_place[own, 2 * joint + b] += H[:, :-1, -2].sum(axis=0)
    return out


def _blocks(
    found: AdjustedJoints, points: FrontierPoints, joint: int, observed: list[tuple[int, IntArray]]
) -> list[list[Array]]:
    """Return products of the rows of two cameras, (F, m, m) each, in which the points are eliminated.

    Rows are derivatives by a camera and its border, and then the errors.
    """
    rows, by_points = list[Array](), list[Array]()
    scale = np.sqrt(found.fit.weights) / found.fit.sigmas_px[found.observed.cameras]
    for i, at in observed:
        groups = found.observed.groups[at]
        derived = project_with_columns(found.cameras[i], found.points_world[groups])
        outward = points.outward[groups // points.seen.n_joints, i, joint]
        row = np.concatenate([derived.by_camera, -outward[:, :, None], found.fit.errors_px[at, :, None]], axis=2)
        rows.append(np.nan_to_num(row * scale[at, None, None]))
        by_points.append(np.nan_to_num(derived.by_point * scale[at, None, None]))
    cross = [p.swapaxes(1, 2) @ row for p, row in zip(by_points, rows, strict=True)]
    variances = np.linalg.pinv(sum(p.swapaxes(1, 2) @ p for p in by_points), hermitian=True)
    out = [[-a.swapaxes(1, 2) @ variances @ b for b in cross] for a in cross]
    for i, row in enumerate(rows):
        out[i][i] = out[i][i] + row.swapaxes(1, 2) @ row
    return out
