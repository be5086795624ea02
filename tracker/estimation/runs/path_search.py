"""Search the likeliest path of a person through hypotheses of all frames.

In each round the likeliest hypotheses of a frame propose poses on its neighbours, forward and backward, as several
hypotheses are tracked (D. B. Reid 1979, IEEE Trans. Autom. Control 24:843). Limbs of hypotheses are combined, and limbs
that the colours of the run find elsewhere are searched. The rounds end where no point of the path moves any more.

A hypothesis proposes others, or is dropped, by the cost of the best path through it. By the cost of its frame alone the
right pose is often not among the best.

Poses that a person may have on a frame, by poses that are known: limbs exchanged, facing the other way, combined.
"""

from collections.abc import Iterator, Sequence

import numpy as np

from tracker.body.limbs import Limb, limbs
from tracker.body.model import BodyModel, PosedBody
from tracker.body.motion.pose_steps import nearest_equivalent
from tracker.estimation.appearance.part_colors import PartColors
from tracker.estimation.appearance.region_model import elsewhere_nats, worst_parts
from tracker.estimation.by_frame.limb_recovery import search_limbs, with_limb
from tracker.estimation.fitting.hypothesis import BEAM_NATS, BEAM_WIDTH, CLEAR_NATS, limbs_elsewhere
from tracker.estimation.fitting.limb_exchange import exchanged, paired_limbs, turned_round
from tracker.estimation.runs.frame_hypotheses import FrameHypotheses, Proposal
from tracker.estimation.trajectory.hypotheses import DISTINCT_M, HypothesisSet, Paths, motion_nats
from tracker.estimation.trajectory.motion_model import acceleration, motion_points
from tracker.geometry.arrays import Array, IntArray

_ROUNDS = 3
"""Largest number of rounds. On twelve recordings, nine of simulated people, the path stays after one to three of
eight."""
_KEPT = 14
"""Hypotheses that are kept on a frame, those on the likeliest paths. With twice as many, and twice `BEAM_WIDTH`
proposing poses on the neighbouring frame, the mean errors of six recordings change by at most 0.5 mm, and no frame more
is off."""


