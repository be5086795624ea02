"""The interface of a tracker: settings, a generator of pose estimates, and an optional backward pass."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Protocol, TypeAlias

import numpy as np

from tracker.body.model import PosedBody
from tracker.errors import TrackerError
from tracker.evidence.observer import Observer
from tracker.fitting.gauss_newton import ResidualBlock
from tracker.geometry.arrays import Array
from tracker.geometry.cameras import Region
from tracker.geometry.ground_plane import GroundPlane
from tracker.tracking.estimate import BackwardStep, PoseEstimate, TrackedFrame
from tracker.tracking.subjects import Subjects


class TrackerSettings(Protocol):
    """The settings of a tracker: a frozen dataclass of values that JSON can hold."""

    method: ClassVar[str]
    """Name of the method that they belong to, such as `chamfer`."""

    @property
    def smooth(self) -> bool:
        """Whether the poses are smoothed at the end of a run."""

    @property
    def audit(self) -> bool:
        """Whether the poses are compared with tracks without each view at the end of a run; see `view_tracks`."""

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
    regions: Callable[[int], Sequence[Region | None]] | None = None
    """Returns regions of the views of a frame that other runs over the same frames use, too. They are used where they
    hold the prediction."""
    estimates_keyframes: bool = False
    """Whether tracked people are also estimated on their keyframes, from the frames before. Tracking goes on from the
    keyframe all the same."""
    searches_around: bool = True
    """Whether the surroundings of a pose that is not good are searched, see `covariance_search`."""
    velocities: Callable[[int], Sequence[Array | None]] | None = None
    """Returns the velocity of each person on a frame, (n_dofs,), per frame, if another run has found it; otherwise it
    follows from the prediction. It counts in views whose pictures were taken between frames."""

    def __post_init__(self) -> None:
        """Check the poses: from one that is no number, none of the frames after it would be."""
        for person, start in enumerate(self.start):
            _require_numbers(start, f"start pose of person {person + 1}")
        for frame, poses in self.subjects.keyframes.items():
            for person, pose in poses.items():
                _require_numbers(pose, f"keyframe of person {person + 1} at frame {frame}")


BodiesByFrame: TypeAlias = Mapping[int, Sequence[PosedBody]]
"""All people by frame."""
PathEvidence: TypeAlias = Callable[[int, int], Sequence[ResidualBlock]]
"""Returns the evidence of a frame for the pose of a person, by their numbers; others stay where they are. There is none
on frames without bodies."""


class Tracker(Protocol):
    """A tracking method with its settings."""

    @property
    def settings(self) -> TrackerSettings:
        """The settings, which name the method."""

    def estimates(self, run: TrackingRun) -> Iterator[PoseEstimate]:
        """Track all frames in order. Yields the poses of each frame as soon as they are found."""

    def backward_pass(self, run: TrackingRun, tracked: Sequence[TrackedFrame]) -> Iterator[BackwardStep]:
        """Improve frames on which people were lost. Yields nothing where there is nothing to improve.

        Args:
            run: the run whose frames were tracked; `start` and `frames` are not used.
            tracked: all frames, in the order of tracking, also those of an interrupted run.
        """

    def evidence(self, observer: Observer, bodies: Callable[[], BodiesByFrame]) -> PathEvidence | None:
        """Return the evidence by which the whole path of a person is solved; None for the estimates alone.

        Args:
            observer: of the cameras that were tracked with.
            bodies: returns all people by frame, near their poses. It is called when evidence is asked for.
        """


def _require_numbers(pose: Array | Sequence[Array], name: str) -> None:
    if not np.all(np.isfinite(pose)):
        raise TrackerError(
            f"expected numbers in the {name}, found a value that is none; pose the person there, or begin elsewhere"
        )
