"""Poses that somebody may have on neighbouring frames, and the cheapest way through them.

What is found on one frame is nearly where they are on the next: each pose that seems good on a frame is carried to the
frames beside it and refined there, forwards and backwards, so that what a search has found anywhere is tried everywhere
(as C. Barnes et al. 2009, ACM Trans. Graphics 28(3):24, spread good matches over an image). Which poses are taken is
chosen over all frames at once (A. Viterbi 1967, IEEE Trans. Inf. Theory 13:260): what single frames leave open, the
motion tells.
"""

from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from tracker.appearance.part_colors import Colors, PartColors
from tracker.body.model import BodyModel
from tracker.compute.threads import N_HELPERS, dealt_out
from tracker.fitting.contour_residuals import MIN_DECREASE, ContourResiduals
from tracker.fitting.gauss_newton import ResidualBlock
from tracker.fitting.gauss_newton_compiled import solve_compiled
from tracker.geometry.arrays import Array
from tracker.tracking.chamfer.limb_recovery import APART_M, LEAST_GAIN
from tracker.tracking.chamfer.settings import TrackSettings, prior_blocks

ROUNDS = 2
"""How often poses are carried forwards through all frames and back again."""
_MOST = 12
"""Poses that are kept on a frame, at most."""
_SAME_M, _ALIKE_M = 0.01, 0.05
"""Poses of which no point differs by more are the same; of new ones that are as near to each other the cheaper is kept,
metres."""
_BENT_M = 0.05
"""How far a point is from where it would have gone on straight from the two frames before, metres (one standard
deviation): half of it is what poses are off."""
_MOST_BENT = 20.0
"""What a point that turns at once can cost at most, nats: a foot meets the floor, a reference is lost."""
_ITERATIONS, _TOLERANCE = 15, 1e-3


class Sight:
    """What one frame shows of one person: the cost of their poses, and its refinement."""

    def __init__(
        self, model: BodyModel, match: ContourResiduals, colors: Colors, known: PartColors | None,
        apart: Sequence[ResidualBlock], settings: TrackSettings, free: NDArray[np.bool_] | None,
    ) -> None:  # fmt: skip
        """Prepare it.

        Args:
            model: the body.
            match: the contours and edges of the frame.
            colors: its colours.
            known: the colours of the parts; None where nobody has shown them.
            apart: what keeps bodies apart, if anything.
            settings: of the tracker.
            free: the degrees of freedom that may move, (n_dofs,); None: all.
        """
        self._model, self._settings, self._free, self._apart = model, settings, free, list(apart)
        self._matches = [match, *(match.clone_for_thread() for _ in range(N_HELPERS - 1))]
        self._colors, self._known = colors, known

    def costs(self, poses: Array) -> Array:
        """What poses, (n, n_values), cost, (n,), nats."""
        costs = self._matches[0].costs(poses)
        if self._settings.recover is not None and self._known is not None:
            costs = costs - self._settings.recover.colors * self._colors.nats(poses, self._known)
        return costs + np.array([self._held(v) for v in poses])

    def refined(self, poses: Sequence[Array]) -> Array:
        """Each of several poses, (n_values,), drawn to what the frame shows, as if it had been expected there."""
        model, settings = self._model, self._settings
        sigma = np.where(model.dof_is_length, settings.trust_m, settings.trust_rad)

        def refine(match: ContourResiduals, pose: Array) -> Array:
            blocks = [match, *prior_blocks(model, pose, sigma), *self._apart]
            return solve_compiled(model, pose, blocks, self._free, _ITERATIONS, _TOLERANCE, gain=MIN_DECREASE).pose

        return np.array(dealt_out(refine, self._matches, poses))

    def _held(self, values: Array) -> float:
        """What a pose costs besides the image."""
        model, kinematics = self._model, self._model.kinematics(values)
        blocks = [*prior_blocks(model, values, np.ones(model.n_dofs)), *self._apart]
        return sum(b.linearize(model, values, kinematics).cost for b in blocks)


