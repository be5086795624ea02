"""Propagate candidate poses between neighbouring frames, and select the cheapest path through them.

Each good pose of a frame is propagated to the frames beside it and refined there, in both directions. A pose that a
search has found on one frame is so tried on all (C. Barnes et al. 2009, ACM Trans. Graphics 28(3):24, spread good
matches over an image in this way). The poses of all frames are then selected together (A. Viterbi 1967, IEEE Trans.
Inf. Theory 13:260). Motion resolves what single frames leave ambiguous.
"""

from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from tracker.appearance.part_colors import Colors, PartColors
from tracker.body.model import BodyModel
from tracker.compute.threads import N_HELPERS, map_chunked
from tracker.fitting.contour_residuals import MIN_DECREASE, ContourResiduals
from tracker.fitting.gauss_newton import ResidualBlock
from tracker.fitting.gauss_newton_compiled import solver_of
from tracker.geometry.arrays import Array
from tracker.tracking.estimation.limb_recovery import DISTINCT_POSE_M, MIN_COST_GAIN
from tracker.tracking.estimation.settings import MAX_ITERATIONS, TOLERANCE, EstimationSettings, prior_blocks

ROUNDS = 2
"""How often candidates are propagated forward through all frames and back."""
_MAX_CANDIDATES = 12
"""Candidates that are kept on a frame."""
_SAME_M = 0.01
"""Poses of which no point differs by more are the same, metres."""
_SIMILAR_M = 0.05
"""Of propagated poses this near to each other the cheaper is kept, metres."""
_ACCELERATION_SIGMA_M = 0.05
"""Standard deviation of a point from its straight continuation over two frames, metres. Half of it is pose error."""
_MAX_ACCELERATION_COST = 20.0
"""Upper bound on the acceleration cost of one point, nats. It admits real impacts, such as a foot strike."""


class FrameCost:
    """The cost of one person's poses on one frame, and their refinement: the unary term of the path."""

    def __init__(
        self, model: BodyModel, residuals: ContourResiduals, colors: Colors, part_colors: PartColors | None,
        penetration: Sequence[ResidualBlock], settings: EstimationSettings, active_dofs: NDArray[np.bool_] | None,
    ) -> None:  # fmt: skip
        """Prepare a clone of the residuals for each thread.

        Args:
            model: the body.
            residuals: of the frame.
            colors: of the frame.
            part_colors: colours of the parts; None where they are unknown.
            penetration: the term against penetration of other bodies, if any.
            settings: of the tracker.
            active_dofs: the degrees of freedom that may move, (n_dofs,); None: all.
        """
        self._model, self._settings, self._active_dofs = model, settings, active_dofs
        self._penetration = list(penetration)
        self._clones = [residuals, *(residuals.clone_for_thread() for _ in range(N_HELPERS - 1))]
        self._colors, self._part_colors = colors, part_colors

    def costs(self, poses: Array) -> Array:
        """Return the costs of poses, (n, n_values), (n,), nats."""
        costs = self._clones[0].costs(poses)
        if self._settings.recover is not None and self._part_colors is not None:
            costs = costs - self._settings.recover.colors * self._colors.nats(poses, self._part_colors)
        return costs + np.array([self._prior_cost(v) for v in poses])

    def refined(self, poses: Sequence[Array]) -> Array:
        """Return each of several poses, (n_values,), refined as if it were the prediction of the frame."""
        model, settings = self._model, self._settings
        sigma = np.where(model.dof_is_length, settings.trust_m, settings.trust_rad)

        def refine(residuals: ContourResiduals, pose: Array) -> Array:
            blocks = [residuals, *prior_blocks(model, pose, sigma), *self._penetration]
            fit = solver_of(model)(model, pose, blocks, self._active_dofs, MAX_ITERATIONS, TOLERANCE, MIN_DECREASE)
            return fit.pose

        return np.array(map_chunked(refine, self._clones, poses))

    def _prior_cost(self, pose: Array) -> float:
        """Return the cost of the prior terms at a pose, but for that of the prediction."""
        model, kinematics = self._model, self._model.kinematics(pose)
        blocks = [*prior_blocks(model, pose, np.ones(model.n_dofs)), *self._penetration]
        return sum(b.linearize(model, pose, kinematics).cost for b in blocks)


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
        self.poses = list(found)
        """The poses, (n_values,) each."""
        self.points = [model.points_world(v) for v in found]
        """Their points in the world, (n_points, 3) each, metres."""
        self.costs: list[float] = []
        """Their costs, nats; empty before `score`."""

    def score(self, frame_cost: FrameCost) -> None:
        """Compute the costs of the poses that were found, and add the alternatives."""
        self.costs = frame_cost.costs(np.array(self.poses)).tolist()
        if self._alternatives:
            self.add(np.array(self._alternatives), frame_cost)

    def add(self, poses: Array, frame_cost: FrameCost) -> None:
        """Add poses, (n, n_values), that differ from those that were found, and discard the most expensive ones."""
        for values, cost in zip(poses, frame_cost.costs(poses).tolist(), strict=True):
            points = self._model.points_world(values)
            far = [float(np.linalg.norm(points - p, axis=1).max()) for p in self.points]
            if min(far[: self._n_found]) < _SAME_M:
                continue
            similar = [i for i in range(self._n_found, len(far)) if far[i] < _SIMILAR_M]
            if any(self.costs[i] <= cost for i in similar):
                continue
            self._keep([i for i in range(len(far)) if i not in similar])
            self.poses.append(values)
            self.points.append(points)
            self.costs.append(cost)
        order = np.argsort(self.costs[self._n_found :], kind="stable")[: max(0, _MAX_CANDIDATES - self._n_found)]
        self._keep([*range(self._n_found), *(self._n_found + order).tolist()])

    def alternatives(self, chosen: int) -> list[Array]:
        """Return the poses about as good as the one of an index and elsewhere, (n_values,) each, cheapest first."""
        out = [chosen]
        for i in np.argsort(self.costs, kind="stable").tolist():
            distance = min(np.linalg.norm(self.points[i] - self.points[k], axis=1).max() for k in out)
            if self.costs[i] < self.costs[chosen] + MIN_COST_GAIN and distance > DISTINCT_POSE_M:
                out.append(i)
        return [self.poses[i] for i in out[1:]]

    def _keep(self, which: Sequence[int]) -> None:
        self.poses = [self.poses[i] for i in which]
        self.points = [self.points[i] for i in which]
        self.costs = [self.costs[i] for i in which]


