"""Find views in which a detector took left for right, by the agreement of the views and by the motion.

Arms and legs of a person are exchanged each on their own. For each frame, patterns of exchanged views are compared: the
cost of a pattern is that of the triangulation, plus a price for each exchanged view. The cheapest path through the
frames is taken (Viterbi), in which joints that leap cost.
"""

from collections.abc import Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np

from tracker.geometry.arrays import Array, IntArray, Mask
from tracker.geometry.robust_triangulation import Views, cheapest_path, leaps, pair_hypotheses, usual_step
from tracker.geometry.same_place import INLIER_M

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
    straight = _consensus(views, points_px, confidence, _exchange(columns, patterns[0]))
    open_frames = _with_surroundings(straight.disagrees)
    if not len(open_frames):
        return np.zeros((n_frames, n_views), dtype=bool)
    costs = np.full((len(patterns), n_frames), np.inf)
    points = np.full((len(patterns), n_frames, 2 * len(columns), 3), np.nan)
    costs[0], points[0] = straight.costs, straight.points_world
    for i, pattern in enumerate(patterns[1:], 1):
        found = _consensus(views, points_px[open_frames], confidence[open_frames], _exchange(columns, pattern))
        costs[i, open_frames] = found.costs + _EXCHANGE * pattern.sum()
        points[i, open_frames] = found.points_world
    usual = np.maximum(usual_step(points[0]), INLIER_M / 2)
    return patterns[cheapest_path(costs, lambda k: np.nan_to_num(leaps(points, usual, k), nan=1.0).sum(axis=-1))]


class _Consensus(NamedTuple):
    """The points of a group as the views agree on them best."""

    costs: Array
    """Cost of their triangulation, (n_frames,)."""
    points_world: Array
    """(n_frames, n_points, 3), metres; NaN where nothing agrees."""
    disagrees: Mask
    """Whether some view disagrees about some point, (n_frames,): otherwise none is exchanged."""


def _consensus(views: Views, points_px: Array, confidence: Array, columns: IntArray) -> _Consensus:
    """Triangulate points from the given columns of each view, (n_views, n_points)."""
    n_frames, n_views = confidence.shape[:2]
    px = np.swapaxes(_gather(points_px, columns), 1, 2).reshape(-1, n_views, 2)
    weights = np.swapaxes(_gather(confidence, columns), 1, 2).reshape(-1, n_views)
    found = pair_hypotheses(views, px, weights)
    best, rows = np.argmin(found.costs, axis=0), np.arange(len(px))
    cost = found.costs[best, rows]
    points = np.where(np.isfinite(cost)[:, None], found.points_world[best, rows], np.nan)
    errors_m = views.errors(points, px)[1]
    disagrees = ((weights > 0) & ~(errors_m <= INLIER_M)).any(axis=-1)
    return _Consensus(
        np.minimum(cost, weights.sum(axis=1)).reshape(n_frames, -1).sum(axis=1),
        points.reshape(n_frames, -1, 3),
        np.asarray(disagrees.reshape(n_frames, -1).any(axis=1)),
    )


def _with_surroundings(disagrees: Mask) -> IntArray:
    """Return the frames in which views disagree, and as many around each run of them: there, sides may lie together."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], disagrees, [False]]).astype(np.int8)))
    out = np.zeros(len(disagrees), dtype=bool)
    for start, stop in edges.reshape(-1, 2).tolist():
        out[max(0, 2 * start - stop) : 2 * stop - start] = True
    return np.flatnonzero(out)


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


def with_sides_exchanged(values: Array, pairs: Sequence[tuple[int, int]], is_exchanged: Mask) -> Array:
    """Return values, (n_frames, n_views, n_points, ...), with pairs exchanged where (n_frames, n_views) are marked."""
    out = values.copy()
    for left, right in pairs:
        for a, b in ((left, right), (right, left)):
            out[:, :, a][is_exchanged] = values[:, :, b][is_exchanged]
    return out
