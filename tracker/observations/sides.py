"""Find views in which a detector took left for right, by the agreement of the views and by the motion.

Arms and legs of a person are exchanged each on their own. For each frame, patterns of exchanged views are compared: the
cost of a pattern is that of the triangulation, plus a price for each exchanged view. The cheapest path through the
frames is taken (Viterbi), in which joints that leap cost.
"""

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from tracker.geometry.arrays import Array, IntArray, Mask
from tracker.observations.triangulation import INLIER_M, Views, pair_hypotheses, usual_step

_EXCHANGE = 0.5
"""Price of an exchanged view, in confidences of disagreeing points: half a point that disagrees everywhere. Without it,
patterns that fit as well as none would win by noise."""
_MAX_ALL = 4
"""Number of views up to which all patterns are compared; of more views, those in which up to two differ."""


def exchanged_sides(views: Views, points_px: Array, confidence: Array, pairs: Sequence[tuple[int, int]]) -> Mask:
    """Return in which views the left and right points of a group are exchanged, (n_frames, n_views).

    Args:
        views: the cameras.
        points_px: of one person, undistorted px, (n_frames, n_views, n_points, 2); NaN where absent.
        confidence: (n_frames, n_views, n_points).
        pairs: columns of the left and the right point of each pair of the group.
    """
    n_frames, n_views, _ = confidence.shape
    patterns = _patterns(n_views)
    columns = np.array(pairs, dtype=np.int64).reshape(-1, 2)
    if n_views < 2 or not n_frames or not columns.size:
        return np.zeros((n_frames, n_views), dtype=bool)
    costs, points = [], []
    for pattern in patterns:
        group = _exchange(columns, pattern)
        px, weights = _gather(points_px, group), _gather(confidence, group)
        n_points = px.shape[2]
        found = pair_hypotheses(
            views, np.swapaxes(px, 1, 2).reshape(-1, n_views, 2), np.swapaxes(weights, 1, 2).reshape(-1, n_views)
        )
        seen = np.swapaxes(weights, 1, 2).reshape(-1, n_views).sum(axis=1)
        best = np.argmin(found.costs, axis=0)
        rows = np.arange(len(best))
        cost = np.minimum(found.costs[best, rows], seen)
        at = np.where(np.isfinite(found.costs[best, rows])[:, None], found.points_world[best, rows], np.nan)
        costs.append(cost.reshape(n_frames, n_points).sum(axis=1) + _EXCHANGE * pattern.sum())
        points.append(at.reshape(n_frames, n_points, 3))
    chosen = _cheapest_path(np.stack(costs), np.stack(points))
    return patterns[chosen]


def _patterns(n_views: int) -> Mask:
    """Return patterns of exchanged views, (n, n_views), the one without exchanges first."""
    sizes = range(n_views + 1) if n_views <= _MAX_ALL else (0, 1, 2)
    some = [np.isin(np.arange(n_views), c) for size in sizes for c in combinations(range(n_views), size)]
    every = some if n_views <= _MAX_ALL else some + [~pattern for pattern in some]
    return np.array(every)


def _exchange(columns: IntArray, pattern: Mask) -> IntArray:
    """Return the columns of the left points, then of the right ones, in each view, (n_views, 2 n_pairs)."""
    straight, crossed = columns.T.ravel(), columns.T[::-1].ravel()
    return np.where(pattern[:, None], crossed, straight)


def _gather(values: Array, columns: IntArray) -> Array:
    """Return values (n_frames, n_views, n_points, ...) in other columns of each view, (n_views, n)."""
    return np.stack([values[:, v, c] for v, c in enumerate(columns)], axis=1)


def _cheapest_path(costs: Array, points: Array) -> IntArray:
    """Return the pattern of each frame, (n_frames,).

    Args:
        costs: (n_patterns, n_frames).
        points: (n_patterns, n_frames, n_points, 3), metres; NaN where absent.
    """
    usual = np.maximum(usual_step(points[0]), INLIER_M / 2)
    n_patterns, n_frames = costs.shape
    total, back = costs[:, 0], np.zeros((n_frames, n_patterns), dtype=np.int64)
    for k in range(1, n_frames):
        step = np.linalg.norm(points[:, None, k] - points[None, :, k - 1], axis=-1)
        leaps = np.nan_to_num(np.minimum((step / (2 * usual)) ** 2, 1.0), nan=1.0).sum(axis=-1)
        sums = leaps + total[None]
        back[k] = np.argmin(sums, axis=1)
        total = costs[:, k] + sums.min(axis=1)
    path = np.empty(n_frames, dtype=np.int64)
    path[-1] = np.argmin(total)
    for k in range(n_frames - 1, 0, -1):
        path[k - 1] = back[k, path[k]]
    return path


def with_sides_exchanged(values: Array, pairs: Sequence[tuple[int, int]], is_exchanged: Mask) -> Array:
    """Return values, (n_frames, n_views, n_points, ...), with pairs exchanged where (n_frames, n_views) are marked."""
    out = values.copy()
    for left, right in pairs:
        for a, b in ((left, right), (right, left)):
            out[:, :, a][is_exchanged] = values[:, :, b][is_exchanged]
    return out