def propagate_candidates(
    frames: Sequence[Candidates], frame_cost: Callable[[int], FrameCost], ends: Sequence[Array | None]
) -> Iterator[int]:
    """Propagate poses from frame to frame, forward and backward, and refine them there.

    Args:
        frames: the candidates of each frame; new ones are added to them.
        frame_cost: returns the cost of the frame of an index.
        ends: the poses before the first frame and after the last, (n_values,) each; None where there is none.

    Yields:
        The index of each frame that is visited: all of them 2 * `ROUNDS` times.
    """
    n = len(frames)
    for order, end in [(range(n), ends[0]), (range(n - 1, -1, -1), ends[1])] * ROUNDS:
        before = [] if end is None else [end]
        for i in order:
            here = frame_cost(i)
            if not frames[i].costs:
                frames[i].score(here)
            if before:
                frames[i].add(here.refined(before), here)
            before = list(frames[i].poses)
            yield i


def viterbi_path(
    points: Sequence[Array], costs: Sequence[Array], before: Sequence[Array], after: Sequence[Array]
) -> list[int]:
    """Select a pose on each frame so that the sum of their costs and of the acceleration costs is least.

    Args:
        points: for each frame the points of its candidates, (n_poses, n_points, 3) each, metres.
        costs: their costs, (n_poses,) each, nats.
        before: the points on the one or two frames before the first, (n_points, 3) each; may be empty.
        after: the same on the frames after the last.

    Returns:
        The index of the pose of each frame; 0 throughout unless another path is cheaper by `MIN_COST_GAIN`.
    """
    fixed = [[p[None] for p in some] for some in (before, after)]
    points = [*fixed[0], *points, *fixed[1]]
    costs = [*(np.zeros(1) for _ in before), *costs, *(np.zeros(1) for _ in after)]
    own = slice(len(before), len(points) - len(after))
    if len(points) < 3:  # too few for an acceleration
        cheapest = [int(np.argmin(c)) for c in costs]
        gain = sum(float(c[0] - c.min()) for c in costs)
        return (cheapest if gain >= MIN_COST_GAIN else [0] * len(costs))[own]
    # total[i, k] is the least cost of a path that ends with poses i and k of two frames.
    total, backpointers = costs[0][:, None] + costs[1], []
    stay = float(total[0, 0])
    for (first, second), third, cost in zip(pairwise(points[:-1]), points[2:], costs[2:], strict=True):
        acceleration = _acceleration_cost(first[:, None, None], second[:, None], third)
        stay += float(acceleration[0, 0, 0] + cost[0])
        paths = total[:, :, None] + acceleration
        backpointers.append(paths.argmin(axis=0))
        total = paths.min(axis=0) + cost
    if stay - total.min() < MIN_COST_GAIN:
        return [0] * len(points[own])
    path = [int(i) for i in np.unravel_index(int(total.argmin()), total.shape)][::-1]
    for step in reversed(backpointers):
        path.append(int(step[path[-1], path[-2]]))
    return path[::-1][own]


def _acceleration_cost(first: Array, second: Array, third: Array) -> Array:
    """Return the cost of points, (..., n_points, 3), that leave a straight line over three frames, (...), nats."""
    nats = np.sum((first - 2 * second + third) ** 2, axis=-1) / (2 * _ACCELERATION_SIGMA_M**2)
    return np.asarray(np.sum(_MAX_ACCELERATION_COST * nats / (_MAX_ACCELERATION_COST + nats), axis=-1))
