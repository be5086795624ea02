"""Triangulate key points robustly: the pair of views with most agreement, refined on the views that agree with it.

For each point, each pair of views proposes a position. Its cost is a truncated square of the reprojection errors in all
views, weighted by confidence (MSAC, P. Torr and A. Zisserman 2000). Pairs that fit the pictures about equally well are
decided by the path of the point through the frames. Gauss-Newton then minimizes the reprojection error in the views
that agree.
"""

from collections.abc import Callable, Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np

from tracker.geometry.arrays import TINY, Array, IntArray, Mask
from tracker.geometry.cameras import NEAR_PLANE_M, Camera
from tracker.geometry.same_place import INLIER_M
from tracker.geometry.triangulation import MIN_ANGLE_RAD

_STEPS = 5
"""Number of Gauss-Newton steps; from the nearest point of two rays, the last ones move it by less than a micrometre."""
_ROBUST_ROUNDS = 3
"""Number of times that weights follow from errors; a fourth moves joints of `fast_arms` by 0.25 mm."""
_CAUCHY = 2.385
"""Scale of Cauchy's loss, standard deviations: 95% efficient if errors are Gaussian (P. Holland and R. Welsch 1977)."""


class Triangulated(NamedTuple):
    """Points in space with what their observations say of them."""

    points_world: Array
    """Positions, (n_frames, n_points, 3), metres; NaN where fewer than two views agree."""
    covariances: Array
    """Covariance of each, (n_frames, n_points, 3, 3), m^2; NaN where absent."""
    is_inlier: Mask
    """Whether a view agrees with the point, (n_frames, n_views, n_points)."""


class Views:
    """The cameras of observed points, for many points at once."""

    def __init__(self, cameras: Sequence[Camera]) -> None:
        """Collect the matrices of the cameras without their lenses."""
        self.cameras = tuple(cameras)
        self.P = np.stack([c.projection for c in cameras])
        self.centers = np.stack([c.center_world for c in cameras])
        self.focal_px = np.array([np.sqrt(abs(np.linalg.det(c.pinhole.K[:2, :2]))) for c in cameras])
        self.axes = np.stack([c.T_world_camera[:3, 2] for c in cameras])

    def undistorted(self, points_px: Array) -> Array:
        """Map original pixels, (n_frames, n_views, ..., 2), to undistorted ones; NaN beyond the lens."""
        out = np.full(points_px.shape, np.nan)
        for v, camera in enumerate(self.cameras):
            here = points_px[:, v].reshape(-1, 2)
            known = np.isfinite(here).all(axis=-1)
            mapped = np.full(here.shape, np.nan)
            mapped[known] = camera.undistort_points(here[known])
            mapped[known] = np.where(camera.within_lens(mapped[known])[:, None], mapped[known], np.nan)
            out[:, v] = mapped.reshape(out[:, v].shape)
        return out

    def rays(self, points_px: Array) -> Array:
        """Return unit directions in the world of undistorted pixels, (n, n_views, 2), as (n, n_views, 3)."""
        return np.stack([c.pinhole.rays(points_px[:, v]) for v, c in enumerate(self.cameras)], axis=1)

    def ray_distances(self, a: int, b: int, u: Array, v: Array) -> Array:
        """Return the distances between rays u of view a and v of view b, (..., 3), metres; NaN for parallel ones."""
        across = np.cross(u, v)
        length = np.linalg.norm(across, axis=-1)
        with np.errstate(divide="ignore", invalid="ignore"):
            apart = np.abs(across @ (self.centers[b] - self.centers[a])) / length
        return np.where(length > TINY, apart, np.nan)

    def project(self, points_world: Array) -> tuple[Array, Array]:
        """Project points, (..., 3), into all views: undistorted px, (..., n_views, 2), and depths, (..., n_views)."""
        h = np.einsum("vij,...j->...vi", self.P[:, :, :3], points_world) + self.P[:, :, 3]
        depths = h[..., 2]
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where(depths[..., None] > NEAR_PLANE_M, h[..., :2] / depths[..., None], np.nan), depths

    def errors(self, points_world: Array, points_px: Array) -> tuple[Array, Array]:
        """Return reprojection errors and the distances that they are at the points' depths.

        Args:
            points_world: (..., 3), metres.
            points_px: (..., n_views, 2), undistorted px.

        Returns:
            Errors, px, and distances, metres, (..., n_views); NaN where a point is absent or behind the camera.
        """
        projected, depths = self.project(points_world)
        px = np.linalg.norm(projected - points_px, axis=-1)
        return px, px * depths / self.focal_px


class Hypotheses(NamedTuple):
    """Positions that pairs of views propose."""

    points_world: Array
    """(n_pairs, n, 3), metres; NaN for a pair whose rays do not meet."""
    costs: Array
    """Truncated squares of the errors of all views, weighted by confidence, (n_pairs, n): from 0 to the sum of the
    confidences; infinite for a pair without a point."""