class PathSearch:
    """The hypotheses of one person on all frames, and the likeliest path through them."""

    def __init__(self, frames: Sequence[FrameHypotheses], times_s: Array) -> None:
        """Begin with the hypotheses that the frames have; each has one or more.

        Args:
            frames: in the order of time.
            times_s: of the frames, (T,), seconds.
        """
        self.frames, self.model = frames, frames[0].model
        self.paths = Paths(acceleration(times_s), motion_points(self.model).groups)
        """How the points move along the path."""
        self._likely = [1] * len(frames)  # those that propose combinations
        self._searched: dict[int, Array] = {}  # points of the pose around which limbs were searched, by frame
        self._part_colors: PartColors | None = None
        self.poses = self._likeliest()
        """The poses on the likeliest path, (T, n_values)."""

    @property
    def sets(self) -> list[HypothesisSet]:
        """The hypotheses of each frame that paths go through."""
        return [f.on_path for f in self.frames]

    @property
    def searched(self) -> frozenset[int]:
        """Indices of the frames on which limbs were searched."""
        return frozenset(self._searched)

    def rounds(self) -> Iterator[int]:
        """Search until the path stays. Yields the index of each frame that was visited."""
        n = len(self.frames)
        for _ in range(_ROUNDS):
            before = self._points()
            for order in (range(n), range(n - 1, -1, -1)):
                yield from self._swept(order)
                self.poses = self._likeliest()
            for t in self._free():
                self._combine(t)
            for t, lost in self._doubted():
                self._search(t, lost)
                yield t
            self.poses = self._likeliest()
            if np.linalg.norm(self._points() - before, axis=-1).max() < DISTINCT_M:
                return

    def _points(self) -> Array:
        return np.array([self.model.points_world(pose) for pose in self.poses])

    def _free(self) -> list[int]:
        return [t for t, f in enumerate(self.frames) if f.anchor is None]

    def _likeliest(self) -> Array:
        """Return the poses on the likeliest path, and drop the hypotheses on the least likely ones."""
        path, costs = self.paths.likeliest(self.sets)
        poses = np.array([s.poses[i] for s, i in zip(self.sets, path, strict=True)])
        for t in self._free():
            own = costs[t]
            self.frames[t].keep(np.argsort(own, kind="stable")[:_KEPT])
            self._likely[t] = int(np.count_nonzero(own < own.min() + BEAM_NATS))
        return poses

    def _swept(self, order: Sequence[int]) -> Iterator[int]:
        """Propose poses from each frame on the next one of an order; yield the indices of the frames."""
        total, before, last = np.zeros(0), list[HypothesisSet](), list[int]()
        for t in order:
            frame = self.frames[t]
            if before and frame.anchor is None:
                frame.propose([*self._continued(total, before)])
            here = frame.on_path
            total = self._added(total, [*before, here], [*last, t])
            before, last = [*before[-1:], here], [*last[-1:], t]
            yield t

    def _continued(self, total: Array, before: Sequence[HypothesisSet]) -> Iterator[Proposal]:
        """Yield poses that go on from the likeliest hypotheses of the last frame.

        Args:
            total: least cost of the paths to the hypotheses of the last frame, (K,), or of the last two, (J, K), nats.
            before: hypotheses of the last one or two frames.
        """
        costs = total if total.ndim == 1 else total.min(axis=0)
        likely = np.flatnonzero(costs < costs.min() + BEAM_NATS)
        for k in likely[np.argsort(costs[likely], kind="stable")][:BEAM_WIDTH]:
            earlier = None if len(before) < 2 else before[0].poses[int(total[:, k].argmin())]
            yield from continued(self.model, earlier, before[-1].poses[k])

    def _added(self, total: Array, sets: Sequence[HypothesisSet], at: Sequence[int]) -> Array:
        """Return the least cost of the paths to the hypotheses of the last two frames, with those of a new one."""
        own = sets[-1].costs()
        if len(sets) < 3:
            return own if len(sets) == 1 else np.asarray(total[:, None] + own)
        motion, coefficients = self.paths.motion, self.paths.coefficients[min(at)]
        assert motion is not None  # three frames show it
        forward = coefficients if at[0] < at[-1] else coefficients[::-1]
        nats = motion_nats(motion, forward, [s.places for s in sets])
        return np.asarray((total[:, :, None] + nats).min(axis=0) + own)

    def _combine(self, t: int) -> None:
        frame, n = self.frames[t], self._likely[t]
        others = [*frame.found.poses[:n], *(self.poses[k] for k in self._beside(t))]
        frame.propose([*combined(self.model, self.poses[t], others)])

    def _beside(self, t: int) -> list[int]:
        return [k for k in (t - 1, t + 1) if 0 <= k < len(self.frames)]

    def elsewhere(self, poses: Array) -> tuple[Array, IntArray, Array]:
        """Compare poses, (T, n_values), with the colours of the run.

        Returns:
            How much likelier each limb is elsewhere, (T, n_limbs), nats, the part that says so, (T, n_limbs), and the
            evidence for each part in each view, (T, V, P).
        """
        nats = np.array([f.region_nats(pose) for f, pose in zip(self.frames, poses, strict=True)])
        of_parts = elsewhere_nats(nats.sum(axis=1), [self.model])
        parts = worst_parts(of_parts, [self.model])
        return np.take_along_axis(of_parts, parts, axis=1), parts, nats

    def _doubted(self) -> Iterator[tuple[int, list[Limb]]]:
        """Yield the frames on which limbs are to be searched: once, and again where the pose is another one."""
        elsewhere, *_ = self.elsewhere(self.poses)
        for t in self._free():
            lost = _limbs_to_search(self.model, elsewhere[t])
            points, before = self.model.points_world(self.poses[t]), self._searched.get(t)
            is_new = before is None or np.linalg.norm(points - before, axis=1).max() >= DISTINCT_M
            if lost and is_new:
                self._searched[t] = points
                yield t, lost

    def _search(self, t: int, lost: Sequence[Limb]) -> None:
        """Search limbs of the pose of a frame by contours and colours."""
        frame = self.frames[t]
        if self._part_colors is None:
            self._part_colors = self.frames[0].part_colors(self.poses[0])
        scorer = frame.limb_scorer(self.poses[t], self._part_colors)
        start = scorer.fitted(self.model, self.poses[t])
        found = search_limbs(self.model, lost, start, [self.poses[k] for k in self._beside(t)], scorer)
        frame.add([Proposal(h.pose, "limbs") for h in found])


def _limbs_to_search(model: BodyModel, elsewhere: Array) -> list[Limb]:
    """Return the limbs of several parts that are clearly likelier elsewhere, (n_limbs,), nats, the likeliest first; see
    `region_model.elsewhere_nats`."""
    of_body = limbs(model)
    return [of_body[i] for i in np.argsort(-elsewhere) if elsewhere[i] > CLEAR_NATS and len(of_body[i].parts) > 1]


def other_sides(body: PosedBody) -> list[Proposal]:
    """Return the poses in which limbs of both sides are exchanged, and in which the person faces the other way."""
    pairs = [p for p in paired_limbs(limbs(body.model)) if len(p[0].parts) > 1]
    return [*(Proposal(exchanged(body, p), "exchange") for p in pairs), Proposal(turned_round(body), "turn")]


def continued(model: BodyModel, before: Array | None, here: Array) -> list[Proposal]:
    """Return a pose on the next frame: where it was, and moved on as from the frame before, (n_values,) each."""
    poses = [here]
    if before is not None:
        step = model.difference(here, nearest_equivalent(model, before, here, None))
        poses.append(model.move(here, step))
    return [Proposal(pose, "neighbour") for pose in poses]


def combined(model: BodyModel, here: Array, others: Sequence[Array]) -> Iterator[Proposal]:
    """Yield a pose with each limb of others that have it elsewhere, and those others, (n_values,) each."""
    body = PosedBody(model, here)
    for other in others:
        apart = limbs_elsewhere(body, PosedBody(model, other))
        for limb in (x for x in limbs(model) if x.name in apart):
            yield Proposal(with_limb(model, here, other, limb), "combination")
        if apart:
            yield Proposal(other, "neighbour")
