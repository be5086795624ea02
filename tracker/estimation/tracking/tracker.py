"""The interface of a tracker: settings, and a generator of pose estimates."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Protocol

import numpy as np

from tracker.errors import TrackerError
from tracker.estimation.tracking.estimate import PoseEstimate
from tracker.estimation.tracking.subjects import Subjects
from tracker.evidence.observer import Observer
from tracker.geometry.arrays import Array
from tracker.geometry.ground_plane import GroundPlane


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