def pair_hypotheses(views: Views, points_px: Array, confidence: Array) -> Hypotheses:
    """Propose a position for each pair of views.

    Args:
        views: the cameras.
        points_px: undistorted px, (n, n_views, 2); NaN where absent.
        confidence: (n, n_views).
    """
    rays = views.rays(points_px)
    weights = confidence * np.isfinite(points_px).all(axis=-1)
    points, costs = [], []
    for a, b in combinations(range(len(views.cameras)), 2):  # one by one: the errors of all would fill the memory
        points.append(_between(views, rays, a, b))
        errors_m = views.errors(points[-1], points_px)[1]
        share = np.where(np.isfinite(errors_m), np.minimum((errors_m / INLIER_M) ** 2, 1.0), 1.0)
        agrees = (errors_m[:, [a, b]] <= INLIER_M).all(axis=-1)
        costs.append(np.where(agrees, (share * weights).sum(axis=-1), np.inf))
    return Hypotheses(np.stack(points), np.stack(costs))


def _between(views: Views, rays: Array, a: int, b: int) -> Array:
    """Return the point between two rays where they are nearest, (n, 3); NaN if they are parallel or meet behind."""
    u, v = rays[:, a], rays[:, b]
    baseline = views.centers[b] - views.centers[a]
    cosine = (u * v).sum(axis=-1)
    sine2 = 1 - cosine**2
    along_u, along_v = u @ baseline, v @ baseline
    with np.errstate(divide="ignore", invalid="ignore"):
        s = (along_u - cosine * along_v) / sine2
        t = (cosine * along_u - along_v) / sine2
    meets = (sine2 > np.sin(MIN_ANGLE_RAD) ** 2) & (s > NEAR_PLANE_M) & (t > NEAR_PLANE_M)
    # Each ray is weighted by the other's length: the farther view determines less.
    w = (t / np.where(meets, s + t, 1.0))[:, None]
    middle = w * (views.centers[a] + s[:, None] * u) + (1 - w) * (views.centers[b] + t[:, None] * v)
    return np.where(meets[:, None], middle, np.nan)


def triangulate_points(views: Views, points_px: Array, confidence: Array) -> Triangulated:
    """Triangulate the points of one person over the frames.

    Args:
        views: the cameras.
        points_px: undistorted px, (n_frames, n_views, n_points, 2); NaN where absent.
        confidence: (n_frames, n_views, n_points).
    """
    n_frames, n_views, n_points = confidence.shape
    flat_px = np.swapaxes(points_px, 1, 2).reshape(-1, n_views, 2)
    flat_confidence = np.swapaxes(confidence, 1, 2).reshape(-1, n_views)
    if n_views < 2 or not n_frames:
        nothing = np.full((n_frames, n_points, 3), np.nan)
        return Triangulated(nothing, np.full((*nothing.shape, 3), np.nan), np.zeros(confidence.shape, bool))
    found = pair_hypotheses(views, flat_px, flat_confidence)
    chosen = _smooth_choice(found, n_frames, n_points)
    rows = np.arange(len(chosen))
    start = found.points_world[chosen, rows]
    errors_m = views.errors(start, flat_px)[1]
    has_point = np.isfinite(found.costs[chosen, rows])
    is_inlier = (errors_m <= INLIER_M) & has_point[:, None] & (flat_confidence > 0)
    weights = np.where(is_inlier, flat_confidence, 0.0)
    points, information, sigma = _refine(views, start, flat_px, weights)
    points[~has_point] = np.nan
    inverse = np.linalg.inv(information + TINY * np.eye(3))
    covariances = np.where(has_point[:, None, None], sigma**2 * inverse, np.nan)
    return Triangulated(
        points.reshape(n_frames, n_points, 3),
        covariances.reshape(n_frames, n_points, 3, 3),
        np.swapaxes(is_inlier.reshape(n_frames, n_points, n_views), 1, 2),
    )


def _smooth_choice(found: Hypotheses, n_frames: int, n_points: int) -> IntArray:
    """Choose a pair for each point of each frame, (n_frames * n_points,), by its cost and the way from frame to frame.

    A way costs the truncated square of the distance from one frame to the next, in units of the usual distance in this
    run; Viterbi's algorithm finds the cheapest path.
    """
    n_pairs = len(found.costs)
    costs = found.costs.reshape(n_pairs, n_frames, n_points)
    points = found.points_world.reshape(n_pairs, n_frames, n_points, 3)
    first = np.argmin(costs, axis=0)
    alone = np.take_along_axis(points, first[None, :, :, None], axis=0)[0]
    alone[~np.isfinite(np.take_along_axis(costs, first[None], axis=0)[0])] = np.nan
    usual = np.maximum(usual_step(alone), INLIER_M / 2)
    # A pair without a point is taken only where no pair has one: it costs more than all frames together can.
    nowhere = 2.0 * n_frames * (1 + costs[np.isfinite(costs)].max(initial=0.0))
    finite = np.where(np.isfinite(costs), costs, nowhere)
    # A point that is nowhere may come from anywhere.
    return cheapest_path(finite, lambda k: np.nan_to_num(leaps(points, usual, k), nan=0.0)).ravel()


