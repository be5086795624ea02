"""Results that every tracker returns: the poses of a frame, and the frames of a backward pass."""

from typing import NamedTuple

from tracker.body.searches import Search
from tracker.estimation.tracking.confidence import PoseQuality, Status
from tracker.geometry.arrays import Array


class AlternativePose(NamedTuple):
    """A pose of a person that fits the evidence about as well as the estimate."""

    values: Array
    """Pose, (n_values,)."""
    cost_px: float
    """`PoseEstimate.cost_px` with this pose, px; where two people may be swapped, with both swapped."""


class NormalMatrix(NamedTuple):
    """How well contours determine a pose: of their normal matrix, in radians and metres (KRH08 Sect. 5.4)."""

    rank: int
    n_dofs: int
    """Number of degrees of freedom that may move."""
    condition: float
    """Ratio of the largest to the smallest eigenvalue; infinite where one is zero."""


class PoseEstimate(NamedTuple):
    """The poses of all people on one frame. Tuples are indexed by person."""

    frame: int
    poses: tuple[Array, ...]
    """Poses, (n_values,) each."""
    cost_px: float
    """Cost of the poses against all edges near them, px of the footage."""
    view_costs_px: Array
    """Cost in each view, (V,), px of the footage; NaN for a view without edges."""
    evaluations: int
    """Number of poses that a search scored."""
    statuses: tuple[Status, ...]
    """How sure the tracker is of each person."""
    notes: tuple[str, ...]
    """Note on each person; empty where nothing was unusual."""
    part_costs_px: tuple[Array, ...]
    """Mean distance of the contour of each part to the edges, (n_parts,) each, px; NaN where hidden."""
    covariances: tuple[Array, ...]
    """Covariance of each pose, (n_dofs, n_dofs) each, rad and metres; zero for a keyframe."""
    qualities: tuple[PoseQuality | None, ...]
    """Features from which the statuses follow; None for a keyframe."""
    alternatives: tuple[tuple[AlternativePose, ...], ...]
    """Poses that are about as good, best first. A person who has any is at most doubtful."""
    method: str
    """Name of the tracking method, such as `chamfer`."""
    normal_matrices: tuple[NormalMatrix | None, ...] = ()
    """How well the contours determine each pose; None or empty where the method does not say."""
    traces: tuple[tuple[Search, ...] | None, ...] = ()
    """The searches on the frame in their order; None or empty where they are not known."""


class TrackedFrame(NamedTuple):
    """A tracked frame, without what only its display needs. Tuples are indexed by person."""

    frame: int
    poses: tuple[Array, ...]
    """Poses, (n_values,) each."""
    statuses: tuple[Status, ...]
    """How sure the tracker is of each person."""
    alternatives: tuple[tuple[Array, ...], ...] = ()
    """Poses that are about as good, (n_values,) each; empty where unknown for everybody."""

    @classmethod
    def of(cls, estimate: PoseEstimate) -> "TrackedFrame":
        """Return the part of an estimate that is kept; the whole holds much more."""
        alternatives = tuple(tuple(a.values for a in of_one) for of_one in estimate.alternatives)
        return cls(estimate.frame, estimate.poses, estimate.statuses, alternatives)

    def assessed(self, person: int, status: Status, pose: Array | None = None) -> "TrackedFrame":
        """Return the same with another status of a person, and with another pose, (n_values,), if one is given."""
        statuses = (*self.statuses[:person], status, *self.statuses[person + 1 :])
        poses = self.poses if pose is None else (*self.poses[:person], pose, *self.poses[person + 1 :])
        return self._replace(poses=poses, statuses=statuses)


class BackwardStep(NamedTuple):
    """A frame that was tracked backward. Its poses are proposals: those of the forward pass stay."""

    found: TrackedFrame
    done: int
    """Frames so far."""
    total: int
