"""The interface of a tracker: people, settings, a generator of pose estimates, and these."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from tracker.body.limbs import Search
from tracker.body.model import BodyModel
from tracker.errors import Remedy, TrackerError
from tracker.estimation.tracking.confidence import PoseQuality, Status
from tracker.evidence.observer import Observer
from tracker.formats.model_toml import load_model
from tracker.geometry.arrays import Array
from tracker.geometry.ground_plane import GroundPlane


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


Keyframes = Mapping[int, Mapping[int, Array]]
"""Poses that a tracker takes as they are, (n_values,), by frame and index of the person."""


@dataclass(frozen=True, eq=False)
class Subjects:
    """The people of a tracking run. All sequences are indexed by person."""

    models: tuple[BodyModel, ...]
    """The body of each person."""
    tracked: tuple[int, ...]
    """Indices of the people to track. The others keep their start pose or their keyframes."""
    active_dofs: tuple[NDArray[np.bool_] | None, ...]
    """The degrees of freedom of each person that may move, (n_dofs,); None: all. The others keep their start value or
    that of the last keyframe."""
    keyframes: Keyframes
    """Poses that stay as they are; tracking goes on from them."""

    @classmethod
    def of(
        cls,
        models: Sequence[BodyModel],
        tracked: Sequence[int] | None = None,
        active_dofs: Sequence[NDArray[np.bool_] | None] | None = None,
        keyframes: Keyframes | None = None,
    ) -> "Subjects":
        """Return the subjects; by default everybody is tracked, everything may move, and no pose is known."""
        return cls(
            tuple(models),
            tuple(range(len(models))) if tracked is None else tuple(tracked),
            (None,) * len(models) if active_dofs is None else tuple(active_dofs),
            {} if keyframes is None else keyframes,
        )

    def keyframes_at(self, frame: int) -> Mapping[int, Array]:
        """Return the keyframes of a frame by person."""
        return self.keyframes.get(frame, {})


def require_body(preset: str, shape: type, bodies: Mapping[str, BodyModel]) -> None:
    """Check that people have the body of a paper, of any sizes.

    Args:
        preset: name of the body.
        shape: kind of the shapes of its parts.
        bodies: by name of the person.

    Raises:
        TrackerError: a person has another body.
    """
    dofs = load_model(preset).dof_names
    for name, body in bodies.items():
        if body.dof_names != dofs or not all(isinstance(s, shape) for s in body.shapes):
            raise TrackerError(
                f"expected the paper's body {preset} of '{name}', found {body.name} of {body.n_dofs} degrees of "
                "freedom",
                Remedy("paper_body", body=preset),
            )


class TrackerSettings(Protocol):
    """The settings of a tracker: a frozen dataclass of values that JSON can hold."""

    method: ClassVar[str]
    """Name of the method that they belong to, such as `chamfer`."""

    @property
    def whole_run(self) -> bool:
        """Whether the poses of all frames are estimated together at the end of a run."""

    __dataclass_fields__: ClassVar[dict[str, Any]]


@dataclass(frozen=True, eq=False)
class TrackingRun:
    """The input of a tracker besides its settings.

    Raises:
        TrackerError: a start pose or a keyframe holds a value that is not a number.
    """

    observer: Observer
    """Gives the evidence of a frame."""
    subjects: Subjects
    start: Sequence[Array | Sequence[Array]]
    """For each person the pose from which the first frame is predicted, (n_values,), or the poses of the frames before
    it, the last one last, (n, n_values)."""
    frames: Sequence[int]
    """The frames in the order of tracking."""
    fps: float = 30.0
    """Frame rate of the recording, 1/s."""
    floor: GroundPlane | None = None
    """The floor, by which trackers that use silhouettes recover clothes classified as shadows; None if unknown."""

    def __post_init__(self) -> None:
        """Check the poses: from one that is no number, none of the frames after it would be."""
        for person, start in enumerate(self.start):
            _require_numbers(start, f"start pose of person {person + 1}")
        for frame, poses in self.subjects.keyframes.items():
            for person, pose in poses.items():
                _require_numbers(pose, f"keyframe of person {person + 1} at frame {frame}")


class Tracker(Protocol):
    """A tracking method with its settings."""

    @property
    def settings(self) -> TrackerSettings:
        """The settings, which name the method."""

    def estimates(self, run: TrackingRun) -> Iterator[PoseEstimate]:
        """Track all frames in order. Yields the poses of each frame as soon as they are found."""


def _require_numbers(pose: Array | Sequence[Array], name: str) -> None:
    if not np.all(np.isfinite(pose)):
        raise TrackerError(
            f"expected numbers in the {name}, found a value that is none; pose the person there, or begin elsewhere"
        )