class Candidates:
    """Poses that somebody may have on one frame, (n_values,) each: those that were found, then others."""

    def __init__(self, model: BodyModel, found: Sequence[Array], others: Sequence[Array] = ()) -> None:
        """Begin with the poses that were found, which stay, and others that are taken in at first sight."""
        self._model, self._n_found, self._others = model, len(found), list(others)
        self.poses = list(found)
        """The poses, (n_values,) each."""
        self.points = [model.points_world(v) for v in found]
        """Their points in the world, (n_points, 3) each, metres."""
        self.costs: list[float] = []
        """What each costs, nats."""

    def score(self, sight: Sight) -> None:
        """Ask what the poses cost that were there at the beginning."""
        self.costs = sight.costs(np.array(self.poses)).tolist()
        if self._others:
            self.take(np.array(self._others), sight)

    def take(self, poses: Array, sight: Sight) -> None:
        """Take in more poses, (n, n_values), but for those that are there already; the dearest go."""
        for values, cost in zip(poses, sight.costs(poses).tolist(), strict=True):
            points = self._model.points_world(values)
            far = [float(np.linalg.norm(points - p, axis=1).max()) for p in self.points]
            if min(far[: self._n_found]) < _SAME_M:
                continue
            alike = [i for i in range(self._n_found, len(far)) if far[i] < _ALIKE_M]
            if any(self.costs[i] <= cost for i in alike):
                continue
            self._keep([i for i in range(len(far)) if i not in alike])
            self.poses.append(values)
            self.points.append(points)
            self.costs.append(cost)
        order = np.argsort(self.costs[self._n_found :], kind="stable")[: max(0, _MOST - self._n_found)]
        self._keep([*range(self._n_found), *(self._n_found + order).tolist()])

    def rivals(self, taken: int) -> list[Array]:
        """The poses that are elsewhere and cost hardly more than one of an index, (n_values,) each, cheapest first."""
        out = [taken]
        for i in np.argsort(self.costs, kind="stable").tolist():
            apart = min(np.linalg.norm(self.points[i] - self.points[k], axis=1).max() for k in out)
            if self.costs[i] < self.costs[taken] + LEAST_GAIN and apart > APART_M:
                out.append(i)
        return [self.poses[i] for i in out[1:]]

    def _keep(self, which: Sequence[int]) -> None:
        self.poses = [self.poses[i] for i in which]
        self.points = [self.points[i] for i in which]
        self.costs = [self.costs[i] for i in which]


def carry(frames: Sequence[Candidates], sight: Callable[[int], Sight], ends: Sequence[Array | None]) -> Iterator[int]:
    """Carry poses from frame to frame, forwards and backwards, and refine them there.

    Args:
        frames: the poses of each frame; what is found is added to them.
        sight: what the frame of an index shows.
        ends: the poses before the first frame and after the last, (n_values,) each; None where there is none.

    Yields:
        The index of each frame that was come to: all of them 2 * `ROUNDS` times.
    """
    n = len(frames)
    for way, end in [(range(n), ends[0]), (range(n - 1, -1, -1), ends[1])] * ROUNDS:
        before = [] if end is None else [end]
        for i in way:
            here = sight(i)
            if not frames[i].costs:
                frames[i].score(here)
            if before:
                frames[i].take(here.refined(before), here)
            before = list(frames[i].poses)
            yield i


def cheapest_way(
    points: Sequence[Array], costs: Sequence[Array], before: Sequence[Array], after: Sequence[Array]
) -> list[int]:
    """Which of several poses is taken on each frame: those that cost least, and whose points move most evenly, in all.

    Args:
        points: of each frame the points of the poses to choose from, (n_poses, n_points, 3) each, metres.
        costs: what they cost, (n_poses,) each, nats.
        before: the points on the one or two frames before the first, (n_points, 3) each; none where there is none.
        after: on those after the last, likewise.

    Returns:
        The index of the pose of each frame; 0 throughout unless others are cheaper by far.
    """
    known = [[p[None] for p in some] for some in (before, after)]
    points = [*known[0], *points, *known[1]]
    costs = [*(np.zeros(1) for _ in before), *costs, *(np.zeros(1) for _ in after)]
    if len(points) < 3:  # no motion to speak of
        cheapest = [int(np.argmin(c)) for c in costs]
        gain = sum(float(c[0] - c.min()) for c in costs)
        return (cheapest if gain >= LEAST_GAIN else [0] * len(costs))[len(before) : len(costs) - len(after)]
    # Of each pair of poses on two frames the cheapest way there, and where it came from.
    total, came = costs[0][:, None] + costs[1], []
    stay = float(total[0, 0])
    for (first, second), third, cost in zip(pairwise(points[:-1]), points[2:], costs[2:], strict=True):
        bends = _bent(first[:, None, None], second[:, None], third)
        stay += float(bends[0, 0, 0] + cost[0])
        ways = total[:, :, None] + bends
        came.append(ways.argmin(axis=0))
        total = ways.min(axis=0) + cost
    if stay - total.min() < LEAST_GAIN:
        way = [0] * len(points)
    else:
        way = [int(i) for i in np.unravel_index(int(total.argmin()), total.shape)][::-1]
        for step in reversed(came):
            way.append(int(step[way[-1], way[-2]]))
        way.reverse()
    return way[len(before) : len(points) - len(after)]


def _bent(first: Array, second: Array, third: Array) -> Array:
    """What it costs that points, (..., n_points, 3), do not go on straight over three frames, (...), nats."""
    nats = np.sum((first - 2 * second + third) ** 2, axis=-1) / (2 * _BENT_M**2)
    return np.asarray(np.sum(_MOST_BENT * nats / (_MOST_BENT + nats), axis=-1))
