"""Propagate candidate poses between neighbouring frames, and select the cheapest path through them.

Each good pose of a frame is propagated to the frames beside it and refined there, in both directions. A pose that a
search has found on one frame is so tried on all (C. Barnes et al. 2009, ACM Trans. Graphics 28(3):24, spread good
matches over an image in this way). The poses of all frames are then selected together (A. Viterbi 1967, IEEE Trans.
Inf. Theory 13:260). Motion resolves what single frames leave ambiguous.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from tracker.body.model import BodyModel, PosedBody
from tracker.fitting.hypothesis import CLEAR_NATS, SETTLED_M, Hypothesis, distance_m, distinct
from tracker.geometry.arrays import Array
from tracker.tracking.estimation.pose_score import PoseScorer

ROUNDS = 2
"""How often candidates are propagated forward through all frames and back."""
_MAX_CANDIDATES = 12
"""Candidates that are kept on a frame."""
_ACCELERATION_SIGMA_M = 0.05
"""Standard deviation of a point from its straight continuation over two frames, metres. Half of it is pose error."""
_MAX_ACCELERATION_COST = 20.0
"""Upper bound on the acceleration cost of one point, nats. It admits real impacts, such as a foot strike."""


class Candidates:
    """The candidate poses of one person on one frame: those that were found, then propagated ones."""

    def __init__(self, model: BodyModel, found: Sequence[Array], alternatives: Sequence[Array] = ()) -> None:
        """Begin with the poses that were found, (n_values,) each, which stay; alternatives join when costs are known.

        Args:
            model: the body.
            found: poses that the passes found.
            alternatives: poses that the passes found about as good.
        """
        self._model, self._n_found, self._alternatives = model, len(found), list(alternatives)
        self.hypotheses = [Hypothesis(PosedBody(model, pose), "pass") for pose in found]
        """The candidates, those that were found first; their costs are infinite before `score`."""

    @property
    def poses(self) -> list[Array]:
        """Their poses, (n_values,) each."""
        return [h.pose for h in self.hypotheses]

    @property
    def points(self) -> Array:
        """Their points in the world, (n, n_points, 3), metres."""
        return np.array([h.body.points_world for h in self.hypotheses])

    @property
    def costs(self) -> Array:
        """Their costs, (n,), nats."""
        return np.array([h.cost for h in self.hypotheses])

    def score(self, scorer: PoseScorer) -> None:
        """Compute the costs of the poses that were found, and add the alternatives."""
        self.hypotheses = self._scored(np.array(self.poses), scorer)
        if self._alternatives:
            self.add(np.array(self._alternatives), scorer)

    def add(self, poses: Array, scorer: PoseScorer) -> None:
        """Add poses, (n, n_values), that differ from those that were found, and discard the most expensive ones."""
        found, others = self.hypotheses[: self._n_found], self.hypotheses[self._n_found :]
        new = [h for h in self._scored(poses, scorer) if min(distance_m(h.body, f.body) for f in found) > SETTLED_M]
        self.hypotheses = [*found, *distinct([*others, *new], _MAX_CANDIDATES - self._n_found)]

    def alternatives(self, chosen: int) -> list[Array]:
        """Return the poses about as good as the one of an index and elsewhere, (n_values,) each, cheapest first."""
        best = self.hypotheses[chosen]
        close = [h for h in self.hypotheses if h is not best and h.cost < best.cost + CLEAR_NATS]
        return [h.pose for h in distinct([replace(best, cost=-np.inf), *close])[1:]]

    def _scored(self, poses: Array, scorer: PoseScorer) -> list[Hypothesis]:
        costs = scorer.costs_with_priors(self._model, poses).tolist()
        return [Hypothesis(PosedBody(self._model, p), "neighbour", c) for p, c in zip(poses, costs, strict=True)]


def propagate_candidates(
    model: BodyModel, frames: Sequence[Candidates], scorer_of: Callable[[int], PoseScorer],
    ends: Sequence[Array | None], sigma: Array,
) -> Iterator[int]:  # fmt: skip
    """Propagate poses from frame to frame, forward and backward, and refine them there.

    Args:
        model: the body.
        frames: the candidates of each frame; new ones are added to them.
        scorer_of: returns the scorer of the frame of an index.
        ends: the poses before the first frame and after the last, (n_values,) each; None where there is none.
        sigma: standard deviations of a prediction, (n_dofs,), rad or metres.

    Yields:
        The index of each frame that is visited: all of them 2 * `ROUNDS` times.
    """
    n = len(frames)
    for order, end in [(range(n), ends[0]), (range(n - 1, -1, -1), ends[1])] * ROUNDS:
        before = [] if end is None else [end]
        for i in order:
            here = scorer_of(i)
            if not np.isfinite(frames[i].costs).all():
                frames[i].score(here)
            if before:
                frames[i].add(here.refined(model, before, sigma), here)
            before = frames[i].poses
            yield i


def select_alternatives(frames: Sequence[Sequence[Hypothesis]], least_gain: float) -> list[int]:
    """Select a pose on each frame of a run: the first, or an alternative where those of a stretch are cheaper together.

    Each frame alone may leave open which one is right, while the frames of a stretch agree. A stretch begins and ends
    with frames that have alternatives; fewer than two frames in a row within it have none, since three frames tell an
    acceleration.

    Args:
        frames: the candidates of each frame, the present pose first.
        least_gain: by how much a stretch must be cheaper, nats.

    Returns:
        The index of the candidate of each frame.
    """
    selected, stretches = [0] * len(frames), list[range]()
    for i in (i for i, found in enumerate(frames) if len(found) > 1):
        near = stretches and i - stretches[-1].stop < 2
        first = stretches.pop().start if near else i
        stretches.append(range(first, i + 1))
    for own in stretches:
        around = range(max(0, own.start - 2), own.start), range(own.stop, min(own.stop + 2, len(frames)))
        before, after = ([frames[i][0].body.points_world for i in side] for side in around)
        points = [np.array([h.body.points_world for h in frames[i]]) for i in own]
        costs = [np.array([h.cost for h in frames[i]]) for i in own]
        selected[own.start : own.stop] = viterbi_path(points, costs, before, after, least_gain)
    return selected


def viterbi_path(
    points: Sequence[Array], costs: Sequence[Array], before: Sequence[Array], after: Sequence[Array],
    least_gain: float = CLEAR_NATS,
) -> list[int]:  # fmt: skip
    """Select a pose on each frame so that the sum of their costs and of the acceleration costs is least.

    Args:
        points: for each frame the points of its candidates, (n_poses, n_points, 3) each, metres.
        costs: their costs, (n_poses,) each, nats.
        before: the points on the one or two frames before the first, (n_points, 3) each; may be empty.
        after: the same on the frames after the last.
        least_gain: by how much a path must be cheaper, nats.

    Returns:
        The index of the pose of each frame; 0 throughout unless another path is cheaper by `least_gain`.
    """
    fixed = [[p[None] for p in some] for some in (before, after)]
    points = [*fixed[0], *points, *fixed[1]]
    costs = [*(np.zeros(1) for _ in before), *costs, *(np.zeros(1) for _ in after)]
    own = slice(len(before), len(points) - len(after))
    if len(points) < 3:  # too few for an acceleration
        cheapest = [int(np.argmin(c)) for c in costs]
        gain = sum(float(c[0] - c.min()) for c in costs)
        return (cheapest if gain >= least_gain else [0] * len(costs))[own]
    # total[i, k] is the least cost of a path that ends with poses i and k of two frames.
    total, backpointers = costs[0][:, None] + costs[1], []
    stay = float(total[0, 0])
    for (first, second), third, cost in zip(pairwise(points[:-1]), points[2:], costs[2:], strict=True):
        acceleration = _acceleration_cost(first[:, None, None], second[:, None], third)
        stay += float(acceleration[0, 0, 0] + cost[0])
        paths = total[:, :, None] + acceleration
        backpointers.append(paths.argmin(axis=0))
        total = paths.min(axis=0) + cost
    if stay - total.min() < least_gain:
        return [0] * len(points[own])
    path = [int(i) for i in np.unravel_index(int(total.argmin()), total.shape)][::-1]
    for step in reversed(backpointers):
        path.append(int(step[path[-1], path[-2]]))
    return path[::-1][own]


def _acceleration_cost(first: Array, second: Array, third: Array) -> Array:
    """Return the cost of points, (..., n_points, 3), that leave a straight line over three frames, (...), nats."""
    nats = np.sum((first - 2 * second + third) ** 2, axis=-1) / (2 * _ACCELERATION_SIGMA_M**2)
    return np.asarray(np.sum(_MAX_ACCELERATION_COST * nats / (_MAX_ACCELERATION_COST + nats), axis=-1))