def leaps(points: Array, usual: Array, k: int) -> Array:
    """Return the costs of the ways of points from frame k - 1 to k, (to, from, point): 1 from twice the usual step on.

    Args:
        points: (n_states, n_frames, n_points, 3), metres; NaN where absent.
        usual: usual step of each point, (n_points,), metres.
        k: frame.
    """
    step = np.linalg.norm(points[:, None, k] - points[None, :, k - 1], axis=-1)
    return np.minimum((step / (2 * usual)) ** 2, 1.0)


def cheapest_path(costs: Array, ways: Callable[[int], Array]) -> IntArray:
    """Return the state of each frame on the cheapest path through all, (n_frames, ...), by Viterbi's algorithm.

    Args:
        costs: of the states, (n_states, n_frames, ...).
        ways: cost of each way from frame k - 1 to k, (to, from, ...).
    """
    total, back = costs[:, 0], [np.zeros(costs[:, 0].shape, dtype=np.int64)]
    for k in range(1, costs.shape[1]):
        sums = ways(k) + total[None]
        back.append(np.argmin(sums, axis=1))
        total = costs[:, k] + sums.min(axis=1)
    path = [np.asarray(np.argmin(total, axis=0))]
    for arrows in back[:0:-1]:
        path.append(np.take_along_axis(arrows, path[-1][None], axis=0)[0])
    return np.stack(path[::-1])


def usual_step(points: Array) -> Array:
    """Return the 90th percentile of the distance from one frame to the next of each point, (n_points,), metres."""
    steps = np.linalg.norm(np.diff(points, axis=0), axis=-1)
    out = np.zeros(points.shape[1])
    for i, column in enumerate(steps.T):
        known = column[np.isfinite(column)]
        out[i] = np.quantile(known, 0.9) if len(known) else 0.0
    return out


def _refine(views: Views, points: Array, points_px: Array, weights: Array) -> tuple[Array, Array, float]:
    """Minimize the reprojection errors, in units of the focal length, by a robust fit.

    Args:
        views: the cameras.
        points: where to start, (n, 3), metres.
        points_px: undistorted px, (n, n_views, 2).
        weights: confidence of the observations that count, (n, n_views); 0 for the others.

    Returns:
        Positions, (n, 3); J'WJ, (n, 3, 3), per m^2; and the standard deviation of an observation of confidence 1.
    """
    points, information = _gauss_newton(views, points, points_px, weights)
    sigma = _sigma(views, points, points_px, weights)
    robust = weights
    for _ in range(_ROBUST_ROUNDS):
        angles = views.errors(points, points_px)[0] / views.focal_px
        robust = weights / (1 + (np.nan_to_num(angles) / (_CAUCHY * max(sigma, TINY))) ** 2)
        points, information = _gauss_newton(views, points, points_px, robust)
    return points, information, sigma


def _gauss_newton(views: Views, points: Array, points_px: Array, weights: Array) -> tuple[Array, Array]:
    points = np.where(np.isfinite(points), points, 0.0)
    observed = np.where(np.isfinite(points_px), points_px, 0.0)
    scale = weights / views.focal_px**2
    information = np.zeros((len(points), 3, 3))
    for _ in range(_STEPS):
        h = np.einsum("vij,nj->nvi", views.P[:, :, :3], points) + views.P[:, :, 3]
        z = np.maximum(h[..., 2:], NEAR_PLANE_M)
        projected = h[..., :2] / z
        J = (views.P[None, :, :2, :3] - projected[..., None] * views.P[None, :, 2:, :3]) / z[..., None]
        information = np.einsum("nv,nvki,nvkj->nij", scale, J, J)
        gradient = np.einsum("nv,nvki,nvk->ni", scale, J, projected - observed)
        points = points - np.linalg.solve(information + TINY * np.eye(3), gradient[..., None])[..., 0]
    return points, information


def _sigma(views: Views, points: Array, points_px: Array, weights: Array) -> float:
    """Return the standard deviation of an observation in either direction, in focal lengths, by the median of the run.

    Distances of two Gaussian coordinates have the median 1.177 standard deviations.
    """
    apart = views.errors(points, points_px)[0] / views.focal_px
    counts = (weights > 0) & np.isfinite(apart)  # rays along one line end behind a camera
    angles = apart[counts]
    if not len(angles):
        return 0.0
    # Of two coordinates in n views, the point takes three: the residuals are smaller than the errors by that share.
    n_views = np.broadcast_to(np.maximum(counts.sum(axis=-1, keepdims=True), 2), counts.shape)[counts]
    return float(np.median(angles / np.sqrt(1 - 3 / (2 * n_views)))) / float(np.sqrt(2 * np.log(2)))
